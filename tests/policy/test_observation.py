"""The table of the vehicle's own observation fields: one entry is all that a field needs."""

import dataclasses
from pathlib import Path

import jax
import numpy as np
import pytest

from e2efly.commands.cli import run
from e2efly.config import EnvConfig, ImuConfig
from e2efly.environment import Env, random_key
from e2efly.policy import observation
from e2efly.policy.loader import load_policy
from e2efly.policy.observation import Field, Own
from e2efly.policy.odometry import Odometry
from e2efly.policy.runtime import Imu, Runtime, act, begin
from e2efly.runs import presets
from e2efly.tasks.hover.goal import HoverRoute
from e2efly.tasks.route import course_for
from e2efly.validation.candidate import candidate
from e2efly.vehicles.loading import load_vehicle
from tests.policy.made import made

HEIGHT = Own(Field("height", 1, "none", "m", 3.0, "height"), lambda known: known.motion.position[..., 2:])
DRIFT = Own(Field("drift", 1, "none", "rad/s", 4.0, "a rate"), lambda known: known.imu.gyroscope[..., :1], "imu")


def test_an_entry_is_trained_exported_flown_and_written_as_c(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment, the runtime and the C show what the entry says, in the place that it says."""
    *before, last = observation.OWN
    monkeypatch.setattr(observation, "OWN", (*before, HEIGHT, DRIFT, last))
    preset = presets.preset("hover", "ppo")
    preset = dataclasses.replace(preset, env=EnvConfig(imu=ImuConfig(observed=True), past_actions=2))
    env = Env.of(preset.task, preset.reward, preset.env)
    assert [field.name for field in env.fields][-3:] == ["height", "drift", "past_actions"]
    state, shown = jax.jit(env.reset, static_argnums=1)(random_key(0), 2)
    np.testing.assert_array_equal(shown[:, -10], state.vehicle.position[:, 2])

    file = made(tmp_path / "policy.onnx", 0.1, env, preset, hidden=8, hovers=False)
    policy, vehicle = load_policy(file), load_vehicle("vis_r")
    flight = Runtime.of(
        policy, course_for(policy.contract, vehicle, HoverRoute(target=preset.task.target)), vehicle, imu=True
    )
    v, imu = state.vehicle, state.imu
    at = Odometry(0.0, *(np.asarray(x[1]) for x in (v.position, v.velocity, v.quaternion, v.body_rate)))
    felt = Imu(np.asarray(imu.gyroscope[1]), np.asarray(imu.accelerometer[1]))
    _, decision = act(flight, begin(flight, at, 0.0), at, 0.0, felt)
    np.testing.assert_allclose(decision.observation, shown[1], rtol=1e-6, atol=2e-5)

    assert run(["export", str(file), "--c", str(tmp_path / "c")]) == 0
    assert "float field_height[1];" in (tmp_path / "c" / "policy.h").read_text()


def test_an_older_policy_goes_on_without_a_new_entry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(observation, "OWN", (HEIGHT, *observation.OWN))
    found = candidate("hover")
    env = found.environment(next(iter(found.task.criteria().values())))
    assert env.fields == found.policy.contract.observation
    assert "height" in [field.name for field in Env.of(found.task, presets.preset("hover", "ppo").reward).fields]
