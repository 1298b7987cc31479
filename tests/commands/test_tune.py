"""`e2efly tune`: from a flight, or from logs, to a policy."""

import dataclasses
import json
import signal
from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.commands.fly import Fly
from e2efly.commands.identify import Identify
from e2efly.commands.tune import Tune
from e2efly.config.storage import held
from e2efly.logs.csv_file import write_csv
from e2efly.logs.telemetry import Telemetry
from e2efly.validation import firmware_program
from e2efly.validation.bridge_session import rehearsal_settings
from e2efly.validation.plant_excitation import Sensors, fly_excitation, sensed
from e2efly.validation.plants import find_plant
from e2efly.validation.stress import stress
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.posterior import load_posterior
from tests.validation.firmware_excitation import fly_excited

FILE = load_vehicle("vis_r")


@pytest.mark.whole
def test_a_log_becomes_a_policy_for_the_vehicle_that_it_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    # every row of the stress, from one batch of starts instead of four
    monkeypatch.setattr("e2efly.validation.stress.stress", lambda policy, _, **flies: stress(policy, 50, **flies))
    plant = find_plant("mujoco")(FILE)
    log, out = tmp_path / "flight.csv", tmp_path / "tuned"
    write_csv(sensed(fly_excitation(plant, FILE, 0.04, seconds=8.0), Sensors(), 0), log)
    asked = ["tune", str(log), "--task", "hover", "--mass", "0.75", "0.002", "--steps", "2000", "--out", str(out)]
    assert run(asked) == 0
    file = out / "identified" / "vehicle.toml"
    found = load_vehicle(file)
    assert np.isclose(found.latency, 0.04, atol=2e-3)
    policy = e2efly.load_policy(str(out / "policy.onnx"))
    assert policy.contract.vehicle_hash == found.hash
    robust = e2efly.preset("hover").env
    _, high = policy.contract.latency_range_s  # what the flights leave open of the delay, and what no flight shows
    margin = 2.5 * load_posterior(file).sigma["latency"] + robust.latency_spread[1]
    assert high - found.latency == pytest.approx(margin, abs=1e-4)
    config = json.loads((out / "run" / "config.json").read_text())
    assert config["env"]["randomize"] == {**robust.randomize, "identified": 1.0}
    # it began with the zoo's policy of any quadrotor, and means the same by its actions
    assert policy.contract.action.command_range == e2efly.load_policy("any/hover").contract.action.command_range
    alone = e2efly.evaluate(out / "policy.onnx", episodes=50, vehicle=str(file))  # it left its run's folder
    assert np.mean(alone.flown["hover"].success) > 0.9
    stressed = json.loads((out / "stress.json").read_text())
    assert set(stressed["stress"]) >= {"nominal", "mass x1.25", "mixer clips each rotor", "all at once"}
    assert stressed["untrained"] == {}
    assert run(asked) == 2  # nothing is lost: the run is there


