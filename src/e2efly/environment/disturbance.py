"""Effects that a vehicle file does not include: gusts, uneven rotors, a sagging battery, and drifting poses."""

from dataclasses import dataclass, fields

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import DisturbanceConfig
from e2efly.tasks.task import uniform

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
    rotor_share: Float[Array | np.ndarray, "n 4"]
    """Thrust of each rotor relative to that of the thrust map, with a full battery."""
    sag: Float[Array | np.ndarray, " n"]
    """Share of all thrust that is lost by the end of the episode."""
    drift_rate: Float[Array | np.ndarray, " n"]
    """Standard deviation of the poses' drift after one second, m per axis."""
    drift: Float[Array | np.ndarray, "n 3"]
    """Current error of the observed position, world, m."""

    @staticmethod
    def none(n: int) -> "Disturbance":
        """No disturbance."""
        zero, zeros = jnp.zeros(n), jnp.zeros((n, 3))
        return Disturbance(zero, jnp.ones(n), zeros, jnp.ones((n, 4)), zero, zero, zeros)

    def share(self, progress: Float[Array, " n"]) -> Float[Array, "n 4"]:
        """Thrust of each rotor relative to that of the thrust map, after this share of the episode."""
        return jnp.asarray(self.rotor_share) * (1 - self.sag * progress)[:, None]


def draw(config: DisturbanceConfig, key: PRNGKeyArray, n: int) -> Disturbance:
    """The disturbances of n episodes.

    Args:
        config: the largest strengths. Each episode draws its own strength uniformly between zero and these.
        key: the random key.
        n: the number of episodes.
    """
    strength_key, rotor_key, gust_key = jax.random.split(key, 3)
    strength = jax.random.uniform(strength_key, (3, n))
    unit = uniform(rotor_key, n, 5)
    gust_speed = config.gust * strength[0]
    return Disturbance(
        gust_speed=gust_speed,
        gust_time=jnp.full(n, config.gust_time),
        gust=gust_speed[:, None] * jax.random.normal(gust_key, (n, 3)),
        rotor_share=(1 + config.rotor * unit[:, :4]) * (1 + config.thrust * unit[:, 4:]),
        sag=config.sag * strength[1],
        drift_rate=config.drift * strength[2],
        drift=jnp.zeros((n, 3)),
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
    return Disturbance(d.gust_speed, d.gust_time, gust, d.rotor_share, d.sag, d.drift_rate, drift)
