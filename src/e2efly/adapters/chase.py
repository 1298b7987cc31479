"""The picture that Gymnasium's `render` returns: a vehicle in its world, drawn without a window by our own renderer."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.config import CameraConfig
from e2efly.environment import Env, EnvState
from e2efly.simulation.physics.rotation import from_euler, rotate, yaw
from e2efly.simulation.scenes.camera import look, mount
from e2efly.simulation.scenes.scene import Scene, Solids, join

WIDTH, HEIGHT = 480, 320
"""Size of a picture, pixels."""
BEHIND, ABOVE, DOWN = 2.2, 0.9, 0.35
"""Distance of the camera behind and above the vehicle, m, and its pitch downwards, rad."""
THICK = 0.03
"""Half the height of the vehicle's body and rotors in the picture, m."""
BODY, ROTOR, FRONT, GOAL = (0.15, 0.15, 0.18), (0.55, 0.55, 0.6), (0.85, 0.2, 0.1), (0.1, 0.65, 0.2)
"""Colours, RGB: body, rear rotors, front rotors, goal."""


class Chase:
    """A camera that follows a vehicle and looks along its heading."""

    def __init__(self, env: Env) -> None:
        self._env = env
        self._camera = CameraConfig("rgb", WIDTH, HEIGHT, fov=(1.2, 1.2 * HEIGHT / WIDTH), pitch=DOWN)
        self._draw = jax.jit(self._image)

    def __call__(self, state: EnvState, row: int = 0) -> np.ndarray:
        """The picture of one vehicle of a batch, uint8 (HEIGHT, WIDTH, 3)."""
        return np.asarray(self._draw(dataclasses.replace(state, images=()), row))

    def _image(self, state: EnvState, row: int) -> jax.Array:
        task = self._env.task
        worlds = task.scene(state.memory).at(state.time), state.vehicle, task.goal(state.memory, state.time)
        scene, vehicle, goal = jax.tree.map(lambda x: x[row][None], worlds)
        for kind, solids in self._solids(vehicle, goal).items():
            there = [scene.solids[kind]] if kind in scene.solids else []
            scene = Scene(scene.ground, {**scene.solids, kind: join(*there, solids)})
        heading, zero = yaw(vehicle.quaternion), jnp.zeros(1)
        turn = from_euler(zero, zero, heading)
        eye = vehicle.position + rotate(turn, jnp.array([[-BEHIND, 0.0, ABOVE]]))
        image = look(self._camera, scene, mount(self._camera, 1), eye, turn)[0]
        return jnp.clip(255 * image, 0, 255).astype(jnp.uint8)

    def _solids(self, vehicle: Any, goal: jax.Array) -> dict[str, Solids]:
        """The vehicle (a body with four rotors) and a ball at its goal."""
        arm = float(self._env.task.shape.radius) / 2
        places = jnp.array([[0.0, 0.0, 0.0], *([arm * x, arm * y, THICK] for x in (1, -1) for y in (1, -1))])
        turn = jnp.broadcast_to(vehicle.quaternion[:, None], (1, 5, 4))
        centre = vehicle.position[:, None] + rotate(turn, places[None])
        sizes = jnp.array([[0.5 * arm, 2 * THICK], *[[0.75 * arm, THICK / 2]] * 4])
        colours = jnp.array([[BODY, FRONT, FRONT, ROTOR, ROTOR]])
        body = Solids.of("cylinder", centre, sizes, colour=colours)
        ball = Solids.of("sphere", goal[:, None], jnp.array([0.08]), colour=jnp.array([[GOAL]]))
        return {"cylinder": dataclasses.replace(body, quaternion=turn), "sphere": ball}
