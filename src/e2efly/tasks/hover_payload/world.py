"""Holding a load, which hangs on a cable from the vehicle, at a place."""

import dataclasses
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from e2efly.policy.goal import Outcome
from e2efly.simulation.physics import Load, State
from e2efly.tasks.hover.world import Hover
from e2efly.tasks.hover_payload.goal import HoverPayloadGoal
from e2efly.tasks.verdicts import held_longer


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HoverPayload(HoverPayloadGoal, Hover):
    """Starts around the place. The environment draws the loads (`EnvConfig.payload`)."""

    def offset(self, load: Load) -> Float[Array, "n 3"]:
        """Where the load is to hang minus where it is, world, m: a cable's length below the hook of a level vehicle at
        its place.
        """
        below = jnp.zeros_like(load.position).at[:, 2].set(load.hook + load.length)
        return jnp.asarray(self.config.target) - below - load.position

    def advance(
        self,
        memory: Float[Array, " n"],
        before: State,
        after: State,
        time: Float[Array, " n"],
        timed_out: Bool[Array, " n"],
    ) -> tuple[Float[Array, " n"], Outcome]:
        """Judge a step. Success: the load within the radius for the last `hold_s` of the episode.

        It fails where hovering does, and where the load touches the ground. For the reward, the load's offset and
        velocity take the place of the vehicle's. A vehicle without a load is judged as in flight.
        """
        held, flown = super().advance(memory, before, after, time, timed_out)
        if before.load is None or after.load is None:
            return held, flown
        offset, load = self.offset(after.load), after.load
        error = jnp.linalg.norm(jax.lax.stop_gradient(offset), axis=-1)
        held = held_longer(memory, error < self.config.radius, self.control_period)
        crashed = flown.crashed | (load.position[:, 2] <= 0)
        return held, dataclasses.replace(
            flown,
            terminated=crashed,
            success=timed_out & ~crashed & (held >= self.config.hold_s - 1e-4),
            arrived=(held > 0) & (memory == 0),
            crashed=crashed,
            error=error,
            signals={"offset": offset, "previous_offset": self.offset(before.load), "velocity": load.velocity},
        )
