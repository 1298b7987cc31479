"""Racing: fly through gates in order, as fast as the vehicle can. `courses/gates.py` defines what passing a gate is."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

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
from e2efly.tasks.race.swinging import SwingingMemory, gates_at, passed_by, rows
from e2efly.tasks.race.way import NextGates

jax.tree_util.register_dataclass(SwingingMemory)


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

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Any]:
        """At rest and level in a ball around the start, with the heading that the track gives."""
        state = begun(key, n, self.config.position, self.shape, self.gates.start, self.gates.start_yaw)
        passed = jnp.zeros(n, jnp.int32)
        return state, self.swinging(jax.random.fold_in(key, 1), passed) if self.config.swing else passed

    def swinging(self, key: PRNGKeyArray, passed: Int[Array, " n"]) -> SwingingMemory:
        """How the gates of each vehicle swing: up to so far, with any phase."""
        c, n = self.config, passed.shape[0]
        far, phase, period = jax.random.uniform(key, (3, n, self.count))
        shortest, longest = c.swing_period
        rate = 2 * jnp.pi / (shortest + (longest - shortest) * period)
        far, phase = c.swing * far, 2 * jnp.pi * phase
        return SwingingMemory(passed, far * jnp.cos(phase), far * jnp.sin(phase), rate, jnp.zeros(n))

    def advance(
        self,
        memory: Any,
        before: State,
        after: State,
        time: Float[Array, " n"],
        timed_out: Bool[Array, " n"],
    ) -> tuple[Any, Outcome]:
        """The goal's verdict, with signals for the reward. They are those of a gate that stands still, for a vehicle
        that was where it was relative to the gate.
        """
        moved, outcome = super().advance(memory, before, after, time, timed_out)
        passed, at = passed_by(memory), gates_at(self.gates, memory, self.closed, time)
        here, beyond = passed % self.count, (passed + 1) % self.count
        if at.moved is not None:
            before = dataclasses.replace(before, position=before.position + rows(at.moved, here))
        axes = jnp.stack([jnp.asarray(self.gates.cos), jnp.asarray(self.gates.sin), jnp.zeros(self.count)], axis=-1)
        # after the last gate of an open track the way leads straight on
        onward = axes[beyond] if self.closed else axes[jnp.minimum(here + 1, self.count - 1)]
        centre = jnp.asarray(at.position)
        gates = NextGates(
            (rows(centre, here), rows(centre, here + 1)), (axes[here], onward), jnp.asarray(self.gates.half)[here]
        )
        signals = gates.signals(self.shape, before, after, outcome.arrived)
        return moved, dataclasses.replace(outcome, signals=outcome.signals | signals)

    def scene(self, memory: Any) -> Scene:
        """The gates over level ground."""
        n = passed_by(memory).shape[0]
        solids = frames(self.gates, n)
        if isinstance(memory, SwingingMemory):
            left = jnp.stack([-jnp.asarray(self.gates.sin), jnp.asarray(self.gates.cos), jnp.zeros(self.count)], -1)
            cosine, sine = memory.cosine[..., None] * left, memory.sine[..., None] * left
            solids = dataclasses.replace(solids, cosine=cosine, sine=sine, rate=memory.rate)
        return Scene.of({"gate": solids}, n)

    def desired_yaw(self, memory: Any, state: State) -> Float[Array, " n"]:
        """Towards the next gate."""
        d = rows(self.centres(memory), passed_by(memory) % self.count) - state.position
        return jnp.arctan2(d[:, 1], d[:, 0] + 1e-6)
