"""`validate --stress`: the rows of `eval --stress` on other plants, from the same starts with the same draws."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.environment.stress_rows import ALL, ROWS, rows_for
from e2efly.validation.plant import EVERYTHING, Plant
from e2efly.validation.plant_stress import lacking, realities, stress
from e2efly.validation.plants import find_plant
from e2efly.validation.stress import Report, draws
from e2efly.validation.stress import stress as in_training
from e2efly.validation.stress_laws import LAWS
from e2efly.vehicles.loading import load_vehicle

EXAMPLE = Path(__file__).parents[2] / "examples" / "07_own_plant.py"
DRAWN_ALIKE = (
    "nominal", "mass x1.25", "thrust x0.8", "thrust x1.15", "inertia x1.5", "motor lag x2", "delay +20 ms", "drag x2",
    "rate loop x0.5", "thrust falls by 15 %", "one rotor 10 % weaker", "centre of mass 5 mm off", "wind 3 m/s",
    "mixer clips each rotor",
)  # fmt: skip
"""Rows without white noise or gusts, which either place draws anew in every step."""

BLIND = rows_for(())
"""Rows of policies without cameras."""


@pytest.fixture(scope="module")
def wanted(policy_of: Callable[..., Path]) -> Report:
    """What `eval --stress` says of the rows that are drawn alike."""
    return in_training(policy_of("hover"), 2, rows=DRAWN_ALIKE)


@pytest.mark.whole
@pytest.mark.parametrize(("plant", "close"), [("simulator", 0.004), ("mujoco", 0.01)])
def test_a_row_is_the_same_as_in_eval(plant: str, close: float, wanted: Report, policy_of: Callable[..., Path]) -> None:
    """Start by start: the same draw of the rotor that is weaker, of the wind's direction, of everything."""
    found = stress(policy_of("hover"), plant, 2, rows=DRAWN_ALIKE)
    assert list(found.flown) == list(DRAWN_ALIKE)
    errors = {}
    for row in DRAWN_ALIKE:
        ours, theirs = found.flown[row]["hover"], wanted.flown[row]["hover"]
        np.testing.assert_array_equal(ours.success, theirs.success, err_msg=row)
        np.testing.assert_allclose(ours.final_error, theirs.final_error, atol=close, err_msg=row)
        np.testing.assert_allclose(ours.mean_error, theirs.mean_error, atol=3 * close, err_msg=row)
        errors[row] = float(np.mean(ours.final_error))
    # they are no two names for one flight: what this controller without integral cannot hold, it does not
    for row in ("mass x1.25", "thrust x0.8", "thrust falls by 15 %", "wind 3 m/s", "centre of mass 5 mm off"):
        assert errors[row] > errors["nominal"] + 2 * close, row


