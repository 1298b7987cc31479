"""What flies and what its flight controller takes it for: one answer from `eval` and from every plant."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import jax
import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.config import RewardConfig, TaskConfig
from e2efly.environment import Env
from e2efly.tasks import TASKS
from e2efly.validation.plant import EVERYTHING
from e2efly.validation.plant_stress import stress
from e2efly.validation.plants import PLANTS
from e2efly.validation.reality import altered
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import CONTROLLED, Flown

EXAMPLE = Path(__file__).parents[2] / "examples" / "07_own_plant.py"
CLOSE = {"simulator": 1e-3, "mujoco": 5e-3}
"""Largest difference of an error to that of `eval`, m: rounding, and another physics."""
SAG = {"policy": (0.9, 1.0), "plant": (-0.001, 0.001)}
"""How much deeper under its target a controller without integral hovers a vehicle 20 % heavier than its own, m: its
gain is 2 m/s^2 per m, and thrust for 20 % of 9.81 m/s^2 is missing; or nothing, where the rate loop knows the mass."""


@pytest.mark.whole
@pytest.mark.parametrize("controller", ["policy", "plant"])
def test_eval_and_the_plants_fly_a_heavier_vehicle_alike(
    controller: str, heavy: str, policy_of: Callable[..., Path]
) -> None:
    policy = policy_of("hover")
    own = e2efly.evaluate(policy, 4).flown["hover"]
    evaluated = e2efly.evaluate(policy, 4, vehicle=heavy, controller=controller)  # type: ignore[arg-type]
    assert evaluated.as_json()["controller"] == controller
    assert evaluated.as_json()["vehicle"] == heavy
    there = evaluated.flown["hover"]
    low, high = SAG[controller]
    deeper = there.final_error - own.final_error
    assert np.all((deeper > low) & (deeper < high)), deeper
    for plant, close in CLOSE.items():
        found = e2efly.validate(policy, plant, 4, vehicle=heavy, controller=controller)  # type: ignore[arg-type]
        assert found.as_json()["controller"] == controller
        flown = found.criteria["hover"].flown
        np.testing.assert_array_equal(flown.success, there.success)
        np.testing.assert_allclose(flown.final_error, there.final_error, atol=close, err_msg=plant)
        np.testing.assert_allclose(flown.mean_error, there.mean_error, atol=4 * close, err_msg=plant)
        # what stands beside it is the policy at home
        np.testing.assert_allclose(found.criteria["hover"].trained.final_error, own.final_error, atol=1e-6)


def test_the_body_is_the_file_s_and_the_controller_the_one_asked_for() -> None:
    own, other = load_vehicle("vis_r"), load_vehicle("crazyflie")
    unaware = Flown.of(own, other)
    assert unaware.believed is own
    for name in vars(own):
        wanted = own if name in CONTROLLED else other
        np.testing.assert_array_equal(getattr(unaware.body, name), getattr(wanted, name), err_msg=name)
    tuned = Flown.of(own, other, "plant")
    assert tuned.as_believed
    assert (tuned.body.latency, tuned.body.control_rate) == (own.latency, own.control_rate)
    np.testing.assert_array_equal(tuned.body.rate_gain, other.rate_gain)
    assert Flown.of(own, own).as_believed
    assert altered(unaware.body, unaware.believed) <= EVERYTHING - set(CONTROLLED)
    with pytest.raises(ValueError, match="--controller is 'body'; accepted: policy or plant"):
        Flown.of(own, other, "body")


def test_rotors_of_the_body_turn_no_faster_than_they_can() -> None:
    """The flight controller asks for the speed of stronger rotors."""
    own = load_vehicle("vis_r")
    weak = dataclasses.replace(own, rotor_speed_max=0.8 * own.full_rotor_speed)
    task: TaskConfig = TASKS.find("hover").training()
    env = Env.of(task, RewardConfig({"prog2": 1.0}), flown=Flown.of(own, weak))
    state, _ = jax.jit(env.reset, static_argnums=1)(jax.random.key(0, impl="rbg"), 2)
    forward = jax.jit(lambda s: env.step(s, np.ones((2, 4), np.float32) * [1, 0, 0, 0], restart=False)[0])
    for _ in range(20):
        state = forward(state)
    np.testing.assert_allclose(state.vehicle.rotor_speed, weak.rotor_speed_max, rtol=1e-3)
    found = []
    for name in CLOSE:
        plant = PLANTS.find(name)(own, "ctbr")  # type: ignore[call-arg]
        plant.meet(weak)
        plant.reset(e2efly.RigidState(np.zeros(3) + 2.0, np.zeros(3), np.eye(4)[0], np.zeros(3)))
        plant.step(np.array([4 * own.thrust_range[1] / own.mass, 0, 0, 0]), 0.5)
        found.append(plant.state.velocity[2])
    most = 0.5 * (4 * own.rotor_thrust(weak.rotor_speed_max) / own.mass - 9.81)
    assert found[0] == pytest.approx(found[1], abs=0.03)
    assert 0.5 * most < found[0] < most


def test_wind_and_shares_of_thrust_act_alike_on_every_plant() -> None:
    vehicle, states = load_vehicle("vis_r"), []
    for name in CLOSE:
        plant = PLANTS.find(name)(vehicle, "ctbr")  # type: ignore[call-arg]
        q = np.array([0.9, 0.1, 0.3, 0.2])
        plant.reset(e2efly.RigidState(np.zeros(3) + 9.0, np.ones(3), q / np.linalg.norm(q), np.zeros(3)))
        plant.disturb(np.array([6.0, -4.0, 1.0]), np.array([0.8, 0.9, 1.0, 0.7]))
        plant.step(np.array([11.0, 0.5, 0.0, 0.0]), 0.4)
        states.append(plant.state)
        plant.reset(states[-1])
        plant.step(np.array([11.0, 0.5, 0.0, 0.0]), 0.4)  # forgotten
        states.append(plant.state)
    for ours, theirs in zip(states[:2], states[2:], strict=True):
        np.testing.assert_allclose(ours.position, theirs.position, atol=0.01)
        np.testing.assert_allclose(ours.velocity, theirs.velocity, atol=0.03)
        np.testing.assert_allclose(ours.body_rate, theirs.body_rate, atol=0.05)
    assert np.linalg.norm(states[0].body_rate) > 0.3  # weak rotors turn it


def test_a_plain_mixer_is_the_simulators() -> None:
    vehicle, states = load_vehicle("vis_r"), []
    for name in CLOSE:
        for plain in (False, True):
            plant = PLANTS.find(name)(vehicle, "ctbr")  # type: ignore[call-arg]
            plant.meet(vehicle, plain)
            plant.reset(e2efly.RigidState(np.zeros(3) + 9.0, np.zeros(3), np.eye(4)[0], np.zeros(3)))
            plant.step(np.array([28.0, 9.0, -9.0, 4.0]), 0.1)
            states.append(plant.state.body_rate)
    np.testing.assert_allclose(states[:2], states[2:], atol=0.4)
    assert np.linalg.norm(states[0] - states[1]) > 1


def test_a_plant_that_cannot_change_the_body_says_so(heavy: str, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["validate", "hover", "--plant", f"{EXAMPLE}:PointMass", "--vehicle", heavy, "--episodes", "2"]
    assert run(asked) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "plant 'point_mass' cannot change mass without its flight controller's knowledge" in said
    assert "--controller plant" in said


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("command", [["eval", "--plots"], ["validate", "--plant", "simulator", "--out"]])
def test_a_task_and_the_file_of_any_vehicle_are_accepted(
    command: list[str], heavy: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The zoo has no policy of that vehicle: the usual one flies it."""
    report = tmp_path / "report.json"
    name, *rest = command
    asked = [name, "race", "--vehicle", heavy, "--episodes", "2", "--json", str(report), *rest, str(tmp_path)]
    assert run(asked) == 0
    printed = "".join(capsys.readouterr().out.split())
    assert f"Whatfliesis{heavy},bythepolicyofavis_r;theflightcontrollerbelievesinthevis_r." in printed
    said = json.loads(report.read_text())
    assert said["vehicle"] == heavy
    assert said["policy"].endswith("vis_r/race.onnx")


