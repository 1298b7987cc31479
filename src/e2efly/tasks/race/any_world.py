"""Racing on any track: a random track for each episode (`courses/random_tracks.py`), or a given track for all.

Racing on one of several given tracks, whose gates are displaced in every episode, begins here, too.
"""

import dataclasses
import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.courses.gates import Tracks
from e2efly.courses.random_tracks import ANY, RACING, TrackStyle, random_tracks
from e2efly.courses.tracks import load_track
from e2efly.policy.goal import Outcome, Shape
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.course import frames
from e2efly.simulation.scenes.scene import Scene
from e2efly.tasks.race.any_goal import Ahead, AnyRaceGoal, AnyRaceMemory
from e2efly.tasks.race.way import NextGates
from e2efly.tasks.task import at_rest, into_ball, uniform

LOWEST_START = 0.3
"""Smallest height of the feet above the ground in a start, m."""

jax.tree_util.register_dataclass(AnyRaceMemory, data_fields=["tracks", "passed", "speed"], meta_fields=[])


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape", "given"], meta_fields=[])
@dataclass(frozen=True)
class AnyRace(AnyRaceGoal):
    """Make it with `AnyRace.of`."""

    given: Tracks | None
    """The track of every episode (n = 1). None: each episode has another track."""

    @classmethod
    def of(cls, config: Any, shape: Shape, control_period: float = 0.0, checks: int = 1) -> "AnyRace":
        """Load the track, if one is named.

        Raises:
            ValueError: for an unknown or broken track.
        """
        given = None if config.track == ANY else load_track(config.track)
        if given is not None and config.laps > 1 and not given.closed:
            raise ValueError(f"laps is {config.laps}; accepted: 0 or 1, as track {given.name!r} is not closed")
        numbers = dataclasses.replace(config, track="")  # resolved here: tracks share a compiled program
        return AnyRace(numbers, shape, None if given is None else Tracks.of(given, RACING.most))

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, AnyRaceMemory]:
        """At rest and level in a ball around the start of each vehicle's track, with the heading of the track."""
        track_key, state_key = jax.random.split(key)
        if self.given is None:
            tracks = drawn(track_key, n, RACING)
        else:
            tracks = jax.tree.map(lambda x: jnp.broadcast_to(jnp.asarray(x), (n, *x.shape[1:])), self.given)
        g = tracks.gates
        state = begun(state_key, n, self.config.position, self.shape, g.start, g.start_yaw)
        return state, AnyRaceMemory(tracks, jnp.zeros(n, jnp.int32), jnp.full(n, jnp.inf))

    def scene(self, memory: AnyRaceMemory) -> Scene:
        """The gates over level ground."""
        n, tracks = memory.passed.shape[0], memory.tracks
        return Scene.of({"gate": frames(tracks.gates, n, active=tracks.there)}, n)

    def desired_yaw(self, memory: AnyRaceMemory, state: State) -> Float[Array, " n"]:
        """Towards the next gate."""
        d = self.goal(memory, memory.passed) - state.position
        return jnp.arctan2(d[:, 1], d[:, 0] + 1e-6)

    def advance(
        self, memory: AnyRaceMemory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[AnyRaceMemory, Outcome]:
        """The goal's verdict, with signals for the reward."""
        moved, outcome = super().advance(memory, before, after, time, timed_out)
        ahead = Ahead.of(memory)
        (here, there), (along, onward) = ((x[:, 0], x[:, 1]) for x in (ahead.centre, ahead.axis))
        signals = NextGates((here, there), (along, onward), ahead.half[:, 0]).signals(
            self.shape, before, after, outcome.arrived
        )
        return moved, dataclasses.replace(outcome, signals=outcome.signals | signals)


def begun(key: PRNGKeyArray, n: int, radius: Any, shape: Shape, place: Any, heading: Any) -> State:
    """At rest and level in a ball around a place.

    The place is (3,) or (n, 3). The heading, rad, is a number or (n,).
    """
    position = jnp.asarray(place) + radius * into_ball(uniform(key, n, 3))
    position = position.at[:, 2].max(shape.feet_height + LOWEST_START)
    zero = jnp.zeros(n)
    return dataclasses.replace(at_rest(position), quaternion=from_euler(zero, zero, zero + heading))


def drawn(key: PRNGKeyArray, n: int, style: TrackStyle, room: int = 0) -> Tracks:
    """A random track for each of n worlds, in arrays for `room` gates, or for as many as the style has."""
    numbers = style.numbers(room)
    return random_tracks(jax.random.uniform(key, (n, math.prod(numbers))).reshape(n, *numbers), style)


def several(names: tuple[str, ...], scale: float = 1.0, chance: TrackStyle | None = None, only: float = -1.0) -> Tracks:
    """Tracks with enlarged ground plans, one in each world, in arrays for as many gates as the longest has.

    If a style is given, one name is `any`: in its place stands one track of that style, to be drawn anew.

    Raises:
        ValueError: for an unknown or broken track, for no track at all, for one name in place of a tuple, for a name
            given twice, and for a chosen track, `only`, that is not among them.
    """
    if isinstance(names, str) or not names:
        raise ValueError(f"task.track is {names!r}; accepted: a tuple of one or more tracks")
    if len({Path(name).stem for name in names}) < len(names):
        raise ValueError(f"task.track is {names}; accepted: tracks of different names, which tell the criteria")
    if only not in range(-1, len(names)):
        raise ValueError(f"task.only is {only}; accepted: whole numbers from -1 to {len(names) - 1}")
    tracks, room = {name: load_track(name).enlarged(scale) for name in names if chance is None or name != ANY}, 0
    if chance is not None:
        tracks[ANY], room = random_tracks(np.zeros((1, *chance.numbers()), np.float32), chance).track(0), chance.most
    room = max(room, *(len(track.yaw) for track in tracks.values()))
    return jax.tree.map(lambda *x: np.concatenate(x), *(Tracks.of(tracks[name], room) for name in names))


def displaced(
    key: PRNGKeyArray,
    n: int,
    given: Tracks,
    moved: Any,
    turned: Any,
    only: Any = -1.0,
    chance: tuple[int, TrackStyle] | None = None,
) -> Tracks:
    """One of the given tracks for each of n worlds, with every gate slightly displaced.

    Args:
        key: for the draws.
        n: number of worlds.
        given: the tracks.
        moved: half-width of each gate's offset, m per axis.
        turned: half-width of each gate's rotation, rad.
        only: number of the track that every world has. -1: any of them.
        chance: number of the track in whose place random ones are drawn, and their style.
    """
    track_key, gate_key = jax.random.split(key)
    which = jax.random.randint(track_key, (n,), 0, given.count.shape[0])
    which = jnp.where(only < 0, which, jnp.asarray(only).astype(jnp.int32))
    tracks = jax.tree.map(lambda x: jnp.asarray(x)[which], given)
    if chance is not None:
        number, style = chance
        other = drawn(jax.random.fold_in(track_key, 1), n, style, given.gates.count)
        tracks = jax.tree.map(
            lambda a, b: jnp.where((which == number).reshape(-1, *(1,) * (b.ndim - 1)), a, b), other, tracks
        )
    g, count = tracks.gates, given.gates.count
    u = uniform(gate_key, n, 4 * count).reshape(n, count, 4)
    move, turn = moved * u[..., :3], turned * u[..., 3]
    cos, sin = jnp.cos(turn), jnp.sin(turn)
    gates = dataclasses.replace(
        g,
        position=g.position.at[:, :-1].add(move),
        cos=g.cos * cos - g.sin * sin,
        sin=g.sin * cos + g.cos * sin,
    )
    return dataclasses.replace(tracks, gates=gates)
