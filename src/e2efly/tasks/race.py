"""Racing: fly through gates in order, as fast as the vehicle allows.

A gate's frame: x along its yaw, the direction in which it is flown through; y left; z up. A gate is passed when the
centre of mass crosses its plane forward with the vehicle's sphere inside the opening; crossing the next gate's plane
forward anywhere else is a failure, and so is touching the frame of any gate in either direction.
"""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from e2efly.config import RaceConfig
from e2efly.observation import Field
from e2efly.physics import State
from e2efly.physics.rotation import from_euler
from e2efly.tasks.task import Outcome, Shape, at_rest, into_ball, touches_ground, uniform
from e2efly.tasks.tracks import RaceTrack, load_track

FRAME = 0.1
"""Width of a gate's frame around its opening, m."""
LOWEST_START = 0.3
"""Starts are drawn at least this high over the feet, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Gates:
    """The gates of a track as arrays."""

    start: Float[Array | np.ndarray, "3"]
    start_yaw: float | Array
    position: Float[Array | np.ndarray, "g+1 3"]
    """Centres; the last row is what the policy is shown behind the last gate."""
    cos: Float[Array | np.ndarray, " g"]
    sin: Float[Array | np.ndarray, " g"]
    half: Float[Array | np.ndarray, "g 2"]
    """Half of the opening's width and height, m."""

    @staticmethod
    def of(track: RaceTrack) -> "Gates":
        """The arrays of a loaded track: behind the last gate comes the first again, or a point 3 m straight on."""
        cos, sin = np.cos(track.yaw), np.sin(track.yaw)
        straight_on = track.position[-1] + 3.0 * np.array([cos[-1], sin[-1], 0.0])
        position = np.vstack([track.position, track.position[0] if track.closed else straight_on])
        start, opening = track.start.astype(np.float32), track.opening.astype(np.float32)
        p, c, s = (x.astype(np.float32) for x in (position, cos, sin))
        return Gates(start, track.start_yaw, p, c, s, opening / 2)

    def local(self, point: Float[Array, "n 3"]) -> tuple[Array, Array, Array]:
        """Coordinates in every gate's frame, each (n, g)."""
        d = point[:, None] - self.position[:-1]
        x, y, cos, sin = d[..., 0], d[..., 1], jnp.asarray(self.cos), jnp.asarray(self.sin)
        return cos * x + sin * y, cos * y - sin * x, d[..., 2]


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape", "gates"], meta_fields=["closed"])
@dataclass(frozen=True)
class Race:
    """Make it with `Race.of`. The task's memory is the number of gates passed."""

    config: RaceConfig
    shape: Shape
    gates: Gates
    closed: bool

    name = "race"
    fields = (Field("gates", 6, "world", "m", 4.0, "centres of the next two gates minus vehicle position"),)

    @staticmethod
    def of(config: RaceConfig, shape: Shape) -> "Race":
        """Load the track.

        Raises:
            ValueError: for an unknown or broken track.
        """
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
        return self.gates.cos.shape[0]

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
        x0, y0, z0 = self.gates.local(before.position)
        x1, y1, z1 = self.gates.local(after.position)
        t = x0 / jnp.where(x0 == x1, 1.0, x0 - x1)
        y, z = jnp.abs(y0 + t * (y1 - y0)), jnp.abs(z0 + t * (z1 - z0))
        forward, crossing = (x0 < 0) & (x1 >= 0), (x0 < 0) != (x1 < 0)
        half, radius = self.gates.half, self.shape.radius
        inside = (y < half[:, 0] - radius) & (z < half[:, 1] - radius)
        outside = (y > half[:, 0] + FRAME + radius) | (z > half[:, 1] + FRAME + radius)
        mine = (memory % self.count)[:, None] == jnp.arange(self.count)
        passed = jnp.any(mine & forward & inside, axis=-1)
        missed = jnp.any(mine & forward & ~inside, axis=-1)
        struck = jnp.any(crossing & ~inside & ~outside, axis=-1)
        error = jnp.linalg.norm(after.position - self.goal(memory, time), axis=-1)
        crashed = missed | struck | (error > self.config.fence) | touches_ground(self.shape, after)
        passed = passed & ~crashed
        memory = memory + passed
        laps = self.config.laps if self.closed else 1
        finished = passed & (laps > 0) & (memory >= laps * self.count)
        return memory, Outcome(crashed | finished, finished, passed, crashed, error)
