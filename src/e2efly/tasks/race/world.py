"""Racing: fly through gates in order, as fast as the vehicle allows. What passing is: `courses/gates.py`."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from e2efly.courses.gates import Gates
from e2efly.courses.tracks import load_track
from e2efly.deploy.goals import GatesGoal
from e2efly.observation import Field
from e2efly.physics import State
from e2efly.physics.rotation import from_euler
from e2efly.scenes.course import frames
from e2efly.scenes.scene import Scene
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.task import Outcome, Shape, at_rest, into_ball, offsets, touches_ground, uniform

LOWEST_START = 0.3
"""Starts are drawn at least this high over the feet, m."""

jax.tree_util.register_dataclass(Gates, data_fields=list(Gates.__dataclass_fields__), meta_fields=[])


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape", "gates"], meta_fields=["closed"])
@dataclass(frozen=True)
class Race:
    """Make it with `Race.of`. The task's memory is the number of gates passed."""

    config: RaceConfig
    shape: Shape
    gates: Gates
    closed: bool

    fields = (Field("gates", 6, "world", "m", 4.0, "centres of the next two gates minus vehicle position"),)

    @staticmethod
    def of(config: RaceConfig, shape: Shape, control_period: float = 0.0, substeps: int = 1) -> "Race":
        """Load the track.

        Raises:
            ValueError: for an unknown or broken track.
        """
        del control_period, substeps
        track = load_track(config.track)
        if config.laps > 1 and not track.closed:
            raise ValueError(f"laps is {config.laps}; accepted: 0 or 1, as track {track.name!r} is not closed")
        numbers = dataclasses.replace(config, track="")  # resolved here: tracks share a compiled program
        return Race(numbers, shape, Gates.of(track), track.closed)

    @property
    def episode_s(self) -> float | Array:
        """Time limit, s."""
        return self.config.episode_s

    @property
    def count(self) -> int:
        """Gates of the track."""
        return self.gates.count

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Int[Array, " n"]]:
        """At rest and level in a ball about the start, heading as the track says."""
        u = uniform(key, n, 3)
        position = jnp.asarray(self.gates.start) + self.config.position * into_ball(u)
        lowest = self.shape.feet_height + LOWEST_START
        position = position.at[:, 2].max(lowest)
        zero = jnp.zeros(n)
        state = at_rest(position)
        return dataclasses.replace(state, quaternion=from_euler(zero, zero, zero + self.gates.start_yaw)), jnp.zeros(
            n, jnp.int32
        )

    def goal(self, memory: Int[Array, " n"], time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """The next gate's centre."""
        del time
        return jnp.asarray(self.gates.position)[memory % self.count]

    def targets(self, memory: Int[Array, " n"], time: Float[Array, " n"]) -> Float[Array, "n 2 3"]:
        """The centres of the next two gates."""
        del time
        index = memory % self.count
        return jnp.asarray(self.gates.position)[jnp.stack([index, index + 1], axis=-1)]

    def observe(self, memory: Int[Array, " n"], time: Float[Array, " n"], state: State) -> Float[Array, "n 6"]:
        """The same, minus position."""
        return offsets(self.targets(memory, time), state)

    def scene(self, memory: Int[Array, " n"]) -> Scene:
        """The gates over level ground."""
        n = memory.shape[0]
        return Scene.of({"gate": frames(self.gates, n)}, n)

    def flight_goal(self, memory: Any) -> GatesGoal:
        """See `e2efly.validate.starts.goal_of`."""
        del memory
        laps = int(self.config.laps) if self.closed else 1
        gates = jax.tree.map(np.asarray, self.gates)
        return GatesGoal(gates, self.closed, laps, float(self.shape.radius), float(self.config.fence))

    def desired_yaw(self, memory: Int[Array, " n"], state: State) -> Float[Array, " n"]:
        """Towards the next gate."""
        d = self.goal(memory, memory) - state.position
        return jnp.arctan2(d[:, 1], d[:, 0] + 1e-6)

    def advance(
        self,
        memory: Int[Array, " n"],
        before: State,
        after: State,
        time: Float[Array, " n"],
        timed_out: Bool[Array, " n"],
    ) -> tuple[Int[Array, " n"], Outcome]:
        """Success: the last gate of the last lap passed. Crossings are judged on the straight line of the step."""
        del timed_out
        index, radius = memory % self.count, self.shape.radius
        passed, missed, struck = self.gates.judge(index, before.position, after.position, radius)
        error = jnp.linalg.norm(after.position - self.goal(memory, time), axis=-1)
        crashed = missed | struck | (error > self.config.fence) | touches_ground(self.shape, after)
        passed = passed & ~crashed
        memory = memory + passed
        laps = self.config.laps if self.closed else 1
        finished = passed & (laps > 0) & (memory >= laps * self.count)
        return memory, Outcome(
            terminated=crashed | finished, success=finished, arrived=passed, crashed=crashed, error=error
        )