def test_air_and_noise_are_as_strong_as_the_rows_say() -> None:
    vehicle, steps, period = load_vehicle("vis_r"), 600, 1 / 30
    met = {row: realities(draws(ROWS[row], vehicle, vehicle.latency, 1, 40), vehicle, 1, steps, period) for row in ROWS}
    for row, flights in met.items():
        still = ROWS[row].alters.isdisjoint({"wind", "rotor_share"})
        for flight in flights:
            assert flight.air is None or (row == ALL) or flight.air.disturbs != still, row
    air = {row: [flight.air for flight in flights if flight.air] for row, flights in met.items()}
    assert np.std([a.wind for a in air["gusts 1.5 m/s"]]) == pytest.approx(1.5, rel=0.1)
    np.testing.assert_allclose(np.linalg.norm(air["wind 3 m/s"][0].wind, axis=1), 3.0)
    fallen = air["thrust falls by 15 %"][0].rotor_share
    np.testing.assert_allclose(fallen[[0, steps // 2]].mean(1), [1.0, 0.925], atol=1e-6)
    weak = air["one rotor 10 % weaker"]
    assert {int(np.argmin(a.rotor_share[0])) for a in weak} == {0, 1, 2, 3}
    errors = np.array([a.error for a in air["noise of motion capture"]])
    for part, sigma in ((slice(0, 3), 0.005), (slice(3, 6), 0.05), (slice(6, 9), 0.0025), (slice(9, 12), 0.02)):
        assert np.std(errors[..., part]) == pytest.approx(sigma, rel=0.05)
    drift = np.array([a.error[:, 0:3] for a in air["noise and drift of a VIO"]])
    assert np.std(drift[:, -1]) == pytest.approx(np.hypot(0.005 * np.sqrt(steps * period), 0.02), rel=0.2)
    # the draws of few flights are those of the first of many
    few = realities(draws(ROWS[ALL], vehicle, vehicle.latency, 1, 3), vehicle, 1, steps, period)
    assert [flight.body.mass for flight in few] == [flight.body.mass for flight in met[ALL][:3]]


def test_every_row_says_what_it_changes_and_plants_what_they_can() -> None:
    rows = {name: ROWS[name].alters for name in BLIND}
    assert rows["nominal"] == rows["delay +20 ms"] == rows["noise of motion capture"] == frozenset()
    assert rows["drag x2"] == {"drag_linear", "drag_quadratic"}
    assert frozenset().union(*rows.values()) <= EVERYTHING
    assert rows[ALL] == frozenset().union(*rows.values()) - {"plain_mixer"}
    cannot = {name: {row for row in BLIND if lacking(find_plant(name), ROWS[row])} for name in ("simulator", "mujoco")}
    assert cannot == {"simulator": set(), "mujoco": set()}
    firmware = {row for row in BLIND if lacking(find_plant("betaflight"), ROWS[row])}
    assert firmware == {"rate loop x0.5", "rate loop x2", "mixer clips each rotor", ALL}


def test_the_command_reports_names_what_is_left_out_and_judges(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "report.json"
    asked = ["validate", "land", "--stress", "--plant", f"{EXAMPLE}:PointMass", "--episodes", "1", "--out"]
    assert run([*asked, str(tmp_path), "--json", str(report), "--least", "0.5"]) == 0
    said = json.loads(report.read_text())
    assert set(said["stress"]) | set(said["untrained"]) | set(said["left_out"]) == {*BLIND, *LAWS}
    assert "nominal" in said["stress"]
    between = {name for name, law in LAWS.items() if not law.alters}
    assert set(said["untrained"]) == between  # a mass point has what lies between plant and policy
    assert said["left_out"]["mass x1.25"] == "mass"
    assert said["plant"] == "point_mass"
    out = " ".join(capsys.readouterr().out.split())
    assert "Left out: mass x1.25; point_mass cannot change mass" in out
    assert "Left out: payload falls off; point_mass cannot change mass in flight" in out
    trained, untrained = out.split("Rows from laws that no training draws from")
    assert "delay +20 ms" in trained
    assert "poses held in bursts" in untrained.split("Left out")[0]
    assert (tmp_path / "point_mass_stress.png").stat().st_size > 10_000


def test_a_row_that_fails_is_told_by_the_exit_status(
    policy_of: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["validate", str(policy_of("hover")), "--stress", "--rows", "nominal", "thrust x0.8", "--episodes", "2"]
    assert run([*asked, "--out", str(tmp_path), "--least", "0.5"]) == 1
    out = " ".join(capsys.readouterr().out.split())
    assert "thrust x0.8: 0.0% success, 50.0% is asked for" in out


@pytest.mark.parametrize("command", ["eval", "validate"])
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--stress", "--rows", "mass x1.2"], "unknown stress 'mass x1.2'; did you mean 'mass x1.25'"),
        (["--rows", "nominal"], "--rows is ('nominal',); accepted with --stress"),
        (["--least", "0.9"], "--least is 0.9; accepted with --stress"),
        (
            ["--stress", "--rows", "images 40 ms older"],
            "--rows has 'images 40 ms older', but the policy sees nothing; accepted: 'nominal', 'mass x0.8'",
        ),
        (["--stress", "--least", "97"], "--least is 97.0; accepted: 0 to 1"),
        (["--stress", "--least", "nan"], "--least is nan; accepted: 0 to 1"),
        (["--stress", "--episodes", "0"], "--episodes is 0; accepted: more than 0"),
    ],
)
def test_bad_options_are_named_by_either_command(
    command: str, options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([command, "hover", *options]) == 2
    assert message in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--max-drop", "5"], "--max-drop is 5.0; accepted without --stress, which has --least"),
        (["--flights", "1"], "--flights is 1; accepted without --stress"),
        (
            ["--plant", "betaflight", "--rows", "rate loop x2"],
            "--rows has 'rate loop x2', but plant 'betaflight' cannot change rate_gain; accepted: 'nominal', 'mass",
        ),
    ],
)
def test_what_the_stress_on_a_plant_does_not_take_is_named(
    options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["validate", "hover", "--stress", *options]) == 2
    assert message in " ".join(capsys.readouterr().err.split())


def test_a_plant_that_promises_more_than_it_has_says_which_method() -> None:
    class Empty(Plant):
        """Of no physics."""

        name = "empty"

        @property
        def state(self) -> e2efly.RigidState:
            """Nowhere."""
            raise NotImplementedError

        def reset(self, state: e2efly.RigidState) -> None:
            """Does nothing."""

        def step(self, command: np.ndarray, dt: float) -> None:
            """Does nothing."""

    with pytest.raises(NotImplementedError, match="plant 'empty' has no method meet"):
        Empty().meet(load_vehicle("vis_r"))
    with pytest.raises(NotImplementedError, match="plant 'empty' has no method disturb"):
        Empty().disturb(np.zeros(3), np.ones(4))
