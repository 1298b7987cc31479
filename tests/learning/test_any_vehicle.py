"""One policy for a family of vehicles: its environment, its contract, and where it flies."""

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.commands.train import parse
from e2efly.config import DisturbanceConfig, NetworkConfig, PPOConfig
from e2efly.environment import Env, random_key
from e2efly.policy.contract import Contract
from e2efly.policy.loader import level_and_still
from e2efly.runs import presets
from e2efly.simulation import device
from e2efly.simulation.physics import Physics, step
from e2efly.tasks import TASKS
from e2efly.validation.evaluation import act_of
from e2efly.validation.stress import stress
from e2efly.vehicles.family import Family, _loaded, load_family
from e2efly.vehicles.loading import load_vehicle, vehicle_file
from e2efly.vehicles.vehicle import Vehicle


@pytest.fixture(scope="module", autouse=True)
def _quick() -> Iterator[None]:
    """The suite's options (QUICK) hold as they are, which compile sooner than `fast_compile` does: for tiny runs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(device, "FAST_COMPILE", {})
        yield


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of a policy that has learned next to nothing, of any vehicle."""
    out = tmp_path_factory.mktemp("runs") / "any"
    algo, network = PPOConfig(envs=4, horizon=16, minibatch=64), NetworkConfig(hidden=(8,), recurrent=8)
    e2efly.train("hover", "ppo", preset_name="nominal", vehicle="any", out=out, steps=64, chunk=1, eval_episodes=10,
                 options=algo, network=network, devices=1)  # fmt: skip
    return out


def family(name: str = "any") -> Family:
    found = load_family(name)
    assert found is not None
    return found


def vehicle_of(u: np.ndarray, name: str = "any") -> Vehicle:
    return _loaded(family(name).draw(np.asarray(u, np.float64)), name)


def environment(**options: object) -> Env:
    config = presets.preset("hover", "bptt")
    return Env.of(config.task, config.reward, dataclasses.replace(config.env, **{"vehicle": "any"} | options))


@pytest.mark.whole(but=2)
@pytest.mark.parametrize(
    ("name", "mode"),
    [("multirotor", "ctbr"), ("any", "ctbr"), ("any", "rotor_share"), ("any", "rotor_speed")],
)
def test_every_episode_flies_as_a_simulation_of_its_vehicle_alone(name: str, mode: str) -> None:
    """Plant, mixer and rate loop of each are those of the vehicle that was drawn, with as many rotors as it has."""
    env, rng = environment(vehicle=name, command_mode=mode), np.random.default_rng(0)
    state, _ = env.reset(random_key(1), 5)
    action = rng.uniform(-1, 1, (3, 5, 4)).astype(np.float32)
    assert state.family is not None
    flown, drawn = state, [vehicle_of(u, name) for u in np.asarray(state.family)]
    together, apart = jax.jit(lambda state, a: env.step(state, a, restart=False)[0]), jax.jit(step)
    for a in action:
        flown = together(flown, jnp.asarray(a))
    for i, vehicle in enumerate(drawn):
        physics, alone = Physics.of(vehicle, mode), jax.tree.map(lambda x: x[i], state.vehicle)  # noqa: B023
        alone = dataclasses.replace(alone, rotor_speed=alone.rotor_speed[: vehicle.rotor_count])
        queue = [np.asarray(env.hover)] * 5
        for a in action[:, i]:
            queue = [a, *queue][:5]
            late = float(state.action_latency[i]) / env.control_period
            whole = max(int(np.ceil(late)) - 1, 0)
            before, after = (np.asarray(env.command(jnp.asarray(queue[k])[None]))[0] for k in (whole + 1, whole))
            switch = (late - whole) * env.control_period
            alone = apart(physics, physics.nominal, alone, after, previous=before, switch_time=switch)
        for name in ("position", "velocity", "quaternion", "body_rate", "rotor_speed"):
            wanted = np.asarray(getattr(alone, name))
            found = np.asarray(getattr(flown.vehicle, name))[i, : len(wanted)]
            np.testing.assert_allclose(found, wanted, rtol=2e-3, atol=2e-3)


def test_the_centre_of_mass_is_off_in_proportion_to_the_arm() -> None:
    env = environment(disturbance=DisturbanceConfig(centre_of_mass=0.01))
    state, _ = env.reset(random_key(0), 200)
    assert state.family is not None
    own = np.asarray(family().draw(np.asarray(state.family, np.float64)).rotor_position)
    share = np.abs(np.asarray(state.plant["rotor_position"]) - own) / np.abs(own)
    largest = 0.01 / np.abs(family().middle.rotor_position).max()
    assert share.max() <= largest * (1 + 1e-4)
    small, large = (share[rows].max() for rows in (own[:, 0, 1] > -0.04, own[:, 0, 1] < -0.15))
    assert min(small, large) > 0.9 * largest


