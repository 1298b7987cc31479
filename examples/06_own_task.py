"""A task of one's own: circle around a point. `e2efly train examples/06_own_task.py:OrbitConfig`, or run this file."""

import math
import sys
import tempfile
from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp

import e2efly
from e2efly.config import TaskConfig, number
from e2efly.physics import State
from e2efly.tasks.hover.world import Hover
from e2efly.tasks.task import Outcome, touches_ground


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Orbit(Hover):
    """Hover's starts, scene and observation; its target moves. The task's memory is the mean error so far, m."""

    def start(self, key: Any, n: int) -> tuple[State, Any]:
        """As hover's; nothing has been summed yet."""
        state, _ = super().start(key, n)
        return state, jnp.zeros(n)

    def goal(self, memory: Any, time: Any) -> Any:
        """The target, on its circle at this time."""
        c = self.config
        angle = c.speed / c.circle * jnp.broadcast_to(time, memory.shape)
        return jnp.asarray(c.target) + c.circle * jnp.stack([jnp.cos(angle), jnp.sin(angle), 0 * angle], axis=-1)

    def advance(self, memory: Any, before: State, after: State, time: Any, timed_out: Any) -> tuple[Any, Outcome]:
        """Success: near the moving target on average, never outside the fence or on the ground."""
        c = self.config
        error = jnp.linalg.norm(after.position - self.goal(memory, time), axis=-1)
        mean = memory + (error - memory) * self.control_period / jnp.maximum(time, self.control_period)
        crashed = (error > c.fence) | touches_ground(self.shape, after)
        success = timed_out & ~crashed & (mean < c.mean_error)
        return mean, Outcome(
            terminated=crashed, success=success, arrived=jnp.zeros_like(crashed), crashed=crashed, error=error
        )


@e2efly.register_task("orbit")
@dataclass(frozen=True)
class OrbitConfig(TaskConfig):
    """Fly circles around a point."""

    world: ClassVar = Orbit
    reward: ClassVar = {"near": 1.0, "v1": 0.01, "anglev_sq": 0.002, "act2_sq": 0.02}

    target: tuple[float, float, float] = number((0.0, 0.0, 3.0), low=-math.inf)
    """Centre of the circle, world, m."""
    circle: float = number(1.0, above=0)
    """Its radius, m."""
    speed: float = 1.0
    """Along it, m/s."""
    position: float = 1.0
    """Start within this of the centre, m per axis."""
    velocity: float = 0.5
    """Start velocity, m/s per axis, uniform in +-."""
    tilt: float = 0.3
    """Start roll and pitch, rad, uniform in +-."""
    body_rate: float = 0.5
    """Start body rates, rad/s per axis, uniform in +-."""
    mean_error: float = number(0.3, above=0)
    """Success: mean distance to the moving target, m."""
    fence: float = number(5.0, above=0)
    """Farther than this from it the episode fails, m."""


if __name__ == "__main__":
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    with tempfile.TemporaryDirectory() as folder:
        summary = e2efly.train(OrbitConfig, "ppo", out=f"{folder}/run", steps=steps, progress=True)
        policy = e2efly.load_policy(f"{folder}/run/policy.onnx")
    print(f"success on unseen starts: {summary['shipped']['orbit']['success']:.1%}")
    print("the contract's task:", policy.contract.task.rsplit("/", 1)[-1])
