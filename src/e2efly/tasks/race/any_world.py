"""Racing on any track: every episode another one, at random (`courses/random_tracks.py`), or a given one."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.courses.gates import Tracks
from e2efly.courses.random_tracks import CANDIDATES, MOST, NUMBERS, random_tracks
from e2efly.courses.tracks import load_track
from e2efly.goal import Outcome, Shape
from e2efly.physics import State
from e2efly.physics.rotation import from_euler
from e2efly.rewards import norm
from e2efly.scenes.course import frames
from e2efly.scenes.scene import Scene
from e2efly.scenes.shapes import FAR
from e2efly.tasks.race import ANY, RaceConfig
from e2efly.tasks.race.any_goal import Ahead, AnyRaceGoal, Memory
from e2efly.tasks.task import at_rest, into_ball, uniform

LOWEST_START = 0.3
"""Starts are drawn at least this high over the feet, m."""
AROUND = 1.5
"""The way to a gate from behind it leads through a point at most so far before it, m ..."""
DETOUR = 0.5
"""... and so far for each metre that the vehicle is behind it."""

SHORTEST = 0.01
"""Keeps the gradient of where a gate's plane is crossed finite, m: a step that crosses it is longer than this."""
LOW = 0.2
"""With the feet lower than this over the ground a vehicle stands out of where it should be, m."""

jax.tree_util.register_dataclass(Memory, data_fields=["tracks", "passed"], meta_fields=[])


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape", "given"], meta_fields=[])
@dataclass(frozen=True)
class AnyRace(AnyRaceGoal):
    """Make it with `AnyRace.of`."""

    given: Tracks | None
    """The track of every episode (n = 1); None: another one in each."""

    @staticmethod
    def of(config: RaceConfig, shape: Shape) -> "AnyRace":
        """Load the track, where one is named.

        Raises:
            ValueError: for an unknown or broken track.
        """
        given = None if config.track == ANY else load_track(config.track)
        if given is not None and config.laps > 1 and not given.closed:
            raise ValueError(f"laps is {config.laps}; accepted: 0 or 1, as track {given.name!r} is not closed")
        numbers = dataclasses.replace(config, track="")  # resolved here: tracks share a compiled program
        return AnyRace(numbers, shape, None if given is None else Tracks.of(given, MOST))

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Memory]:
        """At rest and level in a ball about the start of each one's track, heading as it says."""
        track_key, state_key = jax.random.split(key)
        if self.given is None:
            size = CANDIDATES * NUMBERS
            u = jax.random.uniform(track_key, (n, size)).reshape(n, CANDIDATES, NUMBERS)
            tracks = random_tracks(u)
        else:
            tracks = jax.tree.map(lambda x: jnp.broadcast_to(jnp.asarray(x), (n, *x.shape[1:])), self.given)
        g = tracks.gates
        state = begun(state_key, n, self.config.position, self.shape, g.start, g.start_yaw)
        return state, Memory(tracks, jnp.zeros(n, jnp.int32))

    def scene(self, memory: Memory) -> Scene:
        """The gates over level ground."""
        n, tracks = memory.passed.shape[0], memory.tracks
        return Scene.of({"gate": frames(tracks.gates, n, active=tracks.there)}, n)

    def desired_yaw(self, memory: Memory, state: State) -> Float[Array, " n"]:
        """Towards the next gate."""
        d = self.goal(memory, memory.passed) - state.position
        return jnp.arctan2(d[:, 1], d[:, 0] + 1e-6)

    def advance(
        self, memory: Memory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[Memory, Outcome]:
        """The goal's verdict, with signals for the reward: `way`, `previous_way` and `overhang`.

        What stands out of an opening, sideways and up, is followed by what is too near to the ground.

        The way is that to the next gate. In the step that passes it, it is what was flown of the way from there to the
        gate after it, negative: so that no step charges for being fast through a gate.
        """
        moved, outcome = super().advance(memory, before, after, time, timed_out)
        ahead = Ahead.of(memory)
        centre, axis = (ahead.centre[:, i] for i in (0, 1)), (ahead.axis[:, i] for i in (0, 1))
        (here, there), (along, onward) = centre, axis
        was, now = (_local(s.position - here, along) for s in (before, after))
        beyond = _way(_local(after.position - there, onward)) - _way(_local(here - there, onward))
        way = jnp.where(outcome.arrived, beyond, _way(now))
        low = self.shape.feet_height + LOW - after.position[:, 2:]
        out = jnp.concatenate([self._overhang(was, now, ahead.half[:, 0]), low], axis=-1)
        signals = {"way": way, "previous_way": _way(was), "overhang": out}
        return moved, dataclasses.replace(outcome, signals=outcome.signals | signals)

    def _overhang(
        self, was: Float[Array, "n 3"], now: Float[Array, "n 3"], half: Float[Array, "n 2"]
    ) -> Float[Array, "n 2"]:
        """How far the vehicle's sphere stands out of the opening, sideways and up, where it crosses its plane forward,
        m; `-FAR` in steps that do not cross it.
        """
        crossing = (was[:, 0] < 0) & (now[:, 0] >= 0)
        step = jnp.where(crossing, jnp.minimum(was[:, 0] - now[:, 0], -SHORTEST), -1.0)
        share = jnp.where(crossing, was[:, 0], -1.0) / step
        there = was[:, 1:] + share[:, None] * (now[:, 1:] - was[:, 1:])
        return jnp.where(crossing[:, None], jnp.abs(there) - half + self.shape.radius, -FAR)


def _local(d: Float[Array, "n 3"], axis: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Offsets from a gate in its frame: along its axis, to the left, up."""
    x = d[:, 0] * axis[:, 0] + d[:, 1] * axis[:, 1]
    return jnp.stack([x, d[:, 1] * axis[:, 0] - d[:, 0] * axis[:, 1], d[:, 2]], axis=-1)


def _way(local: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """How far it is to fly to a gate's centre and through it forward, m: before it straight, from behind it around.

    The way around leads by a point before the gate, the farther before it the farther behind it the vehicle is.
    """
    back = jnp.clip(DETOUR * local[:, 0], 0.0, AROUND)
    return norm(local.at[:, 0].add(back)) + back


def begun(key: PRNGKeyArray, n: int, radius: Any, shape: Shape, place: Any, heading: Any) -> State:
    """At rest and level in a ball about a place (3,) or (n, 3), with a heading, rad, a number or (n,)."""
    position = jnp.asarray(place) + radius * into_ball(uniform(key, n, 3))
    position = position.at[:, 2].max(shape.feet_height + LOWEST_START)
    zero = jnp.zeros(n)
    return dataclasses.replace(at_rest(position), quaternion=from_euler(zero, zero, zero + heading))
