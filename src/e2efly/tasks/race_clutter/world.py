"""Racing in clutter: through gates that stand a little elsewhere in every world, among obstacles that are only seen."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from e2efly.courses.gates import Gates
from e2efly.courses.tracks import RaceTrack, load_track
from e2efly.observation import Field
from e2efly.physics import State
from e2efly.physics.rotation import from_euler
from e2efly.scenes.course import frames
from e2efly.scenes.generate import clutter
from e2efly.scenes.scene import Scene, Solids
from e2efly.scenes.shapes import FAR
from e2efly.tasks.race_clutter import RaceClutterConfig
from e2efly.tasks.task import Outcome, Shape, at_rest, into_ball, offsets, struck, uniform

APPROACH = 0.7
"""Obstacles keep clear of the points this far before and behind a gate, too, m."""
PASSING = 1.5
"""Within this of its plane a vehicle should be in line with a gate's opening, m."""
BEHIND = 0.3
"""The wanted velocity points to this far behind a gate, m."""
LOOKING = 5.0
"""How far ahead on its way a vehicle should look, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Memory:
    """The world of each vehicle, and how far it is."""

    gates: Gates
    """Each with a leading axis n."""
    obstacles: dict[str, Solids]
    passed: Int[Array, " n"]
    """Gates."""
    speed: Float[Array, " n"]
    """Commanded, m/s."""


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["config", "shape", "gates"],
    meta_fields=["closed", "control_period", "checks"],
)
@dataclass(frozen=True)
class RaceClutter:
    """Make it with `RaceClutter.of`."""

    config: RaceClutterConfig
    shape: Shape
    gates: Gates
    """Where they stand on average."""
    closed: bool
    control_period: float
    checks: int
    """How often a control step is checked for collisions."""

    fields = (
        Field("gates", 6, "world", "m", 4.0, "centres of the next two gates minus vehicle position"),
        Field("gate_axes", 6, "world", "1", 1.0, "unit vectors along which the next two gates are flown through"),
        Field("desired_speed", 1, "none", "m/s", 8.0, "speed to fly at"),
    )

    @staticmethod
    def of(config: RaceClutterConfig, shape: Shape, control_period: float, checks: int) -> "RaceClutter":
        """Load the track.

        Raises:
            ValueError: for an unknown or broken track.
        """
        track = _drawn_larger(load_track(config.track), config.scale)
        numbers = dataclasses.replace(config, track="")  # resolved here: tracks share a compiled program
        return RaceClutter(numbers, shape, Gates.of(track), track.closed, control_period, checks)

    @property
    def episode_s(self) -> float | Array:
        """Time limit, s."""
        return self.config.episode_s

    @property
    def count(self) -> int:
        """Gates of the track."""
        return self.gates.count

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Memory]:
        """At rest in a ball about the track's start, every world another."""
        gate_key, clutter_key, state_key = jax.random.split(key, 3)
        c, u = self.config, uniform(state_key, n, 4)
        gates = self._moved(gate_key, n)
        state = at_rest(jnp.asarray(self.gates.start) + c.position * into_ball(u[:, :3]))
        zero = jnp.zeros(n)
        quaternion = from_euler(zero, zero, zero + self.gates.start_yaw)
        axes = jnp.stack([gates.cos, gates.sin, jnp.zeros_like(gates.cos)], axis=-1)
        centres = gates.position[:, :-1]
        keep = jnp.concatenate(
            [state.position[:, None], centres, centres - APPROACH * axes, centres + APPROACH * axes], axis=1
        )
        path = jnp.concatenate([state.position[:, None], gates.position if self.closed else centres], axis=1)
        obstacles = clutter(clutter_key, n, c.clutter, path, keep, jnp.max(jnp.asarray(self.gates.half)))
        low, high = c.speed
        speed = (low + high) / 2 + (high - low) / 2 * u[:, 3]
        memory = Memory(gates, obstacles, jnp.zeros(n, jnp.int32), speed)
        return dataclasses.replace(state, quaternion=quaternion), memory

    def _moved(self, key: PRNGKeyArray, n: int) -> Gates:
        c, g = self.config, self.gates
        u = uniform(key, n, 4 * self.count).reshape(n, self.count, 4)
        move, turn = c.gate_position * u[..., :3], c.gate_yaw * u[..., 3]
        cos, sin = jnp.cos(turn), jnp.sin(turn)
        last = move[:, :1] if self.closed else move[:, -1:]
        return Gates(
            start=g.start,
            start_yaw=g.start_yaw,
            position=jnp.asarray(g.position) + jnp.concatenate([move, last], axis=1),
            cos=g.cos * cos - g.sin * sin,
            sin=g.sin * cos + g.cos * sin,
            half=g.half,
        )

    def targets(self, memory: Memory) -> Float[Array, "n 2 3"]:
        """The centres of the next two gates."""
        index = memory.passed % self.count
        return _rows(memory.gates.position, jnp.stack([index, index + 1], axis=-1))

    def goal(self, memory: Memory, time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """The next gate's centre."""
        del time
        return self.targets(memory)[:, 0]

    def axes(self, memory: Memory) -> Float[Array, "n 2 3"]:
        """Directions of the next two gates; behind the last of an open track, the last one's."""
        index = memory.passed % self.count
        following = (index + 1) % self.count if self.closed else jnp.minimum(index + 1, self.count - 1)
        axes = jnp.stack([memory.gates.cos, memory.gates.sin, jnp.zeros_like(memory.gates.cos)], axis=-1)
        return _rows(axes, jnp.stack([index, following], axis=-1))

    def observe(self, memory: Memory, time: Float[Array, " n"], state: State) -> Float[Array, "n 13"]:
        """The next two gates and the commanded speed."""
        del time
        n = memory.speed.shape[0]
        axes = self.axes(memory).reshape(n, -1)
        return jnp.concatenate([offsets(self.targets(memory), state), axes, memory.speed[:, None]], axis=-1)

    def desired_velocity(self, memory: Memory, state: State) -> Float[Array, "n 3"]:
        """At the commanded speed towards a point close behind the next gate: in its middle still straight through."""
        behind = self.targets(memory)[:, 0] + BEHIND * self.axes(memory)[:, 0]
        away = behind - state.position
        return memory.speed[:, None] * away / (jnp.linalg.norm(away, axis=-1, keepdims=True) + 1e-3)

    def scene(self, memory: Memory) -> Scene:
        """Gates and obstacles over level ground."""
        n = memory.speed.shape[0]
        return Scene.of({**memory.obstacles, "gate": frames(memory.gates, n)}, n)

    def overhang(self, memory: Memory, state: State) -> Float[Array, "n 1"]:
        """How far the vehicle's sphere stands out of the next gate's opening, m; `-FAR` off its plane."""
        axis = self.axes(memory)[:, 0]
        d = state.position - self.targets(memory)[:, 0]
        index = memory.passed % self.count
        half = jax.nn.one_hot(index, self.count) @ jnp.asarray(self.gates.half)
        ahead = d[:, 0] * axis[:, 0] + d[:, 1] * axis[:, 1]
        beside = d[:, 1] * axis[:, 0] - d[:, 0] * axis[:, 1]
        out = jnp.maximum(jnp.abs(beside) - half[:, 0], jnp.abs(d[:, 2]) - half[:, 1]) + self.shape.radius
        return jnp.where(jnp.abs(ahead) < PASSING, out, -FAR)[:, None]

    def desired_yaw(self, memory: Memory, state: State) -> Float[Array, " n"]:
        """Towards where the way through the next two gates is `LOOKING` ahead: near a gate, behind its corner."""
        here, there = (self.targets(memory)[:, i] for i in range(2))
        leg, away = there - here, jnp.linalg.norm(here - state.position, axis=-1, keepdims=True)
        length = jnp.maximum(jnp.linalg.norm(leg, axis=-1, keepdims=True), 1.0)
        d = here + leg * jnp.clip((LOOKING - away) / length, 0.0, 1.0) - state.position
        return jax.lax.stop_gradient(jnp.arctan2(d[:, 1], d[:, 0] + 1e-6))

    def advance(
        self, memory: Memory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[Memory, Outcome]:
        """Success: the last gate of the lap passed without touching anything."""
        del timed_out
        c = self.config
        index = memory.passed % self.count
        passed, missed, _ = memory.gates.judge(index, before.position, after.position, self.shape.radius)
        error = jnp.linalg.norm(after.position - self.goal(memory, time), axis=-1)
        hit = struck(self.scene(memory), before, after, time, self.control_period, self.checks, self.shape.radius)
        lost = missed | (error > c.fence) | (after.position[:, 2] < self.shape.feet_height)
        crashed = hit | lost
        passed = passed & ~lost
        moved = dataclasses.replace(memory, passed=memory.passed + passed)
        laps = c.laps if self.closed else 1
        finished = passed & (laps > 0) & (moved.passed >= laps * self.count)
        success = finished & ~crashed
        ends = lost | finished | (hit & (c.collisions_end > 0))
        signals = {
            "desired_speed": memory.speed,
            "desired_velocity": self.desired_velocity(memory, after),
            "overhang": self.overhang(memory, after),
        }
        return moved, Outcome(
            terminated=ends, success=success, arrived=passed, crashed=crashed, error=error, signals=signals
        )


def _drawn_larger(track: RaceTrack, scale: float) -> RaceTrack:
    """The track with its ground plan `scale` times as large; heights and openings stay."""
    size = np.array([scale, scale, 1.0])
    return dataclasses.replace(track, start=track.start * size, position=track.position * size)


def _rows(table: Float[Array, "n g 3"], index: Int[Array, "n k"]) -> Float[Array, "n k 3"]:
    """Rows of each world's table; as a product, whose gradient is no scatter."""
    return jax.nn.one_hot(index, table.shape[1], dtype=table.dtype) @ table