def test_the_centre_of_mass_of_a_frame_is_off_in_proportion_to_its_size() -> None:
    env = environment(vehicle="multirotor", disturbance=DisturbanceConfig(centre_of_mass=0.01))
    state, _ = env.reset(random_key(0), 200)
    drawn = family("multirotor").draw(np.asarray(state.family, np.float64))
    off = np.asarray(state.plant["rotor_position"]) - drawn.rotor_position
    assert np.abs(off - off[:, :1]).max() < 1e-6
    share = np.abs(off[:, 0, :2]).max(1) / drawn.radius * family("multirotor").middle.radius
    assert 0.009 < share.max() <= 0.01 + 1e-5


def test_a_new_episode_has_another_vehicle_and_delay() -> None:
    config = presets.preset("hover", "bptt")
    task = dataclasses.replace(config.task, episode_s=0.1, hold_s=0.0)
    env = Env.of(task, config.reward, presets.EnvConfig(vehicle="any"))
    state, _ = env.reset(random_key(0), 8)
    first, after = state, jax.jit(lambda state: env.step(state, jnp.broadcast_to(env.hover, (8, 4)))[0])
    for _ in range(4):
        state = after(state)
    assert state.family is not None
    assert np.all(np.asarray(state.family) != np.asarray(first.family))
    assert np.all(np.asarray(state.action_latency) != np.asarray(first.action_latency))


def test_a_family_sees_by_the_cameras_of_one_vehicle() -> None:
    for task in (task for task, known in TASKS.items() if known.cameras and known.family):
        one, many = (presets.starting(task, "bptt", "robust", vehicle).env for vehicle in (None, "any"))
        assert many.cameras == one.cameras != ()
        assert many.wind == presets.BESIDE_FAMILY.wind
    assert presets.starting("land_visual", "bptt", "robust", "any").env.vehicle == "any"


def test_a_family_is_learned_by_the_stages_of_the_task_alone() -> None:
    for task in [task for task, known in TASKS.items() if known.family]:
        nominal, many = presets.preset(task, "bptt"), presets.starting(task, "bptt", "robust", "any")
        assert many.curriculum == nominal.curriculum, task
    assert presets.starting("race", "bptt", "robust").curriculum != presets.preset("race", "bptt").curriculum


def test_without_disturbances_vehicles_and_delays_are_drawn_still() -> None:
    config = parse(["hover", "--vehicle", "any"]).config
    env = Env.of(config.task, config.reward, config.env)
    assert env.is_disturbed
    calm = env.undisturbed()
    assert (calm.wind, calm.disturbance) == (0, DisturbanceConfig())
    state, _ = calm.reset(random_key(0), 50)
    assert np.ptp(np.asarray(state.action_latency)) > 0.08
    assert np.ptp(np.asarray(state.family)) > 0.9


