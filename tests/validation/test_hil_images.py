"""Images of hardware in the loop are those of the environment, bit for bit."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import CameraConfig
from e2efly.courses.origin import Origin
from e2efly.environment import Env
from e2efly.flight.pose.pose_source import PlantSource
from e2efly.policy.odometry import Sample
from e2efly.simulation.scenes.meshes.load import load_mesh_scene
from e2efly.tasks.avoid.world import Avoid
from e2efly.validation.candidate import candidate
from e2efly.validation.scenery import Scenery
from e2efly.validation.starts import draw_starts
from e2efly.validation.virtual_world import Node, ahead

SEED = 7
ORIGIN = Origin((1.0, -2.0, 0.5), 0.4)


class Kept:
    """An output that keeps what is published."""

    def __init__(self) -> None:
        self.images: list[tuple[float, np.ndarray]] = []

    def publish(self, time: float, image: np.ndarray) -> None:
        self.images.append((time, image))


def env_of(sees: str) -> Env:
    """The environment of avoid, with a small camera that sees this."""
    found = candidate("avoid")
    env = found.environment(next(iter(found.task.criteria().values())))
    return dataclasses.replace(env, cameras=(CameraConfig(sees, width=32, height=16, latency=(0.0, 0.05), rate=30.0),))


SCAN = load_mesh_scene("warehouse")


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape"], meta_fields=["control_period", "checks"])
@dataclass(frozen=True)
class Scanned(Avoid):
    """A task whose world is of triangles."""

    def scene(self, memory: Any) -> Any:
        return SCAN


@pytest.mark.whole
@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("sees", ["depth", "rgb"])
def test_an_image_is_that_of_the_environment_at_the_pose_bit_for_bit(sees: str, triangles: bool) -> None:
    env = env_of(sees)
    scenery = Scenery.draw(env, SEED)
    assert scenery is not None
    if triangles:  # the node shows the scene in place of the task's world, the environment has a task of that world
        scenery = scenery.within(SCAN)
        env = dataclasses.replace(env, task=Scanned(**vars(env.task)))
    samples, kept = list[Sample](), Kept()
    node = Node(scenery, PlantSource(lambda now: [samples.pop()]), [kept], ORIGIN, 1000.0, 0.001)
    look = jax.jit(lambda env, state, renewed: env.look(state, renewed))
    start = env.reset(jax.random.key(0), 1)[0]
    episode = draw_starts(env, 1, SEED)
    young = tuple(dataclasses.replace(eye, latency=0 * eye.latency) for eye in episode.eyes)
    rng = np.random.default_rng(1)
    for k in range(3):
        quaternion = np.array([1.0, *0.2 * rng.standard_normal(3)])
        quaternion /= np.linalg.norm(quaternion)
        place, now = ORIGIN.points(np.array([0.5, 0.2, 1.5]) + 1e-3 * rng.standard_normal(3)), 10 + 0.01 * k
        samples.append(Sample(now, place, quaternion, now, np.zeros(3), np.zeros(3)))
        assert node.step(now, lambda: 0.0) == "images"
        assert node._odometry is not None
        pose = ahead(node._odometry, now).seen_from(ORIGIN)
        vehicle = dataclasses.replace(
            start.vehicle,
            position=jnp.asarray(pose.position[None], jnp.float32),
            quaternion=jnp.asarray(pose.quaternion[None], jnp.float32),
        )
        past = jax.tree.map(lambda old, x: jnp.broadcast_to(x[:, None], old.shape), start.past, vehicle)
        state = dataclasses.replace(
            start,
            vehicle=vehicle,
            past=past,
            memory=episode.memory,
            eyes=young,
            time=jnp.full(1, 0.01 * k, jnp.float32),
        )
        wanted = np.asarray(look(env, state, jnp.ones(1, bool)).images[0])[0]
        shown, image = kept.images[k]
        assert shown == now
        np.testing.assert_array_equal(image, wanted)
    assert np.ptp(kept.images[0][1]) > 0
