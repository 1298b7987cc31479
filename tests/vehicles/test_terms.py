"""Terms of the physics in a vehicle's file: left out or there, refused by name, randomised like all else."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, RewardConfig
from e2efly.environment import Env, EnvState, random_key
from e2efly.runs.presets import preset
from e2efly.vehicles.loading import load_vehicle, read_sigmas, vehicle_file, vehicle_names
from e2efly.vehicles.vehicle import quantities, terms
from e2efly.vehicles.vehicle_rules import BATTERY
from tests.terms import VALUES


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    """VIS-R's file with entries of these values."""

    def write(**values: Any) -> Path:
        units = {f.name: f.metadata["unit"] for f in terms()}
        entries = [f'[{k}]\nvalue = {v}\nunit = "{units[k]}"\nsource = "estimated"\n' for k, v in values.items()]
        path = tmp_path / "mine.toml"
        path.write_text("\n".join([vehicle_file("vis_r").read_text(), *entries]))
        return path

    return write


def test_shipped_vehicles_have_none_of_them() -> None:
    for name in vehicle_names():
        assert all(getattr(load_vehicle(name), term.name) is None for term in terms())
    assert load_vehicle("vis_r").hash == "1536c594658f65aa"  # by which exported policies know it


@pytest.mark.parametrize("name", VALUES)
def test_a_term_in_a_file(name: str, written: Callable[..., Path]) -> None:
    names = [name] if name not in BATTERY else list(BATTERY)
    path = written(**{name: VALUES[name] for name in names})
    vehicle, plain = load_vehicle(path), load_vehicle("vis_r")
    np.testing.assert_array_equal(getattr(vehicle, name), VALUES[name])
    hashes = {plain.hash, vehicle.hash, dataclasses.replace(vehicle, **{name: 2 * np.asarray(VALUES[name])}).hash}
    assert len(hashes) == 3
    assert dataclasses.replace(vehicle, **dict.fromkeys(names)).hash == plain.hash
    assert [f.name for f in quantities(vehicle)] == [*(f.name for f in quantities()), *names]
    assert np.isnan(read_sigmas(path)[name]).all()
    assert set(read_sigmas("vis_r")) == {f.name for f in quantities()}


BROKEN: dict[str, tuple[dict[str, Any], str]] = {
    "negative rotor inertia": ({"rotor_inertia": -1e-6}, r"rotor_inertia.value is -1e-06; accepted: >= 0 kg\*m\^2"),
    "centre of mass outside": ({"centre_of_mass": [0.06, 0.0, 0.0]}, r"centre_of_mass.value is .*0.06.*accepted: a pl"),
    "flat centre of mass": ({"centre_of_mass": [0.01, 0.0]}, r"centre_of_mass.value is .*accepted: numbers of shape"),
    "no principal moment": ({"inertia_products": [2e-3, 0, 0]}, "inertia_products.value is .*accepted: a tensor of"),
    "no rigid body": ({"inertia_products": [1.2e-3, 0, 0]}, "inertia.value is .* with products .*accepted: no princi"),
    "drag torque that drives": ({"drag_torque": [-1e-3, 0.0, 0.0]}, r"drag_torque.value is .*accepted: >= 0 N\*m\*s"),
    "an integral that drives": ({"rate_integral_gain": [-1.0, 0, 0]}, "rate_integral_gain.value is .*accepted: >= 0 "),
    "no filter": ({"gyro_time_constant": 0.0}, r"gyro_time_constant.value is 0.0; accepted: > 0 s"),
    "a battery without a nominal voltage": (
        {"battery_voltage": 15.0, "voltage_sag": 0.1},
        "battery_voltage and voltage_sag without nominal_voltage; accepted",
    ),
    "a flat battery": (
        {"nominal_voltage": 14.8, "battery_voltage": 10.0, "voltage_sag": 0.3},
        r"battery_voltage.value is 10.0 V.*not hover",
    ),
    "no lag down": ({"motor_time_constant_down": 0.0}, r"motor_time_constant_down.value is 0.0; accepted: > 0 s"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_term_that_cannot_be_is_refused_by_name(kind: str, written: Callable[..., Path]) -> None:
    values, words = BROKEN[kind]
    with pytest.raises(ValueError, match=rf"mine\.toml: .*{words}"):
        load_vehicle(written(**values))


def env_of(vehicle: Path | str, randomize: dict[str, float]) -> Env:
    config = EnvConfig(vehicle=str(vehicle), randomize=randomize)
    return Env.of(preset("hover", "ppo").task, RewardConfig({"prog2": 1.0}), config)


@pytest.mark.parametrize("name", VALUES)
def test_a_term_is_randomised_where_it_is(name: str, written: Callable[..., Path]) -> None:
    env = env_of(written(**VALUES), {name: 0.3})
    drawn = np.asarray(env.reset(random_key(0), 64)[0].plant[name]) / np.asarray(VALUES[name])
    assert 0.7 <= drawn.min() < 0.75
    assert 1.25 < drawn.max() <= 1.3


@pytest.mark.parametrize("name", VALUES)
@pytest.mark.parametrize("vehicle", ["vis_r", "any"])
def test_a_term_that_is_not_there_is_not_randomised(name: str, vehicle: str) -> None:
    with pytest.raises(
        ValueError, match=rf"env.randomize.{name} is 0.3, and vehicle '{vehicle}' has no {name}; accept"
    ):
        env_of(vehicle, {name: 0.3})


def test_draws_of_an_inertia_that_no_body_has_are_refused(written: Callable[..., Path]) -> None:
    path = written(inertia_products=[6e-4, -2e-4, 5e-5])
    env_of(path, {"inertia": 0.3, "inertia_products": 0.3})
    with pytest.raises(ValueError, match=r"env.randomize is .*'inertia': 0.5.*no positive principal moment"):
        env_of(path, {"inertia": 0.5, "inertia_products": 0.5})


def test_episodes_begin_with_a_rate_loop_that_remembers_nothing(written: Callable[..., Path]) -> None:
    """In the environment, whose loops keep the structure of the state; after a crash, too."""
    env = env_of(written(rate_integral_gain=[60.0, 50.0, 20.0], gyro_time_constant=0.004), {})
    state, _ = env.reset(random_key(0), 8)
    before = state.vehicle.rate_loop
    assert before is not None
    np.testing.assert_array_equal(before.integral, 0.0)
    np.testing.assert_array_equal(before.seen, state.vehicle.body_rate)

    def fly(state: EnvState, _: None) -> tuple[EnvState, tuple[jax.Array, jax.Array, jax.Array]]:
        state, out = env.step(state, jnp.tile(jnp.asarray([-1.0, 0.5, -0.3, 0.2]), (8, 1)))
        loop = state.vehicle.rate_loop
        assert loop is not None
        return state, (out.done, loop.integral, loop.seen - state.vehicle.body_rate)

    done, integral, lag = (np.asarray(x) for x in jax.jit(lambda s: jax.lax.scan(fly, s, None, 90)[1])(state))
    assert done.any()
    assert np.abs(integral[~done]).max() > 1
    np.testing.assert_array_equal(integral[done], 0.0)
    np.testing.assert_array_equal(lag[done], 0.0)


def test_draws_of_a_battery_that_lifts_nothing_are_refused(written: Callable[..., Path]) -> None:
    path = written(nominal_voltage=14.8, battery_voltage=14.0, voltage_sag=0.1)
    env_of(path, {"battery_voltage": 0.1})
    with pytest.raises(ValueError, match=r"env.randomize is .*'battery_voltage': 0.5.*weakest vehicle.*cannot hover"):
        env_of(path, {"battery_voltage": 0.5})
