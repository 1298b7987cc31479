"""The preset for vehicles that are not the file's."""

import dataclasses
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.commands.train import parse
from e2efly.environment import Env
from e2efly.learning.setup import Setup
from e2efly.runs import presets
from e2efly.simulation.sensors.eyes import steady
from e2efly.tasks import TASKS
from e2efly.vehicles.loading import load_vehicle, vehicle_file

ROBUST = [name for name, task in TASKS.items() if task.robust and task.__module__.startswith("e2efly.")]


def test_the_tasks_that_have_it_change_the_vehicle_and_remember() -> None:
    names = (
        "avoid avoid_together dodge gap hall hover hover_aware land land_visual race race_clutter race_clutter_room "
        "race_speed track"
    )
    assert names.split() == ROBUST
    for task in ROBUST:
        nominal, robust = (e2efly.preset(task, TASKS[task].best, name) for name in ("nominal", "robust"))
        assert robust.network.recurrent > 0
        assert bool(nominal.network.recurrent) == bool(TASKS[task].cameras and task != "land_visual")
        drawn = presets.OTHERS
        assert dataclasses.replace(robust.env, cameras=()) == drawn
        for own, other in zip(nominal.env.cameras, robust.env.cameras, strict=True):
            assert steady(other) == own
            assert (other.latency, other.angle_spread, other.fov_spread) == ((0.0, 0.05), 0.06, 0.04)
        assert robust.task == nominal.task
        replaced = {"prog1", "near"} if task == "race" else set()  # by progress along the way, and the gates' middle
        assert robust.reward.weights.keys() >= nominal.reward.weights.keys() - replaced
    nominal, robust = (e2efly.preset("hover", "ppo", name) for name in ("nominal", "robust"))
    assert (robust.env, robust.reward) == (presets.OTHERS, nominal.reward)


