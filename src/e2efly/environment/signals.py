"""Signals of a control step that the reward terms read."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.environment.env_state import EnvState
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler, yaw
from e2efly.simulation.scenes import scene as scenes
from e2efly.tasks.task import Outcome, Task


def happened(
    task: Task, before: EnvState, after: EnvState, action: Float[Array, "n c"], outcome: Outcome
) -> dict[str, Array]:
    """The signals of every task, and those of this task, by name.

    Args:
        task: the task of the vehicles.
        before: the state in which the action was taken.
        after: the state that was reached, before any new start.
        action: in [-1, 1], before it is clipped.
        outcome: the outcome of the step, from the task.
    """
    goal_before, goal_now = (task.goal(before.memory, t) for t in (before.time, after.time))
    vehicle = after.vehicle
    wanted_yaw = task.desired_yaw(before.memory, vehicle)
    zero = jnp.zeros_like(wanted_yaw)
    return {
        "offset": goal_now - vehicle.position,
        "previous_offset": goal_before - before.vehicle.position,
        "velocity": vehicle.velocity,
        "quaternion": vehicle.quaternion,
        "body_rate": vehicle.body_rate,
        "action": action,
        "previous_action": before.actions[:, 0],
        "height": vehicle.position[:, 2] - goal_now[:, 2],
        "yaw_error": _wrap(yaw(vehicle.quaternion) - wanted_yaw),
        "desired_quaternion": from_euler(zero, zero, wanted_yaw),
        "arrived": outcome.arrived,
        "crashed": outcome.crashed,
        **outcome.signals,
    }


def dangers(task: Task, memory: Any, state: State, time: Float[Array, " n"]) -> dict[str, Array]:
    """The distances from the vehicle's sphere to things, m, and how fast the things come nearer, m/s.

    Gates do not count: a vehicle that keeps away from them does not fly through them.
    """
    scene, radius = task.scene(memory), task.shape.radius
    scene = dataclasses.replace(scene, solids={k: s for k, s in scene.solids.items() if k != "gate"})

    def gaps(position: Array, time: Array) -> Array:
        return scenes.gaps(scene, position, time) - radius

    each, growing = jax.jvp(gaps, (state.position, time), (state.velocity, jnp.ones_like(time)))
    nearest = jax.nn.one_hot(jnp.argmin(each, axis=-1), each.shape[-1])
    return {
        "gaps": each,
        "closing": -growing,
        "clearance": jnp.sum(nearest * each, axis=-1),
        "approach_speed": -jnp.sum(nearest * growing, axis=-1),
    }


def _wrap(angle: Array) -> Array:
    """Wrap an angle into [-pi, pi]."""
    return jnp.arctan2(jnp.sin(angle), jnp.cos(angle))
