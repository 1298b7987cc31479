"""A validation's flights in the viewer."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from e2efly.commands.cli import run
from e2efly.viewing.kept import flights_file, read_flights
from e2efly.viewing.watch.recorded import PERIOD, Recording
from e2efly.viewing.watch.report import read_report, report_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a report on the zoo's race in MuJoCo."""
    folder = tmp_path_factory.mktemp("validation")
    asked = ["--plant", "mujoco", "--episodes", "3", "--max-drop", "100", "--out", str(folder / "plots")]
    assert run(["validate", "race", *asked, "--json", str(folder / "report.json")]) == 0
    return folder


@pytest.mark.whole
def test_the_plant_is_followed_and_the_simulator_is_its_ghost(folder: Path) -> None:
    starts, vehicle = read_report(folder / "report.json")
    told = json.loads((folder / "report.json").read_text())["criteria"]["race"]["starts"]
    assert vehicle.name == "vis_r"
    assert {start.criterion for start in starts} == {"race"}
    assert len(starts) == 3
    source = Recording(starts[0].flights, vehicle, starts[0].stage)
    frames = [source.step(0) for _ in range(source.length)]
    number = int(starts[0].name.split()[1].rstrip(":"))
    np.testing.assert_allclose(frames[0].position, [told[number]["start"]["position"]] * 2, atol=1e-4)
    assert "on mujoco" in frames[0].note
    apart = np.array([np.linalg.norm(frame.position[0] - frame.position[1]) for frame in frames])
    assert 1e-4 < apart[: int(1 / PERIOD)].max() < 0.5  # two plants, the same policy
    assert np.linalg.norm(frames[-1].position[0] - frames[0].position[0]) > 1.0
    assert len(source.stage_of(0).bodies) == 4  # gates
    assert frames[0].rotor_speed.all()
    assert frames[30].goal is not None
    assert np.isfinite(frames[30].goal).all()


def test_failures_come_first_and_another_start_can_be_chosen(folder: Path) -> None:
    starts, vehicle = read_report(folder / "report.json")
    failed = [start.name.endswith("no success") for start in starts]
    assert failed == sorted(failed, reverse=True)
    source = Recording(starts[0].flights, vehicle, starts[0].stage)
    before = source.step(0)
    source.fly(starts[1].flights, starts[1].stage)
    after = source.step(0)
    assert after.fresh
    assert np.linalg.norm(after.position[0] - before.position[0]) > 1e-3


@pytest.mark.whole
def test_all_vehicles_of_a_world_are_shown(tmp_path: Path) -> None:
    asked = ["--plant", "mujoco", "--episodes", "4", "--max-drop", "100", "--out", str(tmp_path / "plots")]
    assert run(["validate", "race_duel", *asked, "--json", str(tmp_path / "report.json")]) == 0
    starts, _ = read_report(tmp_path / "report.json")
    assert [(start.together, len(start.flights)) for start in starts] == [(2, 4)] * 2
    for start in starts:
        first, second, *ghosts = (flight.position[0] for flight in start.flights)
        np.testing.assert_allclose(ghosts, [first, second], atol=1e-6)
        assert np.linalg.norm(first - second) > 0.5


def test_a_film_of_a_report(folder: Path) -> None:
    out = folder / "still.png"
    assert run(["watch", str(folder), "--video", str(out), "--seconds", "1"]) == 0
    assert out.read_bytes()[1:4] == b"PNG"


def test_a_folder_names_its_only_report(folder: Path, tmp_path: Path) -> None:
    assert report_of(folder) == folder / "report.json"
    assert report_of(tmp_path) is None
    for name in ("one", "two"):
        shutil.copy(folder / "report.json", tmp_path / f"{name}.json")
        shutil.copy(flights_file(folder / "report.json"), flights_file(tmp_path / f"{name}.json"))
    with pytest.raises(ValueError, match=r"holds the reports one\.json, two\.json; accepted: one of these files"):
        report_of(tmp_path)


def test_what_is_no_report_is_named(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report, flights = tmp_path / "report.json", tmp_path / "report.flights.npz"
    content = json.loads((folder / "report.json").read_text())

    def told(*options: str) -> str:
        assert run(["watch", str(report), "--port", "0", *options]) == 2
        return capsys.readouterr().err

    assert f"unknown policy '{report}'" in told()
    report.write_text("{")
    assert "report.json cannot be read" in told()
    report.write_text("{}")
    assert "report.json has no changed, controller, criteria, plant, policy, seed, vehicle; accepted: a rep" in told()
    report.write_text(json.dumps(content))
    assert "report.json has no flights: there is no" in told()
    flights.write_bytes(b"nothing")
    assert "report.flights.npz: " in told()
    shutil.copy(flights_file(folder / "report.json"), flights)
    assert "--criterion is 'x'; accepted: race" in told("--criterion", "x")
    assert "--vehicle is 'vis_h'; accepted: left out" in told("--vehicle", "vis_h")
    content["criteria"]["race"]["starts"][0]["start"]["position"][0] += 0.5
    report.write_text(json.dumps(content))
    assert "start 0 of race was at" in told()


def test_kept_flights_of_another_shape_are_refused(folder: Path, tmp_path: Path) -> None:
    with np.load(flights_file(folder / "report.json")) as content:
        arrays = dict(content)
    for name, value, said in (
        ("race/plant/position", arrays["race/plant/position"][:, :1], r"race/plant/position has shape"),
        ("race/training/length", arrays["race/training/length"] + 10_000, r"race/training/length is"),
    ):
        np.savez(tmp_path / "odd.npz", **{**arrays, name: value})
        with pytest.raises(ValueError, match=said):
            read_flights(tmp_path / "odd.npz")
