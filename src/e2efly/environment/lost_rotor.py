"""A rotor that stops without notice in the middle of an episode."""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.environment.draws import between
from e2efly.vehicles.vehicle import Vehicle


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LostRotor:
    """When the rotors of n vehicles stop."""

    stops: Float[Array | np.ndarray, "n r"]
    """Time since the start of the episode from which a rotor is no longer driven, s. inf: it does not stop."""

    def weaker(self, plant: Vehicle, time: Float[Array, " n"]) -> Vehicle:
        """A plant whose stopped rotors have a ceiling of zero, so that they run down with the lag of their motors.

        A rotor at rest neither lifts nor turns the vehicle, and the flight controller goes on commanding it.
        """
        driven = jnp.where(time[:, None] < jnp.asarray(self.stops), jnp.inf, 0.0)
        own = plant.rotor_speed_ceiling
        return replace(plant, rotor_speed_ceiling=driven if own is None else jnp.minimum(own, driven))


def draw(chance: float | Array, span: Float[Array | np.ndarray, "2"], key: PRNGKeyArray, n: int, r: int) -> LostRotor:
    """The rotors that n vehicles lose: each vehicle at most one, drawn uniformly.

    Args:
        chance: the probability that an episode loses a rotor.
        span: earliest and latest time of it, s; drawn uniformly.
        key: the random key.
        n: the number of episodes.
        r: the number of rotors of each vehicle.
    """
    whether, when, which = jax.random.split(key, 3)
    lost = jax.random.uniform(whether, (n, 1)) < chance
    chosen = jax.random.randint(which, (n, 1), 0, r) == jnp.arange(r)
    return LostRotor(jnp.where(lost & chosen, between(when, n, span)[:, None], jnp.inf))
