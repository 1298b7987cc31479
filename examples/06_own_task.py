"""Your own task: circle around a point. `e2efly train examples/06_own_task.py:OrbitConfig`, or run this file."""

import sys
import tempfile
from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import numpy as np

import e2efly
from e2efly.config import number
from e2efly.control.vectors import namespace
from e2efly.policy.goal import Course, Outcome, Shape
from e2efly.tasks.hover import HoverConfig
from e2efly.tasks.hover.world import Hover
from e2efly.tasks.route import Route
from e2efly.tasks.verdicts import distance, touches_ground


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Orbit(Hover):
    """The starts, scene and observation of hover, with a moving target. The task's memory is the mean error so far, m.

    `goal` and `advance` take the arrays of JAX in training and of NumPy in flight.
    """

    def goal(self, memory: Any, time: Any) -> Any:
        """The target, on its circle at this time."""
        c, xp = self.config, namespace(time)
        angle = c.speed / c.circle * (time + 0 * memory)
        return xp.asarray(c.target) + c.circle * xp.stack([xp.cos(angle), xp.sin(angle), 0 * angle], axis=-1)

    def advance(self, memory: Any, before: Any, after: Any, time: Any, timed_out: Any) -> tuple[Any, Outcome]:
        """Success: near the moving target on average, and never outside the fence or on the ground."""
        c, error = self.config, distance(after.position, self.goal(memory, time))
        mean = memory + (error - memory) * self.control_period / time.clip(self.control_period)
        crashed = (error > c.fence) | touches_ground(self.shape, after)
        success = timed_out & ~crashed & (mean < c.mean_error)
        return mean, Outcome(terminated=crashed, success=success, arrived=success, crashed=crashed, error=error)


@dataclass(frozen=True)
class OrbitRoute(Route):
    """The route for `e2efly fly`. `--goal.origin` moves the circle."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The circle, endlessly."""
        orbit = Orbit(OrbitConfig(), shape, control_period)
        return Course(orbit, np.zeros(1), start=np.array([1.0, 0.0, 3.0]), points=[(0.0, 0.0, 3.0)])


@e2efly.register_task("orbit")
@dataclass(frozen=True)
class OrbitConfig(HoverConfig):
    """Fly circles around a point. It has the options, recipes and plot settings of hover, and its own options."""

    world: ClassVar = Orbit
    route: ClassVar = OrbitRoute

    circle: float = number(1.0, above=0)
    """Radius of the circle, m."""
    speed: float = 1.0
    """Speed along the circle, m/s."""
    position: float = 1.0
    """Start within this of the centre, m per axis."""
    velocity: float = 0.5
    """Start velocity, m/s per axis, uniform in +-."""
    mean_error: float = number(0.4, above=0)
    """Success: mean distance to the moving target, m."""


if __name__ == "__main__":
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    with tempfile.TemporaryDirectory() as folder:
        summary = e2efly.train(OrbitConfig, "ppo", out=f"{folder}/run", steps=steps, progress=True)
        policy = e2efly.load_policy(f"{folder}/run/policy.onnx")
    print(f"success on unseen starts: {summary['shipped']['orbit']['success']:.1%}")
    print("the contract's task:", policy.contract.task.rsplit("/", 1)[-1])
