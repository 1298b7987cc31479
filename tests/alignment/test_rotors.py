"""Identification of a vehicle with six rotors: from its own log, and by name from nobody else's."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.checks import checked
from e2efly.alignment.found import Found
from e2efly.alignment.identification import identify
from e2efly.commands.cli import run
from e2efly.logs.csv_file import read_csv, write_csv
from e2efly.logs.recording import Record, Stream
from e2efly.validation.plant_excitation import Sensors, fly_excitation, sensed
from e2efly.validation.plants import find_plant
from e2efly.vehicles.loading import load_vehicle

FILE = load_vehicle("hexa")
FLOWN = dataclasses.replace(
    FILE,
    thrust_map=FILE.thrust_map * 0.9,
    inertia=FILE.inertia * np.array([1.2, 1.1, 0.95]),
    motor_time_constant=0.03,
    latency=0.045,
)


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Record:
    """By way of a CSV file."""
    plant = find_plant("mujoco")(FILE)  # type: ignore[call-arg]
    plant.meet(FLOWN)
    path = tmp_path_factory.mktemp("logs") / "hexa.csv"
    write_csv(sensed(fly_excitation(plant, FILE, FLOWN.latency, seconds=12.0), Sensors(), 0), path)
    return read_csv(path)


@pytest.fixture(scope="module")
def found(record: Record) -> Found:
    return identify(FILE, checked([record], FILE))


def without(record: Record, *names: str) -> Record:
    return dataclasses.replace(record, streams={k: s for k, s in record.streams.items() if k not in names})


def test_a_log_has_a_column_for_each_rotor(record: Record) -> None:
    header = record.path.read_text().splitlines()[0].split(",")
    assert [name for name in header if name[0] == "n"] == ["n1", "n2", "n3", "n4", "n5", "n6"]
    assert record.streams["rotor_speed"].values.shape[1] == 6


def test_the_hexacopter_is_found_from_its_rotor_speeds(found: Found) -> None:
    values = {e.name: (e.value, e.sigma) for e in found.estimates}
    for name, truth, share in (
        ("thrust_map", FLOWN.thrust_map[0], 0.01),
        ("inertia", FLOWN.inertia, 0.05),
        ("motor_time_constant", 0.03, 0.1),
        ("latency", 0.045, 0.03),
    ):
        value, sigma = (np.atleast_1d(x) for x in values[name])
        truth = np.atleast_1d(truth)
        value, sigma = value[: len(truth)], sigma[: len(truth)]
        assert np.all(np.abs(value / truth - 1) < share), name
        assert np.all(np.abs(value - truth) < 3.5 * sigma), name


def test_a_rate_loop_that_rotors_at_their_limits_hide_is_refused_by_name(found: Found) -> None:
    refused = [str(refusal) for refusal in found.refusals if refusal.limited]
    assert any(said.startswith("rate_gain_x is not taken from the flights: ") for said in refused)
    assert all("% of them are with a rotor near its limits" in said for said in refused)
    assert not {e.name for e in found.estimates} & {"rate_gain", "gyro_time_constant", "rate_integral_gain"}


@pytest.mark.whole
def test_the_hexacopter_is_found_from_its_commands(record: Record) -> None:
    bare = identify(FILE, checked([without(record, "rotor_speed")], FILE, hovers=True))
    values = {e.name: e.value for e in bare.estimates}
    assert values["thrust_map"][0] == pytest.approx(FLOWN.thrust_map[0], rel=0.05)
    assert values["inertia"][:2] == pytest.approx(FLOWN.inertia[:2], rel=0.25)


def test_another_number_of_rotors_is_refused_by_name(record: Record) -> None:
    with pytest.raises(ValueError, match=r"rotor_speed is of 6 rotors; accepted: 4, as vehicle 'vis_r' has"):
        checked([record], load_vehicle("vis_r"))
    lacking = record.path.with_name("lacking.csv")
    lacking.write_text(record.path.read_text().replace("n5", "other", 1))
    with pytest.raises(ValueError, match=r"has the column n1 but not n5; accepted: n1, n2, n3, n4, n5, n6"):
        read_csv(lacking)


def test_swapped_rotors_are_told_with_the_order_that_fits(record: Record) -> None:
    speeds = record.streams["rotor_speed"]
    order = [4, 1, 2, 3, 0, 5]
    swapped = {**record.streams, "rotor_speed": Stream(speeds.time, speeds.values[:, order])}
    with pytest.raises(ValueError, match=r"in the order n5, n2, n3, n4, n1, n6; accepted: the order of its file"):
        checked([dataclasses.replace(record, streams=swapped)], FILE)


def test_tilted_rotors_are_refused_by_name(record: Record, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    axes = "".join("  [0.0, 0.0, 1.0],\n" for _ in range(6))
    tilted = tmp_path / "tilted.toml"
    text = (Path(__file__).parents[2] / "src/e2efly/vehicles/hexa.toml").read_text()
    tilted.write_text(f'{text}\n[rotor_axis]\nvalue = [\n{axes}]\nunit = "1"\nsource = "none"\n')
    assert run(["identify", "flight", str(record.path), "--vehicle", str(tilted), "--out", str(tmp_path / "out")]) == 2
    assert "vehicle 'tilted' has tilted rotors; accepted by identify: level rotors" in capsys.readouterr().err