@pytest.mark.parametrize(("task", "algo"), [("gap", "ppo"), ("race", "ppo")])
def test_others_are_refused_by_name(task: str, algo: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["train", task, "--algo", algo, "--preset", "robust"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert (
        "preset 'robust': accepted for avoid by bptt, avoid_together by bptt, dodge by bptt, gap by bptt, "
        "hall by bptt or dagger, hover by bptt or ppo, hover_aware by bptt, land by bptt, "
        "land_visual by bptt, race by bptt, race_clutter by bptt, race_clutter_room by bptt, "
        "race_speed by bptt, track by bptt or ppo" in said
    )
    assert f"not for {task} by {algo}" in said


def test_robust_is_what_a_task_is_learned_by_where_it_can_be(tmp_path: Path) -> None:
    wanted = {("hover", "bptt"): "robust", ("hover", "ppo"): "robust", ("race", "ppo"): "nominal",
              ("gap", "bptt"): "robust", ("gap", "ppo"): "nominal", ("avoid", "bptt"): "robust",
              ("avoid", "ppo"): "nominal"}  # fmt: skip
    for (task, algo), name in wanted.items():
        config = e2efly.preset(task, algo, name)
        assert e2efly.preset(task, algo) == config
        assert parse([task, "--algo", algo]).config == config
    assert parse(["hover"]).config == e2efly.preset("hover") == e2efly.preset("hover", "bptt", "robust")
    for algo in ("ppo", "bptt"):  # of several, the last counts, also for what the preset depends on
        assert parse(["hover", "--algo", "shac", f"--algo={algo}"]).config == e2efly.preset("hover", algo)


def test_who_starts_from_a_policy_learns_gently_whatever_flies() -> None:
    """The recipe for a family has a learning rate of its own."""
    for vehicle in ("vis_r", "any"):
        algo = presets.starting("hover", "bptt", "robust", vehicle, "any/hover").algo
        assert algo == parse(["hover", "--vehicle", vehicle, "--from", "any/hover"]).config.algo
        assert algo.learning_rate == algo.learning_rate_end


def test_options_change_what_the_preset_draws_and_take_it_out() -> None:
    robust = e2efly.preset("hover").env
    drawn = parse(["hover", "--env.randomize", "mass", "0.1", "inertia", "0", "--env.wind", "1"]).config.env
    assert drawn.randomize == {**{k: v for k, v in robust.randomize.items() if k != "inertia"}, "mass": 0.1}
    assert (drawn.wind, drawn.disturbance) == (1.0, robust.disturbance)


@pytest.mark.whole
def test_the_file_s_vehicle_flies_as_in_the_nominal_environment() -> None:
    """How a policy flies it, a run says: tests/learning/test_warm_start.py."""
    config = e2efly.preset("hover")
    setup = Setup.of(config)
    nominal = Env.of(config.task, config.reward)
    env = setup.nominal["hover"]
    assert set(setup.nominal) == set(setup.judges)
    assert (setup.env.vehicles, env.vehicles, nominal.vehicles) == ("random vehicles", *["vehicle of the file"] * 2)
    family = Setup.of(presets.for_vehicle(config, "any"))
    assert (family.env.vehicles, family.nominal["hover"].vehicles) == ("random vehicles", "random vehicles, still air")
    assert Setup.of(e2efly.preset("hover", "bptt", "nominal")).nominal == {}
    still = jnp.broadcast_to(nominal.hover, (50, 4))

    @jax.jit
    def reached(one: Env, key: jax.Array) -> jax.Array:
        state, _ = one.reset(key, 50)
        return jax.lax.fori_loop(0, 20, lambda _, state: one.step(state, still)[0], state).vehicle.position

    np.testing.assert_array_equal(reached(env, jax.random.key(0)), reached(nominal, jax.random.key(0)))


def test_a_weak_vehicle_draws_others_that_can_still_hover(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = vehicle_file("vis_r").read_text()
    weak, strong = tmp_path / "weak.toml", tmp_path / "strong.toml"
    weak.write_text(text.replace("value = 0.75\n", "value = 1.05\n", 1))
    strong.write_text(text)
    assert load_vehicle(str(weak)).thrust_to_weight < 2
    for file, share in ((weak, 0.85), (strong, 1.0)):
        env = parse(["hover", "--vehicle", str(file)]).config.env
        assert load_vehicle(str(file)).thrust_to_weight * env.weakest >= 1
        assert env.randomize["mass"] <= share * presets.OTHERS.randomize["mass"]
        assert env.randomize["inertia"] == presets.OTHERS.randomize["inertia"]
    assert parse(["hover", "--vehicle", str(strong)]).config.env.disturbance == presets.OTHERS.disturbance
    assert run(["train", "hover", "--env.disturbance.thrust", "0.5", "--out", str(tmp_path / "run")]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert (
        "thrust 0.5, rotor 0.1, sag 0.2, ceiling 0.1, push 0.1: the weakest vehicle of these cannot hover (thrust to "
        "weight 0.72" in said
    )
    assert "accepted: draws that leave at least 1" in said


def test_the_centre_of_mass_is_drawn_no_farther_off_than_the_rate_loop_can_hold() -> None:
    """At full thrust the offset turns a loop of half the gain faster than commanded, by at most the largest command."""
    for name, drawn in (("vis_r", 0.006), ("vis_h", 0.006), ("crazyflie", 0.00249)):
        vehicle, env = load_vehicle(name), presets.starting("race_speed", "bptt", "robust", name).env
        offset = env.disturbance.centre_of_mass
        turn = offset * 4 * vehicle.thrust_range[1] / (vehicle.inertia * 0.5 * vehicle.rate_gain)
        assert offset == pytest.approx(drawn, rel=0.01)
        assert np.all(turn[:2] <= vehicle.body_rate_max[:2] * (1 + 1e-9))
        mass = 0.2325 if name == "crazyflie" else presets.OTHERS.randomize["mass"]  # the weaker one draws less of it
        assert env.randomize == presets.OTHERS.randomize | {"mass": mass}
