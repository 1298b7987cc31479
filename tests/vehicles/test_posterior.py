"""The distribution that an identified vehicle's file describes, and episodes that are drawn from it."""

import dataclasses
import re
from pathlib import Path

import jax
import numpy as np
import pytest

import e2efly
from e2efly.alignment.estimates import Estimate
from e2efly.alignment.vehicle_file import write_vehicle
from e2efly.commands.cli import run
from e2efly.commands.train import parse
from e2efly.config import EnvConfig
from e2efly.environment.environment import Env
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.posterior import WIDEST, load_posterior

BASE = load_vehicle("vis_r")
NAMES = ["thrust_map", "inertia[0]", "motor_time_constant", "latency"]
TOGETHER = np.array([[1, 0.9, 0, 0], [0.9, 1, 0, 0], [0, 0, 1, -0.6], [0, 0, -0.6, 1]])
FOUND = {
    "thrust_map": Estimate("thrust_map", BASE.thrust_map, 0.04 * np.abs(BASE.thrust_map), "flight"),
    "inertia": Estimate("inertia", BASE.inertia, np.array([0.05, np.nan, np.nan]) * BASE.inertia, "flight"),
    "motor_time_constant": Estimate("motor_time_constant", np.array(0.04), np.array(0.002), "flight"),
    "latency": Estimate("latency", np.array(0.05), np.array(0.003), "flight"),
}


@pytest.fixture
def file(tmp_path: Path) -> str:
    write_vehicle(tmp_path / "mine.toml", "vis_r", BASE, FOUND, (NAMES, TOGETHER))
    return str(tmp_path / "mine.toml")


