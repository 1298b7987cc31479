"""Tracking: follow a reference that is seen one second ahead."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.courses.references import POINTS, SPACING, Lissajous, Spline, knot_count, read_csv, through_points
from e2efly.deploy.goals import ReferenceGoal
from e2efly.observation import Field
from e2efly.physics import State
from e2efly.physics.rotation import from_euler
from e2efly.scenes.scene import Scene
from e2efly.tasks.references import polynomial
from e2efly.tasks.task import Outcome, Shape, at_rest, into_ball, offsets, touches_ground, uniform
from e2efly.tasks.track import TrackConfig
from e2efly.vehicles.names import unknown


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Memory:
    """The reference, and the error summed since it counts."""

    reference: Spline
    error_sum: Float[Array, " n"]
    """Sum of the distance to the reference over the counted steps, m."""
    steps: Float[Array, " n"]
    """Counted steps."""


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape", "curve"], meta_fields=["knots"])
@dataclass(frozen=True)
class Track:
    """Follow a reference; make it with `Track.of`."""

    config: TrackConfig
    shape: Shape
    knots: int
    curve: Lissajous | Spline | None
    """What to follow: a curve, the spline of the user's file, or None: random polynomials."""

    fields = (
        Field(
            "reference", 3 * POINTS, "world", "m", 1.0,
            f"{POINTS} reference points minus vehicle position, {SPACING} s apart, the first for now",
        ),
    )  # fmt: skip

    @staticmethod
    def of(config: TrackConfig, shape: Shape, control_period: float = 0.0, substeps: int = 1) -> "Track":
        """Check the kind of reference and read the user's file, if it is one.

        Raises:
            ValueError: for an unknown kind or a broken file.
        """
        del control_period, substeps
        numbers = dataclasses.replace(config, reference="")  # resolved here: references share a compiled program
        kinds = ("polynomial", "circle", "lemniscate")
        m = knot_count(config.episode_s + POINTS * SPACING)
        if config.reference not in kinds:
            if not config.reference.endswith(".csv"):
                raise ValueError(unknown("reference", config.reference, kinds) + ", or the path of a .csv file")
            table = read_csv(config.reference)
            if table[:, 3].min() <= shape.feet_height:
                raise ValueError(
                    f"reference {config.reference}: lowest z is {table[:, 3].min()} m; accepted: above "
                    f"{shape.feet_height} m, the height of the centre of mass over the feet"
                )
            path = through_points(table)
            return Track(numbers, shape, m, dataclasses.replace(path, knots=path.knots.astype(np.float32)))
        curves = {
            "circle": Lissajous.circle(config.radius, config.circle_rate),
            "lemniscate": Lissajous.lemniscate(config.radius, config.lemniscate_speed),
        }
        return Track(numbers, shape, m, curves.get(config.reference))

    @property
    def episode_s(self) -> float | Array:
        """Time limit, s."""
        return self.config.episode_s

    def reference(self, key: PRNGKeyArray, n: int) -> Spline:
        """Draw a reference a vehicle."""
        c = self.config
        if self.curve is None:
            return polynomial(key, c.centre, c.polynomial_reach, c.polynomial_speed, n, self.knots)
        if isinstance(self.curve, Lissajous):
            return self.curve.spline(c.centre, jnp.pi * uniform(key, n, 1)[:, 0], self.knots)
        knots = jnp.asarray(self.curve.knots)
        return dataclasses.replace(self.curve, knots=jnp.broadcast_to(knots, (n, *knots.shape[1:])))

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Memory]:
        """Level, any heading, near the reference's first point, with a velocity of its own."""
        c = self.config
        reference_key, state_key = jax.random.split(key)
        reference, u = self.reference(reference_key, n), uniform(state_key, n, 7)
        first = reference.position(jnp.zeros((n, 1)))[:, 0]
        zero = jnp.zeros(n)
        state = dataclasses.replace(
            at_rest(first + c.position * into_ball(u[:, :3])),
            velocity=c.velocity * u[:, 3:6],
            quaternion=from_euler(zero, zero, jnp.pi * u[:, 6]),
        )
        return state, Memory(reference, zero, zero)

    def goal(self, memory: Memory, time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """The reference point for now."""
        return memory.reference.position(time[:, None])[:, 0]

    def targets(self, memory: Memory, time: Float[Array, " n"]) -> Float[Array, "n k 3"]:
        """The reference points for now and the second ahead."""
        return memory.reference.position(time[:, None] + SPACING * jnp.arange(POINTS))

    def observe(self, memory: Memory, time: Float[Array, " n"], state: State) -> Float[Array, "n 30"]:
        """The same, minus position."""
        return offsets(self.targets(memory, time), state)

    def scene(self, memory: Memory) -> Scene:
        """Level ground."""
        return Scene.of({}, memory.steps.shape[0])

    def flight_goal(self, memory: Any) -> ReferenceGoal:
        """See `e2efly.validate.starts.goal_of`."""
        return ReferenceGoal(memory.reference, float(self.config.fence))

    def desired_yaw(self, memory: Memory, state: State) -> Float[Array, " n"]:
        """Along world x."""
        del state
        return jnp.zeros_like(memory.steps)

    def advance(
        self, memory: Memory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[Memory, Outcome]:
        """Success: at the end of the episode the mean error since `settle_s` is small; never outside the fence."""
        del before
        c = self.config
        error = jnp.linalg.norm(after.position - self.goal(memory, time), axis=-1)
        counts = (time > c.settle_s).astype(error.dtype)
        memory = Memory(memory.reference, memory.error_sum + counts * error, memory.steps + counts)
        crashed = (error > c.fence) | touches_ground(self.shape, after)
        mean = memory.error_sum / jnp.maximum(memory.steps, 1.0)
        success = timed_out & ~crashed & (mean < c.mean_error)
        return memory, Outcome(
            terminated=crashed, success=success, arrived=jnp.zeros_like(crashed), crashed=crashed, error=error
        )
