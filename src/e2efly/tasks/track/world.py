"""Tracking: follow a reference that is known one second ahead."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config.names import unknown
from e2efly.courses.references import POINTS, SPACING, Lissajous, Spline, knot_count, read_csv, through_points
from e2efly.policy.goal import Shape
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import Scene
from e2efly.tasks.task import at_rest, into_ball, uniform
from e2efly.tasks.track import TrackConfig
from e2efly.tasks.track.goal import TrackGoal, TrackMemory
from e2efly.tasks.track.splines import polynomial

jax.tree_util.register_dataclass(TrackMemory)


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape", "curve"], meta_fields=["knots"])
@dataclass(frozen=True)
class Track(TrackGoal):
    """Follow a reference. Make it with `Track.of`."""

    knots: int
    curve: Lissajous | Spline | None
    """The reference: a curve, the spline of the user's file, or None for random polynomials."""

    @classmethod
    def of(cls, config: TrackConfig, shape: Shape, control_period: float = 0.0, checks: int = 1) -> "Track":
        """Check the kind of reference and read the user's file, if it is one.

        Raises:
            ValueError: for an unknown kind or a broken file.
        """
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

    def reference(self, key: PRNGKeyArray, n: int) -> Spline:
        """Draw one reference per vehicle."""
        c = self.config
        if self.curve is None:
            return polynomial(key, c.centre, c.polynomial_reach, c.polynomial_speed, n, self.knots)
        if isinstance(self.curve, Lissajous):
            return self.curve.spline(c.centre, jnp.pi * uniform(key, n, 1)[:, 0], self.knots)
        knots = jnp.asarray(self.curve.knots)
        return dataclasses.replace(self.curve, knots=jnp.broadcast_to(knots, (n, *knots.shape[1:])))

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, TrackMemory]:
        """Level, any heading, near the first point of the reference, with a random velocity."""
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
        return state, TrackMemory(reference, zero, zero)

    def drawn(self, memory: TrackMemory) -> dict[str, Array]:
        """The phase of a circle or a lemniscate; the knots of a random polynomial."""
        if isinstance(self.curve, Lissajous):
            return {"phase_rad": self.curve.phase(self.config.centre, memory.reference.knots[:, 0])}
        return {"knots": memory.reference.knots} if self.curve is None else {}

    def scene(self, memory: TrackMemory) -> Scene:
        """Level ground."""
        return Scene.of({}, memory.steps.shape[0])

    def desired_yaw(self, memory: TrackMemory, state: State) -> Float[Array, " n"]:
        """Along world x."""
        return jnp.zeros_like(memory.steps)
