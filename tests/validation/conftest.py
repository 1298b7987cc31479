"""What the validation tests share: policies that are a hand-made linear controller, exported as any policy is."""

import dataclasses
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from e2efly.config import NetworkConfig
from e2efly.config.registry import is_shipped
from e2efly.environment import Env
from e2efly.learning.networks import Actor, Features, Layers, Weights
from e2efly.learning.onnx_export import contract_of, export_policy
from e2efly.runs import presets
from e2efly.validation.plants import PLANTS
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle, vehicle_file

POSITION, VELOCITY, ATTITUDE = 2.0, 2.4, 6.0
"""Gains: 1/s^2, 1/s, 1/s."""


@pytest.fixture(autouse=True)
def _own_files_are_read_anew(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A file is imported once, and registers its plant then: each test finds neither, and leaves neither."""
    monkeypatch.setattr(PLANTS, "_known", {name: known for name, known in PLANTS.items() if is_shipped(known)})
    own = "e2efly_file_"
    for name in [name for name in sys.modules if name.startswith(own)]:
        monkeypatch.delitem(sys.modules, name)
    yield
    for name in [name for name in sys.modules if name.startswith(own)]:
        del sys.modules[name]


@pytest.fixture
def heavy(tmp_path: Path) -> str:
    """The file of a VIS-R with 20 % more mass."""
    return weighing(0.9, tmp_path)


def weighing(mass: float, folder: Path) -> str:
    """The file of a VIS-R of another mass, kg."""
    vehicle, file = vehicle_file("vis_r").read_text(), folder / "heavy.toml"
    file.write_text(vehicle.replace("value = 0.75\n", f"value = {mass}\n", 1))
    assert load_vehicle(file).mass == mass
    return str(file)


def controller(env: Env, sink: float = 0.0) -> Layers:
    """One linear layer that flies towards the first target shown.

    Acceleration wanted along body x and y: POSITION * error - VELOCITY * velocity; the tilt that gives it is reached
    by body rates; the collective thrust does the same along z, aiming `sink` m below the target.
    """
    offsets = dict(zip((f.name for f in env.fields), np.cumsum([0, *(_size(f) for f in env.fields)]), strict=False))
    scale = {f.name: f.scale for f in env.fields}
    goal = env.fields[0].name
    weight, bias = np.zeros((Features(env.fields).size, 4)), np.zeros(4)

    def add(command: int, field: str, axis: int, gain: float) -> None:
        """A command per unit of the field's physical value."""
        weight[offsets[field] + axis, command] += gain * scale[field]

    for command, axis, sign in ((2, 0, 1.0), (1, 1, -1.0)):
        add(command, goal, axis, sign * ATTITUDE / GRAVITY * POSITION)
        add(command, "velocity", axis, -sign * ATTITUDE / GRAVITY * VELOCITY)
        add(command, "attitude", axis, sign * ATTITUDE)  # the world's up axis, seen from the body
    add(0, goal, 2, POSITION)
    add(0, "velocity", 2, -VELOCITY)
    bias[0] = GRAVITY - POSITION * sink - float(env.center[0])
    half = np.asarray(env.half, np.float64)
    # about the middle of the range tanh(x) is x; the thrust of hovering is not there: shift it onto the curve
    hover = (GRAVITY - float(env.center[0])) / half[0]
    weight, bias = weight / half, bias / half
    slope = 1 - hover**2
    weight[:, 0] /= slope
    bias[0] = math.atanh(hover) + (bias[0] - hover) / slope
    return [(weight.astype(np.float32), bias.astype(np.float32))]


def _size(field: Any) -> int:
    return 3 if field.frame == "world_body" else field.size


@pytest.fixture(scope="session")
def policy_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """(task, sink) -> policy.onnx of the hand-made controller."""
    folder = tmp_path_factory.mktemp("policies")

    def make(task: str, sink: float = 0.0, **env_options: Any) -> Path:
        config = presets.preset(task, "ppo")
        config = dataclasses.replace(config, env=dataclasses.replace(config.env, **env_options))
        env = Env.of(config.task, config.reward, config.env)
        path = folder / f"{task}-{sink}-{'-'.join(env_options)}" / "policy.onnx"
        if not path.exists():
            path.parent.mkdir()
            actor = Actor.of(env.fields, (), NetworkConfig(()))
            export_policy(path, Weights((), None, controller(env, sink)), actor, contract_of(env, config))
        return path

    return make
