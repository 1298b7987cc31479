"""Errors of what the policy is told of the vehicle: low-passed, turned, jumping and repeated poses."""

import dataclasses
from dataclasses import dataclass, fields

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import EstimateConfig
from e2efly.environment.draws import sometimes
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler, multiply, normalize
from e2efly.tasks.task import uniform

jax.tree_util.register_dataclass(
    EstimateConfig, data_fields=[field.name for field in fields(EstimateConfig)], meta_fields=[]
)

Rows = Array | np.ndarray
BETWEEN_JUMPS, JUMP = 4.0, 0.2
"""Mean time between two jumps of the poses, and mean length of one, s."""
SIZES = np.array([3, 3, 4, 3])
"""Numbers of position, velocity, attitude and body rates in a row of `_packed`."""
ATTITUDE = np.repeat([False, False, True, False], SIZES)
POSE = np.repeat([True, True, True, False], SIZES)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PoseErrors:
    """The state estimator of n vehicles: what is drawn for an episode, and what changes in it."""

    lag: Float[Array | np.ndarray, "n 4"]
    """Time constants of the low-passes of position, velocity, attitude and body rates, s."""
    turned: Float[Array | np.ndarray, "n 3"]
    """Constant errors: heading about world z, roll and pitch about the body's axes, rad."""
    jump: Float[Array | np.ndarray, "n 3"]
    """Error of the position while poses are wrong, world, m."""
    hold: Float[Array | np.ndarray, " n"]
    """How often a pose is repeated at most, control steps."""
    smooth: Float[Array | np.ndarray, "n 13"]
    """The low-passed state."""
    told: Float[Array | np.ndarray, "n 13"]
    """The same, as the policy is told it: with repetitions."""
    left: Float[Array | np.ndarray, " n"]
    """For how many more control steps the pose is repeated."""
    wrong: Float[Array | np.ndarray, " n"]
    """1 while the position jumps, otherwise 0."""

    @staticmethod
    def of(lag: Rows, turned: Rows, jump: Rows, hold: Rows, seen: State) -> "PoseErrors":
        """The estimator at the start of an episode, when it knows the state. The first four are its fields."""
        row, zero = _packed(seen), jnp.zeros_like(seen.position[:, 0])
        return PoseErrors(lag, turned, jump, hold, row, row, zero, zero)

    def shown(self, seen: State) -> State:
        """The state that the policy is told: `seen` with the estimator's errors."""
        position, velocity, quaternion, body_rate = jnp.split(self.told, np.cumsum(SIZES)[:-1], axis=-1)
        heading, roll, pitch = jnp.moveaxis(jnp.asarray(self.turned), -1, 0)
        zero = jnp.zeros_like(heading)
        attitude = multiply(from_euler(zero, zero, heading), normalize(quaternion))
        return dataclasses.replace(
            seen,
            position=position + self.wrong[:, None] * self.jump,
            velocity=velocity,
            quaternion=multiply(attitude, from_euler(roll, pitch, zero)),
            body_rate=body_rate,
        )

    def after(self, key: PRNGKeyArray, seen: State, dt: float) -> "PoseErrors":
        """The estimator `dt` s later, when it measures the state `seen`.

        A low-pass is of first order and exact for a state that stays as it is for `dt`. Each pose draws how often it
        is repeated.
        """
        row = _packed(seen)
        # of the two quaternions of an attitude the one that is nearer to the last
        opposite = jnp.sum(self.smooth * row * ATTITUDE, axis=-1) < 0
        row = jnp.where(opposite[:, None] & ATTITUDE, -row, row)
        kept = jnp.repeat(jnp.exp(-dt / jnp.maximum(self.lag, 1e-6)), SIZES, axis=-1, total_repeat_length=13)
        smooth = row + kept * (self.smooth - row)
        held = (self.left > 0)[:, None] & POSE
        told = jnp.where(held, self.told, smooth)
        return dataclasses.replace(self.counted(key, dt), smooth=smooth, told=told)

    def counted(self, key: PRNGKeyArray, dt: float) -> "PoseErrors":
        """The estimator `dt` s later, in what does not depend on the state: `left` and `wrong`."""
        chance = jax.random.uniform(key, (2, *self.hold.shape))
        turns = chance[1] < dt / jnp.where(self.wrong > 0, JUMP, BETWEEN_JUMPS)
        return dataclasses.replace(
            self,
            left=jnp.where(self.left > 0, self.left - 1, jnp.floor((self.hold + 1) * chance[0])),
            wrong=jnp.where(turns, 1 - self.wrong, self.wrong),
        )


def draw(config: EstimateConfig, key: PRNGKeyArray, seen: State) -> PoseErrors:
    """The estimators of n episodes that start in the states `seen`."""
    n = seen.position.shape[0]
    names = "position_lag", "velocity_lag", "attitude_lag", "body_rate_lag", "yaw", "tilt", "jump", "hold"
    strength = sometimes(key, n, [getattr(config, name) for name in names])
    way = uniform(jax.random.fold_in(key, 1), n, 5)
    side, angle = jnp.where(way[:, 0] < 0, -1.0, 1.0), jnp.pi * way[:, 1]
    turned = [side * strength[:, 4], jnp.cos(angle) * strength[:, 5], jnp.sin(angle) * strength[:, 5]]
    direction = way[:, 2:] / jnp.linalg.norm(way[:, 2:], axis=-1, keepdims=True)
    return PoseErrors.of(
        strength[:, :4], jnp.stack(turned, axis=-1), strength[:, 6:7] * direction, strength[:, 7], seen
    )


def _packed(state: State) -> Float[Array, "n 13"]:
    return jnp.concatenate([state.position, state.velocity, state.quaternion, state.body_rate], axis=-1)