def draws(
    file: str, width: float = 1.0, beside: dict[str, float] | None = None, **options: object
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    config, drawn = e2efly.preset("hover", name="nominal"), {"identified": width, **(beside or {})}
    env = Env.of(config.task, config.reward, EnvConfig(file, randomize=drawn, **options))  # type: ignore[arg-type]
    state, _ = jax.jit(lambda env, key: env.reset(key, 20_000))(env, jax.random.key(0))
    return {name: np.asarray(value) for name, value in state.plant.items()}, np.asarray(state.action_latency)


def test_episodes_have_the_spread_and_the_correlations_of_the_file(file: str) -> None:
    plant, late = draws(file)
    thrust = np.log(plant["thrust_map"][:, 0] / BASE.thrust_map[0])
    for entry in (1, 2):  # one factor on the whole map, and on the largest thrust
        assert np.allclose(plant["thrust_map"][:, entry] / BASE.thrust_map[entry], np.exp(thrust), rtol=1e-4)
    assert np.allclose(plant["rotor_thrust_max"] / BASE.rotor_thrust_max, np.exp(thrust), rtol=1e-4)
    inertia = np.log(plant["inertia"] / BASE.inertia)
    assert np.allclose(inertia[:, 1:], 0, atol=1e-5)  # of which the file says nothing
    lag = np.log(plant["motor_time_constant"] / 0.04)
    found = np.stack([thrust, inertia[:, 0], lag, late - 0.05])
    # numbers beyond 2.5 standard deviations are drawn in, which takes 1 % of the spread
    assert np.allclose(found.std(1), np.array([0.04, 0.05, 0.05, 0.003]) * 0.993, rtol=0.03)
    assert np.allclose(np.corrcoef(found), TOGETHER, atol=0.03)
    assert np.abs(found.mean(1) / found.std(1)).max() < 0.03


def test_the_factor_widens_and_zero_is_the_file(file: str) -> None:
    one, three = (np.log(draws(file, width)[0]["thrust_map"][:, 0]).std() for width in (1.0, 3.0))
    assert three / one == pytest.approx(3, rel=0.01)
    config = e2efly.preset("hover", name="nominal")
    env = Env.of(config.task, config.reward, EnvConfig(file, randomize={"identified": 2.0}))
    assert env.is_disturbed
    assert not env.undisturbed().is_disturbed
    assert Env.of(config.task, config.reward, EnvConfig(file, randomize={"identified": 0.0})).posterior is None


def test_delays_stay_within_what_the_environment_keeps_of_actions(file: str) -> None:
    _, late = draws(file, latency_spread=(0.01, 0.02))
    low, high = 0.05 - 0.01 - WIDEST * 0.003, 0.05 + 0.02 + WIDEST * 0.003
    assert low - 1e-6 <= late.min() < 0.04
    assert 0.07 < late.max() <= high + 1e-6


def test_a_delay_that_may_be_none_is_not_drawn_longer_than_the_file_says(tmp_path: Path) -> None:
    late = {"latency": Estimate("latency", np.array(0.004), np.array(0.003), "flight")}
    write_vehicle(tmp_path / "a.toml", "vis_r", BASE, late)
    _, drawn = draws(str(tmp_path / "a.toml"))
    assert drawn.min() == 0
    assert drawn.mean() == pytest.approx(0.004, abs=3e-4)


def test_a_delay_that_is_asked_for_is_drawn_as_asked(file: str) -> None:
    plant, late = draws(file, action_latency=(0.08, 0.12))
    assert 0.08 <= late.min() < 0.081
    assert 0.119 < late.max() <= 0.12
    assert np.std(plant["thrust_map"][:, 0]) > 0


def test_a_mass_that_goes_with_the_thrust_leaves_their_ratio_exact(tmp_path: Path) -> None:
    together = {name: FOUND[name] for name in ("thrust_map",)} | {
        "mass": Estimate("mass", np.array(0.75), np.array(0.03), "scale")
    }
    matrix = np.array([[1, 0.999], [0.999, 1]])
    write_vehicle(tmp_path / "a.toml", "vis_r", BASE, together, (["thrust_map", "mass"], matrix))
    posterior = load_posterior(tmp_path / "a.toml")
    assert posterior.sigma == pytest.approx({"mass": 0.04, "thrust_map": 0.04}, rel=5e-3)  # sigma has three digits
    assert posterior.thrust_sigma < 0.002


def test_a_second_identification_keeps_what_it_does_not_touch(file: str, tmp_path: Path) -> None:
    weighed = {"mass": Estimate("mass", np.array(0.8), np.array(0.01), "scale")}
    again = tmp_path / "again.toml"
    write_vehicle(again, file, load_vehicle(file), weighed)
    before, after = load_posterior(file), load_posterior(again)
    order = [after.entries.index(entry) for entry in before.entries]
    assert np.allclose((after.root @ after.root.T)[np.ix_(order, order)], before.root @ before.root.T, rtol=1e-3)


def test_the_command_line_takes_it_with_and_without_a_factor(file: str) -> None:
    asked = ["race", "--vehicle", file, "--env.randomize", "identified"]
    config = parse(asked).config
    robust = e2efly.preset("race").env.randomize
    measured = {"inertia", "motor_time_constant"}  # what the preset draws, and the file knows better
    assert config.env.randomize == {k: v for k, v in robust.items() if k not in measured} | {"identified": 1.0}
    own = parse(["race", "--vehicle", file, "--env.randomize", "mass", "0.1", "--out", "identified"])
    assert (own.out, own.config.env.randomize["mass"]) == (Path("identified"), 0.1)
    assert parse([*asked, "2.5", "mass", "0.1"]).config.env.randomize["identified"] == 2.5
    preset = parse(["race", "--vehicle", file, "--preset", "identified"]).config.env
    assert preset.randomize == {**robust, "mass": 0.24, "identified": 1.0}  # the thrust may be 10 % lower, too
    assert preset.estimate == e2efly.preset("race").env.estimate


def test_other_draws_of_the_same_parameter_are_about_what_the_file_leaves_open(file: str) -> None:
    plant, _ = draws(file, beside={"motor_time_constant": 0.5, "mass": 0.2})
    alone, _ = draws(file)
    factor = plant["motor_time_constant"] / alone["motor_time_constant"]  # of the same 20 000 vehicles
    assert 0.5 <= factor.min() < 0.501 and 1.499 < factor.max() < 1.5001
    assert np.corrcoef(factor, alone["motor_time_constant"])[0, 1] == pytest.approx(0, abs=0.03)
    assert np.allclose(plant["inertia"], alone["inertia"])  # which nothing else draws
    assert np.ptp(plant["mass"] / 0.75) == pytest.approx(0.4, abs=1e-3)  # of which the file says nothing


def test_the_preset_leaves_every_vehicle_strong_enough_to_hover(file: str, tmp_path: Path) -> None:
    heavy = {
        "mass": Estimate("mass", np.array(1.1), np.array(0.001), "scale"),
        "thrust_map": dataclasses.replace(FOUND["thrust_map"], value=BASE.thrust_map),
    }
    write_vehicle(tmp_path / "heavy.toml", "vis_r", BASE, heavy)
    wide, narrow = (
        parse(["race", "--vehicle", str(path), "--preset", "identified"]).config.env
        for path in (file, tmp_path / "heavy.toml")
    )
    assert wide.randomize["mass"] == 0.24
    assert 0 < narrow.randomize["mass"] < 0.2
    weakest = load_vehicle(tmp_path / "heavy.toml").thrust_to_weight * narrow.weakest
    assert 1 <= weakest * (1 - WIDEST * 0.04) < 1.02  # with the widest draw of the thrust, too


BAD = {
    "of = [\"thrust_map\"": ("of = [\"thrust\"", r"correlation.of: 'thrust' is no parameter; accepted: names such as"),
    "\"inertia[0]\"": ("\"inertia\"", r"correlation.of: 'inertia' is no parameter"),
    "\"latency\"]": ("\"mass\"]", r"correlation.of names 'mass', which has no sigma"),
    "    [1.0, 0.9": ("    [1.0, 0.1", r"correlation.value is .*accepted: a symmetric, positive definite matrix of 4"),
    "    [0.0, 0.0, -0.6, 1.0],\n": ("", r"correlation.value is .*matrix of 4 rows"),
}  # fmt: skip


@pytest.mark.parametrize("wrong", BAD)
def test_a_table_of_correlations_that_makes_no_sense_is_named(file: str, wrong: str, tmp_path: Path) -> None:
    text = Path(file).read_text()
    assert wrong in text
    bad = tmp_path / "bad.toml"
    bad.write_text(text.replace(wrong, BAD[wrong][0], 1))
    with pytest.raises(ValueError, match=re.escape(str(bad)) + ".*" + BAD[wrong][1]):
        load_posterior(bad)


def test_what_has_no_sigma_or_one_that_is_too_wide_is_refused(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["train", "hover", "--preset", "identified", "--out", "never"]) == 2
    assert "has no sigma; accepted: a vehicle file whose entries have standard deviations" in said(capsys)
    assert run(["train", "hover", "--vehicle", file, "--env.randomize", "identified", "11", "--out", "never"]) == 2
    assert "env.randomize.identified is 11.0; accepted: 0 to 10 times the file's sigma" in said(capsys)
    vague = dataclasses.replace(FOUND["thrust_map"], sigma=0.8 * np.abs(BASE.thrust_map))
    path = Path(file).with_name("vague.toml")
    write_vehicle(path, "vis_r", BASE, {"thrust_map": vague})
    with pytest.raises(ValueError, match=r"thrust_map is 4.04e-07 with sigma 3.2e-07; accepted for a draw: .* 70 %"):
        load_posterior(path)


def said(capsys: pytest.CaptureFixture[str]) -> str:
    return " ".join(capsys.readouterr().err.split())


def test_what_another_vehicle_does_not_have_is_not_drawn(file: str, tmp_path: Path) -> None:
    """A policy's own file may tell of a slower fall of the rotors, and the vehicle that flies it may not."""
    down = {"motor_time_constant_down": Estimate("motor_time_constant_down", np.array(0.05), np.array(0.005), "flight")}
    write_vehicle(tmp_path / "down.toml", file, load_vehicle(file), down)
    posterior = load_posterior(tmp_path / "down.toml")
    deviation = posterior.deviation(np.ones((3, posterior.root.shape[1])))
    assert "motor_time_constant_down" in posterior.values(load_vehicle(tmp_path / "down.toml"), deviation)
    assert "motor_time_constant_down" not in posterior.values(BASE, deviation)
