"""Racing by eye: one of several tracks in each episode, with gates at slightly different places."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import PRNGKeyArray

from e2efly.courses.gates import Tracks
from e2efly.policy.goal import Shape
from e2efly.simulation.physics import State
from e2efly.tasks.race.any_goal import AnyRaceMemory
from e2efly.tasks.race.any_world import AnyRace, begun, displaced, several
from e2efly.tasks.race_eyes import RaceEyesConfig
from e2efly.tasks.task import uniform


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape", "given"], meta_fields=[])
@dataclass(frozen=True)
class RaceEyes(AnyRace):
    """Make it with `RaceEyes.of`."""

    config: RaceEyesConfig
    given: Tracks
    """The tracks from which each episode's is made, before gates are displaced."""

    @classmethod
    def of(cls, config: RaceEyesConfig, shape: Shape, control_period: float = 0.0, checks: int = 1) -> "RaceEyes":
        """Load the tracks.

        Raises:
            ValueError: for an unknown or broken track, and for tracks that `several` refuses.
        """
        given = several(config.track, config.scale, only=config.only)
        if config.laps > 1 and not given.closed.all():
            raise ValueError(f"laps is {config.laps}; accepted: 0 or 1, as not all of the tracks are closed")
        # the tracks are resolved here, so that they share a compiled program
        return RaceEyes(dataclasses.replace(config, track=("",) * len(config.track)), shape, given)

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, AnyRaceMemory]:
        """At rest and level in a ball around the start of a track, roughly with the heading of the track."""
        track_key, state_key, heading_key = jax.random.split(key, 3)
        c = self.config
        tracks = displaced(track_key, n, self.given, c.gate_position, c.gate_yaw, c.only)
        heading = tracks.gates.start_yaw + c.heading * uniform(heading_key, n, 1)[:, 0]
        state = begun(state_key, n, c.position, self.shape, tracks.gates.start, heading)
        return state, AnyRaceMemory(tracks, jnp.zeros(n, jnp.int32), jnp.full(n, jnp.inf))