def test_a_mode_whose_commands_differ_from_vehicle_to_vehicle_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"env.command_mode is 'rotor_thrust'; accepted for vehicle 'any': 'ctbr', 'rotor_share'"
    ):
        environment(command_mode="rotor_thrust")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"command_mode": "rotor_share"}, "'multirotor': 'ctbr', as each has its own number of rotors"),
        ({"lost_rotor": 0.5}, "env.lost_rotor is 0.5; accepted for vehicle 'multirotor': 0"),
        ({"randomize": {"rotor_spin": 0.1}}, "env.randomize.rotor_spin is 0.1; accepted for vehicle 'multirotor'"),
    ],
)  # fmt: skip
def test_frames_refuse_what_is_of_each_rotor(options: dict, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        environment(vehicle="multirotor", **options)


def test_a_task_without_a_recipe_for_families_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["train", "avoid", "--vehicle", "any"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--vehicle is any, a family; accepted by preset 'robust' for hover by bptt" in said


def test_hover_by_rotors_is_learned_with_a_memory_and_by_gradients(capsys: pytest.CaptureFixture[str]) -> None:
    config = parse(["hover", "--vehicle", "any", "--preset", "rotors"]).config
    assert (config.env.vehicle, config.env.command_mode, config.env.control_rate) == ("any", "rotor_share", 100.0)
    assert config.network.recurrent > 0
    assert run(["train", "hover", "--preset", "rotors", "--algo", "ppo"]) == 2
    assert "preset 'rotors': accepted for hover by bptt; not by ppo" in " ".join(capsys.readouterr().err.split())


def test_a_tumble_ends_a_hover() -> None:
    config = presets.preset("hover", "bptt")
    task = dataclasses.replace(config.task, spin=2.0, body_rate=3.0, episode_s=1.0)
    env = Env.of(task, config.reward)
    state, _ = env.reset(random_key(0), 64)
    fast = np.linalg.norm(np.asarray(state.vehicle.body_rate), axis=1)
    _, out = jax.jit(lambda state: env.step(state, jnp.broadcast_to(env.hover, (64, 4))))(state)
    assert np.asarray(out.terminated)[fast > 4.5].all()
    assert not np.asarray(out.terminated)[fast < 1.0].any()


@pytest.mark.whole
def test_an_episode_that_has_left_all_numbers_is_not_asked_about(trained: Path) -> None:
    policy = e2efly.load_policy(trained)
    seen = np.tile(level_and_still(policy.contract), (2, 1))
    seen[1] = np.nan
    action, _ = act_of(policy).act(jnp.asarray(seen), (), jnp.zeros((2, policy.contract.memory_size)))
    np.testing.assert_array_equal(action[0], action[1])


def test_the_contract_has_ranges_instead_of_a_hash(trained: Path) -> None:
    contract = e2efly.load_policy(trained).contract
    told = json.loads(contract.to_json())
    assert "vehicle_hash" not in told
    assert told["vehicle_ranges"]["mass"] == [0.025, 12.0]
    assert "rotors" not in told["vehicle_ranges"]
    assert contract.vehicle_ranges == family().ranges
    assert contract.latency_range_s == (0.0, 0.12)
    for change, said in (
        ({"vehicle_hash": "0" * 16}, "vehicle_hash is .* accepted: one of vehicle_hash and vehicle_ranges, not both"),
        ({"vehicle_ranges": told["vehicle_ranges"] | {"thrust_to_weight": [0.9, 2.0]}}, "thrust_to_weight is .* hover"),
        ({"vehicle_ranges": {"mass": [0.1, 1.0]}}, "missing key 'vehicle_ranges.arm'"),
    ):
        with pytest.raises(ValueError, match=said):
            Contract.from_json(json.dumps(told | change))


def test_any_vehicle_within_loads_and_others_are_named(trained: Path, tmp_path: Path) -> None:
    for name in ("vis_r", "vis_h", "crazyflie"):
        e2efly.load_policy(trained, vehicle=name)
    heavy = dataclasses.replace(load_vehicle("vis_r"), mass=13.0)
    with pytest.raises(ValueError, match=r"mass of vehicle 'vis_r' is 13 kg; accepted: 0.025 to 12 kg"):
        e2efly.load_policy(trained / "policy.onnx", vehicle=heavy)


def test_it_is_evaluated_on_drawn_vehicles_and_on_one(trained: Path) -> None:
    drawn = e2efly.evaluate(trained, 4)
    assert drawn.candidate.notes[0].startswith("Every episode flies another vehicle of any; the flight controller is")
    one = e2efly.evaluate(trained / "policy.onnx", 4, vehicle="crazyflie")
    assert one.candidate.flown.believed.mass == 0.027
    assert one.candidate.latency == 0.02
    (suite,) = one.candidate.task.criteria().values()
    np.testing.assert_allclose(one.candidate.environment(suite).latency_range, 0.02)
    with pytest.raises(ValueError, match="is left out; accepted with --stress: one vehicle within the ranges of any"):
        stress(trained, 4)


def test_plants_and_the_bridge_take_one_vehicle(
    trained: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ValueError, match="--vehicle is left out; accepted: one vehicle within the ranges of 'any'"):
        e2efly.validate(trained, "simulator", 1)
    found = e2efly.validate(trained, "simulator", 1, vehicle="vis_h")
    assert found.candidate.latency == 0.09
    assert [len(criterion.flights) for criterion in found.criteria.values()] == [1]
    slow = tmp_path / "slow.toml"
    slow.write_text(vehicle_file("vis_r").read_text().replace("value = 0.060\n", "value = 0.2\n"))
    for options, said in (
        ((), "--vehicle is left out; accepted: a name or .toml file, as the policy flies any vehicle within"),
        (("--vehicle", str(slow)), "latency of vehicle 'slow' is 0.2 s; accepted: 0 to 0.12 s"),
    ):
        assert run(["fly", str(trained), *options, "--link", "tcp:127.0.0.1:9"]) == 2
        assert said in " ".join(capsys.readouterr().err.split())
