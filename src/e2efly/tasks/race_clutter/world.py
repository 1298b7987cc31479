"""Racing in clutter: gates at slightly different places in every world, among obstacles seen only by cameras."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from e2efly.courses.gates import Tracks
from e2efly.courses.random_tracks import ANY, CLUTTERED, TrackStyle
from e2efly.policy.goal import Outcome, Shape
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.course import frames
from e2efly.simulation.scenes.generate import clutter
from e2efly.simulation.scenes.scene import Scene, Solids
from e2efly.simulation.scenes.shapes import FAR
from e2efly.tasks.race.any_goal import Ahead, AnyRaceMemory, towards
from e2efly.tasks.race.any_world import displaced, several
from e2efly.tasks.race_clutter import RaceClutterConfig
from e2efly.tasks.race_clutter.goal import RaceClutterGoal
from e2efly.tasks.task import at_rest, between, into_ball, struck, uniform

APPROACH = 0.7
"""Distance of two points in front of and behind each gate that obstacles also keep clear of, m."""
PASSING = 1.5
"""Distance from a gate's plane within which a vehicle should be in line with its opening, m."""
LOOKING = 5.0
"""Distance ahead along the way at which a vehicle should look, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True, kw_only=True)
class ClutterWorld(AnyRaceMemory):
    """The world of each vehicle, the number of gates that it has passed, and its commanded speed."""

    obstacles: dict[str, Solids]


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["config", "shape", "given"],
    meta_fields=["control_period", "checks", "chance"],
)
@dataclass(frozen=True)
class RaceClutter(RaceClutterGoal):
    """Make it with `RaceClutter.of`."""

    given: Tracks
    """The tracks from which worlds are made, before gates are displaced."""
    chance: tuple[int, TrackStyle] | None = None
    """The number of the track in whose place random ones are drawn, and their style."""

    @classmethod
    def of(cls, config: RaceClutterConfig, shape: Shape, control_period: float, checks: int = 1) -> "RaceClutter":
        """Load the tracks.

        Raises:
            ValueError: for an unknown or broken track, and for tracks that `several` refuses.
        """
        chance = (config.track.index(ANY), CLUTTERED) if ANY in config.track else None
        given = several(config.track, config.scale, chance and chance[1], config.only)
        count = len(config.track)
        # the tracks are resolved here, so that they share a compiled program
        numbers = dataclasses.replace(config, track=("",) * count)
        return RaceClutter(numbers, shape, control_period, checks, given, chance)

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, ClutterWorld]:
        """At rest in a ball around the start of a track. Every world is different."""
        gate_key, clutter_key, state_key = jax.random.split(key, 3)
        c, u = self.config, uniform(state_key, n, 4)
        tracks = displaced(gate_key, n, self.given, c.gate_position, c.gate_yaw, c.only, self.chance)
        g = tracks.gates
        state = at_rest(g.start + c.position * into_ball(u[:, :3]))
        zero = jnp.zeros(n)
        quaternion = from_euler(zero, zero, g.start_yaw)
        axes = jnp.stack([g.cos, g.sin, jnp.zeros_like(g.cos)], axis=-1)
        centres = g.position[:, :-1]
        keep = jnp.concatenate(
            [state.position[:, None], centres, centres - APPROACH * axes, centres + APPROACH * axes], axis=1
        )
        largest = jnp.max(jnp.where(tracks.there[..., None], g.half, 0.0))
        path, legs = _path(tracks, state.position)
        obstacles = clutter(clutter_key, n, c.clutter, path, keep, largest, legs)
        memory = ClutterWorld(tracks, jnp.zeros(n, jnp.int32), between(c.speed, u[:, 3]), obstacles=obstacles)
        return dataclasses.replace(state, quaternion=quaternion), memory

    def scene(self, memory: ClutterWorld) -> Scene:
        """Gates and obstacles over level ground."""
        n = memory.speed.shape[0]
        gates = frames(memory.tracks.gates, n, active=memory.tracks.there)
        return Scene.of({**memory.obstacles, "gate": gates}, n)

    def overhang(self, memory: ClutterWorld, state: State) -> Float[Array, "n 1"]:
        """How far the vehicle's sphere extends outside the next gate's opening, m. `-FAR` far from the gate's plane."""
        ahead = Ahead.of(memory)
        axis, half = ahead.axis[:, 0], ahead.half[:, 0]
        d = state.position - ahead.centre[:, 0]
        away = d[:, 0] * axis[:, 0] + d[:, 1] * axis[:, 1]
        beside = d[:, 1] * axis[:, 0] - d[:, 0] * axis[:, 1]
        out = jnp.maximum(jnp.abs(beside) - half[:, 0], jnp.abs(d[:, 2]) - half[:, 1]) + self.shape.radius
        return jnp.where(jnp.abs(away) < PASSING, out, -FAR)[:, None]

    def desired_yaw(self, memory: ClutterWorld, state: State) -> Float[Array, " n"]:
        """Heading towards the point `LOOKING` ahead on the way through the next two gates.

        Near a gate this point lies on the leg behind it.
        """
        here, there = (Ahead.of(memory).centre[:, i] for i in range(2))
        leg, away = there - here, jnp.linalg.norm(here - state.position, axis=-1, keepdims=True)
        length = jnp.maximum(jnp.linalg.norm(leg, axis=-1, keepdims=True), 1.0)
        d = here + leg * jnp.clip((LOOKING - away) / length, 0.0, 1.0) - state.position
        return jax.lax.stop_gradient(jnp.arctan2(d[:, 1], d[:, 0] + 1e-6))

    def advance(
        self, memory: ClutterWorld, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[ClutterWorld, Outcome]:
        """The goal's verdict, with signals for the reward."""
        hit = struck(self.scene(memory), before, after, time, self.control_period, self.checks, self.shape.radius)
        moved, outcome = self.verdict(memory, before, after, time, hit)
        signals = {
            "desired_speed": memory.speed,
            "desired_velocity": towards(memory, after, memory.speed),
            "overhang": self.overhang(memory, after),
        }
        return moved, dataclasses.replace(outcome, signals=signals)


def _path(tracks: Tracks, start: Float[Array, "n 3"]) -> tuple[Float[Array, "n p 3"], Int[Array, " n"]]:
    """The corners of the way from the start through the gates, and the number of its legs.

    On a closed track the way leads back to the first gate.
    """
    g, count = tracks.gates, tracks.count
    home = jnp.arange(g.count + 1)[None, :, None] == count[:, None, None]
    corners = jnp.where(home, g.position[:, :1], g.position)
    return jnp.concatenate([start[:, None], corners], axis=1), count + tracks.closed
