"""Racing: fly through gates in order, as fast as the vehicle can. `courses/gates.py` defines what passing a gate is."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from e2efly.courses.gates import Gates
from e2efly.courses.tracks import load_track
from e2efly.policy.goal import Outcome, Shape
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.course import frames
from e2efly.simulation.scenes.scene import Scene
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race.any_world import AnyRace, begun
from e2efly.tasks.race.goal import RaceGoal
from e2efly.tasks.race.way import NextGates


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape", "gates"], meta_fields=["closed"])
@dataclass(frozen=True)
class Race(RaceGoal):
    """Make it with `Race.of`."""

    @classmethod
    def of(cls, config: RaceConfig, shape: Shape, control_period: float = 0.0, checks: int = 1) -> "Race | AnyRace":
        """Load the track. The result is `AnyRace` if the options ask for a fuller observation of the track.

        Raises:
            ValueError: for an unknown or broken track.
        """
        if config.any_track:
            return AnyRace.of(config, shape)
        track = load_track(config.track)
        if config.laps > 1 and not track.closed:
            raise ValueError(f"laps is {config.laps}; accepted: 0 or 1, as track {track.name!r} is not closed")
        numbers = dataclasses.replace(config, track="")  # resolved here: tracks share a compiled program
        return Race(numbers, shape, Gates.of(track), track.closed)

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Int[Array, " n"]]:
        """At rest and level in a ball around the start, with the heading that the track gives."""
        state = begun(key, n, self.config.position, self.shape, self.gates.start, self.gates.start_yaw)
        return state, jnp.zeros(n, jnp.int32)

    def advance(
        self,
        memory: Int[Array, " n"],
        before: State,
        after: State,
        time: Float[Array, " n"],
        timed_out: Bool[Array, " n"],
    ) -> tuple[Int[Array, " n"], Outcome]:
        """The goal's verdict, with signals for the reward."""
        moved, outcome = super().advance(memory, before, after, time, timed_out)
        here, beyond = memory % self.count, (memory + 1) % self.count
        axes = jnp.stack([jnp.asarray(self.gates.cos), jnp.asarray(self.gates.sin), jnp.zeros(self.count)], axis=-1)
        # after the last gate of an open track the way leads straight on
        onward = axes[beyond] if self.closed else axes[jnp.minimum(here + 1, self.count - 1)]
        centre = jnp.asarray(self.gates.position)
        gates = NextGates((centre[here], centre[here + 1]), (axes[here], onward), jnp.asarray(self.gates.half)[here])
        signals = gates.signals(self.shape, before, after, outcome.arrived)
        return moved, dataclasses.replace(outcome, signals=outcome.signals | signals)

    def scene(self, memory: Int[Array, " n"]) -> Scene:
        """The gates over level ground."""
        n = memory.shape[0]
        return Scene.of({"gate": frames(self.gates, n)}, n)

    def desired_yaw(self, memory: Int[Array, " n"], state: State) -> Float[Array, " n"]:
        """Towards the next gate."""
        d = self.goal(memory, memory) - state.position
        return jnp.arctan2(d[:, 1], d[:, 0] + 1e-6)
