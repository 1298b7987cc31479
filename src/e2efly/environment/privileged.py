"""What only a critic knows: the true scene, and all others of a world. No policy is given it."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.control.vectors import unrotate
from e2efly.environment.env_state import EnvState
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.scene import clearance
from e2efly.tasks.company import all_others
from e2efly.tasks.task import Task

LEADS = (0.0, 0.25, 0.5, 1.0, 1.5)
"""Times ahead at which the clearance is told, s."""
SCENE_SIZE = 3 + len(LEADS)
"""Number of entries of `of_scene`."""
OTHER_SIZE = 6
"""Number of entries of `of_others` for each other vehicle."""
WIDEST = 5.0
"""Largest component of an offset or a relative velocity that is told, m or m/s."""


def of_scene(task: Task, state: EnvState) -> Float[Array, "n p"]:
    """The vector to the goal in the body frame, and the clearance where the vehicle will be after each of `LEADS` if it
    flies straight on, m, clipped to a few metres.
    """
    s, scene = state.vehicle, task.scene(jax.lax.stop_gradient(state.memory))
    away = unrotate(s.quaternion, task.goal(state.memory, state.time) - s.position)
    ahead = jax.vmap(lambda t: clearance(scene, s.position + t * s.velocity, state.time + t), out_axes=1)
    near = jnp.clip(ahead(jnp.asarray(LEADS)), -1.0, 3.0)
    return jnp.concatenate([jnp.clip(away, -WIDEST, WIDEST), near], axis=-1)


def of_others(vehicle: State, agents: int) -> Float[Array, "n p"]:
    """Positions and velocities of all others of the world minus the vehicle's, in the body frame, m and m/s,
    clipped.
    """
    others = all_others(vehicle, agents)
    n, count, _ = others.position.shape
    turn = jnp.repeat(vehicle.quaternion[:, None], count, axis=1)
    pairs = others.position - vehicle.position[:, None], others.velocity - vehicle.velocity[:, None]
    seen = [jnp.clip(unrotate(turn, pair), -WIDEST, WIDEST).reshape(n, -1) for pair in pairs]
    return jnp.concatenate(seen, axis=-1)
