"""Effects that a vehicle file does not include: gusts, pushes, uneven and weak rotors, a sagging battery, drift."""

from dataclasses import dataclass, fields, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import DisturbanceConfig
from e2efly.simulation.physics import Physics
from e2efly.simulation.physics.body import rotor_speed_for
from e2efly.tasks.task import uniform
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

jax.tree_util.register_dataclass(
    DisturbanceConfig, data_fields=[field.name for field in fields(DisturbanceConfig)], meta_fields=[]
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Disturbance:
    """The disturbances of n vehicles: values drawn for an episode, and values that change in it."""

    gust_speed: Float[Array | np.ndarray, " n"]
    """Standard deviation of the gusts per axis, m/s."""
    gust_time: Float[Array | np.ndarray, " n"]
    """Correlation time of the gusts, s."""
    gust: Float[Array | np.ndarray, "n 3"]
    """Current gust, world, m/s."""
    rotor_share: Float[Array | np.ndarray, "n r"]
    """Thrust of each rotor relative to that of the thrust map, with a full battery."""
    sag: Float[Array | np.ndarray, " n"]
    """Share of all thrust that is lost by the end of the episode."""
    drift_rate: Float[Array | np.ndarray, " n"]
    """Standard deviation of the poses' drift after one second, m per axis."""
    drift: Float[Array | np.ndarray, "n 3"]
    """Current error of the observed position, world, m."""
    ceiling: Float[Array | np.ndarray, "n r"]
    """Highest thrust of each rotor relative to that of the thrust map at full speed. 1: no ceiling of its own."""
    push: Float[Array | np.ndarray, "n 2"]
    """Acceleration by a constant horizontal force from outside, world, m/s^2."""
    plain_mixer: Float[Array | np.ndarray, " n"]
    """1: the mixer clips each rotor by itself. 0: attitude has priority over thrust."""

    @staticmethod
    def none(n: int, rotors: int = 4) -> "Disturbance":
        """No disturbance."""
        zero, zeros, whole = jnp.zeros(n), jnp.zeros((n, 3)), jnp.ones((n, rotors))
        return Disturbance(zero, jnp.ones(n), zeros, whole, zero, zero, zeros, whole, zeros[:, :2], zero)

    def share(self, progress: Float[Array, " n"]) -> Float[Array, "n r"]:
        """Thrust of each rotor relative to that of the thrust map, after this share of the episode."""
        return jnp.asarray(self.rotor_share) * (1 - self.sag * progress)[:, None]

    def mixed(self, physics: Physics) -> Physics:
        """Physics with these mixers."""
        return replace(physics, mixer=replace(physics.mixer, plain=jnp.asarray(self.plain_mixer)))

    def weaker(self, plant: Vehicle, known: Vehicle, thrust_max: float | Array) -> Vehicle:
        """A plant whose rotors have these ceilings, too.

        Full speed is that at which the thrust map of the vehicle that the flight controller knows has its largest
        thrust, `thrust_max`, N.
        """
        shares = jnp.moveaxis(jnp.asarray(self.ceiling), -1, 0)
        speeds = rotor_speed_for(known, tuple(share * thrust_max for share in shares))
        most = jnp.stack([jnp.where(s < 1, w, jnp.inf) for s, w in zip(shares, speeds, strict=True)], axis=-1)
        own = plant.rotor_speed_ceiling
        return replace(plant, rotor_speed_ceiling=most if own is None else jnp.minimum(own, most))


def level(offset: Any, positions: Any) -> Any:
    """Offsets in the body's x-y plane, (*n, 2), m, with as many components as positions have."""
    return jnp.pad(offset, [(0, 0)] * (offset.ndim - 1) + [(0, positions.shape[-1] - 2)])


def draw(config: DisturbanceConfig, key: PRNGKeyArray, n: int, rotors: int = 4) -> Disturbance:
    """The disturbances of n episodes.

    Args:
        config: the largest strengths. Each episode draws its own strength uniformly between zero and these. The mixer
            is of one kind or of the other.
        key: the random key.
        n: the number of episodes.
        rotors: the number of rotors of each vehicle.
    """
    strength_key, rotor_key, gust_key = jax.random.split(key, 3)
    strength = jax.random.uniform(strength_key, (3, n))
    unit = uniform(rotor_key, n, rotors + 1)
    gust_speed = config.gust * strength[0]
    pushed, way = jax.random.uniform(jax.random.fold_in(key, 4), (2, n)) * jnp.array([[GRAVITY], [2 * jnp.pi]])
    return Disturbance(
        gust_speed=gust_speed,
        gust_time=jnp.full(n, config.gust_time),
        gust=gust_speed[:, None] * jax.random.normal(gust_key, (n, 3)),
        rotor_share=(1 + config.rotor * unit[:, :-1]) * (1 + config.thrust * unit[:, -1:]),
        sag=config.sag * strength[1],
        drift_rate=config.drift * strength[2],
        drift=jnp.zeros((n, 3)),
        ceiling=1 - config.ceiling * jax.random.uniform(jax.random.fold_in(key, 3), (n, rotors)),
        push=(config.push * pushed * jnp.stack([jnp.cos(way), jnp.sin(way)])).T,
        plain_mixer=1.0 * (jax.random.uniform(jax.random.fold_in(key, 5), (n,)) < config.plain_mixer),
    )


def advance(d: Disturbance, key: PRNGKeyArray, dt: float) -> Disturbance:
    """The disturbances `dt` s later.

    Each axis of a gust is a first-order Gauss-Markov process. Its spectrum is the longitudinal spectrum of the Dryden
    model (MIL-F-8785C, 3.7.2). The drift is a random walk.
    """
    noise = jax.random.normal(key, (2, *d.gust.shape), d.gust.dtype)
    kept = jnp.exp(-dt / d.gust_time)
    fresh = d.gust_speed * jnp.sqrt(1 - kept**2)
    gust = kept[:, None] * d.gust + fresh[:, None] * noise[0]
    drift = d.drift + d.drift_rate[:, None] * jnp.sqrt(dt) * noise[1]
    return replace(d, gust=gust, drift=drift)
