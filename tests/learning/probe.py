"""Environments so small that the right answer is known, behind the interface that the algorithms use."""

import dataclasses
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from e2efly.environment import Step
from e2efly.policy.observation import ATTITUDE, Field
from e2efly.simulation import rewards
from e2efly.simulation.physics import State

FIELDS = (Field("position_error", 3, "world", "m", 1.0, "constant"), ATTITUDE)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ProbeState:
    """The last action is kept as the rotor speed."""

    vehicle: State
    count: Array
    images: tuple[()] = ()
    key: None = None
    tick: None = None


@dataclass(frozen=True)
class Probe:
    """Pays -|x - target|^2, where x is the last action (delay 0) or the one before (delay 1), plus a constant."""

    target: tuple[float, float, float, float] = (0.3, -0.5, 0.0, 0.6)
    delay: int = 0
    constant: float = 0.0
    weight: float = 1.0
    length: int = 4
    ends_for_good: bool = True
    told: bool = False
    """Whether a critic is told the last action."""

    fields = FIELDS
    control_period = 1.0
    hover = np.zeros(4, np.float32)
    action_size = 4
    cameras = ()

    @property
    def privileged_size(self) -> int:
        return 4 if self.told else 0

    def reset(self, key: Array, n: int) -> tuple[ProbeState, Array]:
        del key
        zero = jnp.zeros((n, 3))
        level = jnp.tile(jnp.array([1.0, 0, 0, 0]), (n, 1))
        return ProbeState(State(zero, zero, level, zero, jnp.zeros((n, 4))), jnp.zeros(n)), self._observe(n)

    def _observe(self, n: int) -> Array:
        return jnp.tile(jnp.array([1.0, 0.5, -0.5, 1.0, 0, 0, 0]), (n, 1))

    def _advance(self, state: ProbeState, action: Array) -> tuple[ProbeState, Step]:
        acted = state.vehicle.rotor_speed if self.delay else action
        error = rewards.norm(acted - jnp.array(self.target))  # with a gradient where it is zero
        count = state.count + 1
        over = count >= self.length
        n = action.shape[0]
        reached = ProbeState(dataclasses.replace(state.vehicle, rotor_speed=action), count)
        no = jnp.zeros(n, bool)
        observation = self._observe(n)
        out = Step(
            observation=observation,
            final_observation=observation,
            reward=self.constant - self.weight * error**2,
            terms={"constant": jnp.full(n, self.constant), "error": -self.weight * error**2},
            terminated=over if self.ends_for_good else no,
            truncated=no if self.ends_for_good else over,
            success=over,
            error=error,
        )
        return reached, out

    def privileged(self, state: ProbeState) -> Array:
        return state.vehicle.rotor_speed[:, : self.privileged_size]

    def step(
        self, state: ProbeState, action: Array, *, restart: bool = True, privileged: bool = False
    ) -> tuple[ProbeState, Step]:
        reached, out = self._advance(state, action)
        if privileged:
            out = dataclasses.replace(out, final_privileged=self.privileged(reached))
        if restart:
            reached = dataclasses.replace(reached, count=jnp.where(out.done, 0.0, reached.count))
        return reached, out