def test_the_excitation_is_flown_by_the_options_of_fly_and_its_log_joins_the_sources(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flights, told = [], []

    def flown(options: Fly) -> int:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # as a flight takes it, for its landing
        flights.append(options)
        return 0

    def identified(options: Identify) -> int:
        told.append(options)
        raise ValueError("seen")

    monkeypatch.setattr("e2efly.commands.fly.run", flown)
    monkeypatch.setattr("e2efly.commands.identify.run", identified)
    before, out = signal.getsignal(signal.SIGINT), tmp_path / "tuned"
    link = ["--link", "tcp:host:5761", "--pose", "mocap:optitrack:host:body", "--guard", "filter"]
    room = ["--flight.fence.low", "-3", "-3", "0.2", "--excitation.seconds", "20"]
    for sources in ([], ["parts", "my.toml"], ["before.csv"]):
        assert run(["tune", *sources, *link, *room, "--vehicle", "vis_h", "--out", str(out)]) == 2
    assert signal.getsignal(signal.SIGINT) is before
    for flight in flights:
        assert (str(flight.policy), flight.vehicle) == ("excitation", "vis_h")
        assert (flight.link, flight.pose, flight.guard) == ("tcp:host:5761", "mocap:optitrack:host:body", "filter")
        assert flight.flight.fence.low == (-3.0, -3.0, 0.2)
        assert flight.excitation.seconds == 20.0
        assert flight.log.parent == out / "flights"
    own = [("flight", str(flight.log)) for flight in flights]
    assert [options.sources for options in told] == [
        own[0], ("parts", "my.toml", *own[1]), ("flight", "before.csv", *own[2])
    ]  # fmt: skip


def test_without_a_link_nothing_flies_and_sources_are_those_of_identify(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = []

    def identified(options: Identify) -> int:
        told.append(options.sources)
        raise ValueError("seen")

    monkeypatch.setattr("e2efly.commands.identify.run", identified)
    for sources in (["a.mcap", "b.mcap"], ["flight", "a.mcap", "stand", "s.csv"], ["a.mcap", "step", "b.mcap"]):
        assert run(["tune", *sources, "--out", str(tmp_path / "tuned")]) == 2
    assert told == [
        ("flight", "a.mcap", "b.mcap"),
        ("flight", "a.mcap", "stand", "s.csv"),
        ("flight", "a.mcap", "step", "b.mcap"),
    ]


@pytest.mark.whole
def test_the_flight_through_the_firmware_is_what_the_vehicle_is_identified_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The real bridge flies it in virtual time, on a body whose delay is not that of the file."""
    body = dataclasses.replace(FILE, latency=0.04)
    settings = rehearsal_settings(1.2)

    def flown(options: Fly) -> int:
        assert options.log is not None
        with Telemetry(options.log) as log:
            believed = load_vehicle(str(options.vehicle))
            assert fly_excited(
                firmware_program.chosen(), believed, body, settings, options=options.excitation, log=log
            ).complete
        return 0

    def trained(_: list[str]) -> None:
        raise ValueError("seen")

    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    monkeypatch.setattr("e2efly.commands.fly.run", flown)
    monkeypatch.setattr("e2efly.commands.train.parse", trained)
    out = tmp_path / "tuned"
    asked = ["tune", "--link", "tcp:here:5761", "--excitation.seconds", "10", "--mass", "0.75", "0.002"]
    assert run([*asked, "--out", str(out)]) == 2
    (log,) = (out / "flights").glob("*.mcap")
    found = json.loads((out / "identified" / "identified.json").read_text())["parameters"]["latency"]
    assert found["source"] == f"{log.name}; flight"
    assert abs(found["value"] - body.latency) < 3 * found["sigma"] < 0.03


def test_its_flight_has_the_defaults_of_fly() -> None:
    assert all(getattr(Tune, name) == getattr(Fly, name) for name in ("pose", "guard", "flight", "excitation"))


@pytest.mark.parametrize("asked", [["tune", "--task", "hover"], ["identify", "flight"]])
def test_two_writers_of_a_folder_are_not_let_in(
    asked: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command, *more = asked
    given = [*more, str(tmp_path / "flight.csv")] if command == "identify" else [str(tmp_path / "flight.csv"), *more]
    with held(tmp_path / "out"):
        assert run([command, *given, "--out", str(tmp_path / "out")]) == 2
    assert "out is in use by process" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["none.csv", "--task", "hoover"], "unknown task 'hoover'; did you mean 'hover'?"),
        (["none.csv", "--task", "hover", "--mass", "0", "1"], "--mass is 0.0 1.0; accepted: kg"),
        (["none.csv"], "none.csv' does not exist"),
        ([], "sources are missing; accepted: parts FILE"),
        (["none.csv", "stand", "--link", "tcp:host:5761"], "sources: stand has no file; accepted: stand FILE"),
    ],
)
def test_what_cannot_be_tuned_is_named(
    given: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["tune", *given, "--out", str(tmp_path / "out")]) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()
