"""Racing in clutter: through gates that stand a little elsewhere in every world, among obstacles that are only seen."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.courses.gates import Gates
from e2efly.courses.tracks import load_track
from e2efly.goal import Outcome, Shape
from e2efly.physics import State
from e2efly.physics.rotation import from_euler
from e2efly.scenes.course import frames
from e2efly.scenes.generate import clutter
from e2efly.scenes.scene import Scene, Solids
from e2efly.scenes.shapes import FAR
from e2efly.tasks.race_clutter import RaceClutterConfig
from e2efly.tasks.race_clutter.goal import Memory, RaceClutterGoal, drawn_larger
from e2efly.tasks.task import at_rest, into_ball, struck, uniform

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
class World(Memory):
    """The world of each vehicle, and how far it is."""

    obstacles: dict[str, Solids]


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["config", "shape", "gates"],
    meta_fields=["closed", "control_period", "checks"],
)
@dataclass(frozen=True)
class RaceClutter(RaceClutterGoal):
    """Make it with `RaceClutter.of`."""

    @staticmethod
    def of(config: RaceClutterConfig, shape: Shape, control_period: float, checks: int) -> "RaceClutter":
        """Load the track.

        Raises:
            ValueError: for an unknown or broken track.
        """
        track = drawn_larger(load_track(config.track), config.scale)
        numbers = dataclasses.replace(config, track="")  # resolved here: tracks share a compiled program
        return RaceClutter(numbers, shape, Gates.of(track), track.closed, control_period, checks)

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, World]:
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
        memory = World(gates, jnp.zeros(n, jnp.int32), speed, obstacles)
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

    def desired_velocity(self, memory: World, state: State) -> Float[Array, "n 3"]:
        """At the commanded speed towards a point close behind the next gate: in its middle still straight through."""
        behind = self.targets(memory)[:, 0] + BEHIND * self.axes(memory)[:, 0]
        away = behind - state.position
        return memory.speed[:, None] * away / (jnp.linalg.norm(away, axis=-1, keepdims=True) + 1e-3)

    def scene(self, memory: World) -> Scene:
        """Gates and obstacles over level ground."""
        n = memory.speed.shape[0]
        return Scene.of({**memory.obstacles, "gate": frames(memory.gates, n)}, n)

    def overhang(self, memory: World, state: State) -> Float[Array, "n 1"]:
        """How far the vehicle's sphere stands out of the next gate's opening, m; `-FAR` off its plane."""
        axis = self.axes(memory)[:, 0]
        d = state.position - self.targets(memory)[:, 0]
        index = memory.passed % self.count
        half = jax.nn.one_hot(index, self.count) @ jnp.asarray(self.gates.half)
        ahead = d[:, 0] * axis[:, 0] + d[:, 1] * axis[:, 1]
        beside = d[:, 1] * axis[:, 0] - d[:, 0] * axis[:, 1]
        out = jnp.maximum(jnp.abs(beside) - half[:, 0], jnp.abs(d[:, 2]) - half[:, 1]) + self.shape.radius
        return jnp.where(jnp.abs(ahead) < PASSING, out, -FAR)[:, None]

    def desired_yaw(self, memory: World, state: State) -> Float[Array, " n"]:
        """Towards where the way through the next two gates is `LOOKING` ahead: near a gate, behind its corner."""
        here, there = (self.targets(memory)[:, i] for i in range(2))
        leg, away = there - here, jnp.linalg.norm(here - state.position, axis=-1, keepdims=True)
        length = jnp.maximum(jnp.linalg.norm(leg, axis=-1, keepdims=True), 1.0)
        d = here + leg * jnp.clip((LOOKING - away) / length, 0.0, 1.0) - state.position
        return jax.lax.stop_gradient(jnp.arctan2(d[:, 1], d[:, 0] + 1e-6))

    def advance(
        self, memory: World, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[World, Outcome]:
        """The goal's verdict, with signals for the reward."""
        del timed_out
        hit = struck(self.scene(memory), before, after, time, self.control_period, self.checks, self.shape.radius)
        moved, outcome = self.verdict(memory, before, after, time, hit)
        signals = {
            "desired_speed": memory.speed,
            "desired_velocity": self.desired_velocity(memory, after),
            "overhang": self.overhang(memory, after),
        }
        return moved, dataclasses.replace(outcome, signals=signals)
