"""Racing at a commanded speed: one of several tracks in each episode, with gates at slightly different places."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.courses.gates import Tracks
from e2efly.policy.goal import Outcome, Shape
from e2efly.simulation.physics import State
from e2efly.tasks.race.any_goal import AnyRaceMemory
from e2efly.tasks.race.any_world import AnyRace, begun, displaced, several
from e2efly.tasks.race_speed import RaceSpeedConfig
from e2efly.tasks.race_speed.goal import RaceSpeedGoal


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape", "given"], meta_fields=[])
@dataclass(frozen=True)
class RaceSpeed(AnyRace, RaceSpeedGoal):
    """Make it with `RaceSpeed.of`."""

    config: RaceSpeedConfig
    given: Tracks
    """The tracks from which each episode's is made, before gates are displaced."""

    @classmethod
    def of(cls, config: RaceSpeedConfig, shape: Shape, control_period: float = 0.0, checks: int = 1) -> "RaceSpeed":
        """Load the tracks.

        Raises:
            ValueError: for an unknown or broken track, and for tracks that `several` refuses.
        """
        given = several(config.track)
        if config.laps > 1 and not given.closed.all():
            raise ValueError(f"laps is {config.laps}; accepted: 0 or 1, as not all of the tracks are closed")
        # the tracks are resolved here, so that they share a compiled program
        return RaceSpeed(dataclasses.replace(config, track=("",) * len(config.track)), shape, given)

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, AnyRaceMemory]:
        """At rest and level in a ball around the start of a track, with the heading of the track."""
        track_key, state_key, speed_key = jax.random.split(key, 3)
        c = self.config
        tracks = displaced(track_key, n, self.given, c.gate_position, c.gate_yaw)
        state = begun(state_key, n, c.position, self.shape, tracks.gates.start, tracks.gates.start_yaw)
        low, high = c.speed
        speed = low * (high / low) ** jax.random.uniform(speed_key, (n,))
        return state, AnyRaceMemory(tracks, jnp.zeros(n, jnp.int32), speed)

    def advance(
        self, memory: AnyRaceMemory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[AnyRaceMemory, Outcome]:
        """The verdict of any race, with the commanded speed and velocity for the reward."""
        moved, outcome = super().advance(memory, before, after, time, timed_out)
        velocity = self.desired_velocity(memory, time, after)
        wanted = {"desired_speed": jnp.linalg.norm(velocity, axis=-1), "desired_velocity": velocity}
        return moved, dataclasses.replace(outcome, signals=outcome.signals | wanted)