WEIGHED = """

@e2efly.register_plant("weighed")
class Weighed(PointMass):
    alters = frozenset({"mass"})

    def __init__(self, vehicle, command_mode):
        super().__init__(vehicle, command_mode)
        self.believed, self.body = vehicle, vehicle

    def meet(self, body, plain_mixer=False):
        self.body = body

    def step(self, command, dt):
        super().step(command * [self.believed.mass / self.body.mass, 1, 1, 1], dt)
"""


@pytest.mark.whole
def test_a_plant_of_ones_own_is_given_the_body(
    heavy: str, policy_of: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says that it can change the mass: a vehicle that differs in it is accepted, another is not."""
    monkeypatch.setattr(PLANTS, "_known", {name: PLANTS._known[name] for name in ("simulator", "mujoco")})
    code = EXAMPLE.read_text().split("if __name__")[0].replace('"point_mass"', '"light"')
    (tmp_path / "own.py").write_text(code + WEIGHED)
    policy, plant = policy_of("hover"), f"{tmp_path / 'own.py'}:Weighed"
    deep, home = (
        e2efly.validate(policy, plant, 2, vehicle=vehicle).criteria["hover"].flown.final_error
        for vehicle in (heavy, None)
    )
    low, high = SAG["policy"]
    assert np.all((deep - home > low) & (deep - home < high)), deep - home
    found = stress(policy, plant, 2)
    assert {row for row in found.flown if row.startswith(("mass", "drag"))} == {"mass x0.8", "mass x1.25"}
    sunk = found.flown["mass x1.25"]["hover"].final_error - found.flown["nominal"]["hover"].final_error
    assert np.all(sunk > 1)
    with pytest.raises(ValueError, match=r"plant 'weighed' cannot change .*inertia.*; accepted: mass, or --controller"):
        e2efly.validate(policy, plant, 2, vehicle="crazyflie")
