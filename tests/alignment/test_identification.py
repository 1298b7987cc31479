"""Vehicles that MuJoCo flies, an engine of its own, are found from the logs of their sensors."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.correlation import OVER_MASS, correlation
from e2efly.alignment.estimates import Estimate
from e2efly.alignment.found import Found
from e2efly.alignment.identification import identify
from e2efly.alignment.vehicle_file import merged
from e2efly.logs.csv_file import write_csv
from e2efly.logs.recording import Record
from e2efly.validation.plant_excitation import Sensors, fly_excitation, sensed
from e2efly.validation.plants import find_plant
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle
from tests.alignment.flights import FILE, PERFECT, flown

BODY = dataclasses.replace(
    FILE,
    mass=0.9,
    inertia=FILE.inertia * [1.2, 0.9, 1.15],
    thrust_map=FILE.thrust_map * 0.92,
    motor_time_constant=0.045,
    drag_linear=FILE.drag_linear * 1.4,
    drag_quadratic=FILE.drag_quadratic * 1.4,
    rate_gain=FILE.rate_gain * [1.15, 0.9, 1.1],
    latency=0.043,
)


@pytest.fixture(scope="module")
def record() -> Record:
    return flown(BODY, 10.0, sag=0.04)


@pytest.fixture(scope="module")
def found(record: Record) -> Found:
    return identify(dataclasses.replace(FILE, mass=BODY.mass), [record], believed=FILE)


@pytest.mark.whole
def test_the_vehicle_is_found_within_the_bounds(found: Found) -> None:
    """Thrust over mass 1 %, lag and delay 2 ms, inertia over torque 3 %, drag 10 %."""
    vehicle = merged(dataclasses.replace(FILE, mass=BODY.mass), {e.name: e for e in found.estimates})
    assert np.allclose(vehicle.thrust_map[0], BODY.thrust_map[0], rtol=0.01)
    assert abs(vehicle.motor_time_constant - BODY.motor_time_constant) < 2e-3
    assert abs(vehicle.latency - BODY.latency) < 2e-3
    assert np.allclose(vehicle.inertia, BODY.inertia, rtol=0.03)
    assert np.allclose(vehicle.rate_gain, BODY.rate_gain, rtol=0.05)
    drag = vehicle.drag_linear * 5 + vehicle.drag_quadratic * 25
    assert np.allclose(drag[:2], (BODY.drag_linear * 5 + BODY.drag_quadratic * 25)[:2], rtol=0.1)


STRUCTURE = dataclasses.replace(
    BODY,
    motor_time_constant_down=0.062,
    rate_integral_gain=np.array([60.0, 50.0, 20.0]),
    gyro_time_constant=0.004,
    centre_of_mass=np.array([0.004, -0.003, 0.0]),
    inertia_products=np.array([8e-5, -5e-5, 6e-5]),
)
"""A body with what the file has no word for."""


@pytest.fixture(scope="module")
def odd() -> Record:
    plant = find_plant("mujoco")(FILE)  # its rate loop is the body's
    plant.meet(STRUCTURE)
    return sensed(fly_excitation(plant, FILE, STRUCTURE.latency, seconds=10.0), Sensors(), 4)


def test_structure_that_the_file_does_not_have_is_found_from_rotor_speeds(odd: Record) -> None:
    found = identify(dataclasses.replace(FILE, mass=BODY.mass), [odd], believed=FILE)
    values = {e.name: e for e in found.estimates}
    for name, off in (
        ("motor_time_constant", 1e-3), ("motor_time_constant_down", 1e-3), ("latency", 1e-3),
        ("gyro_time_constant", 1e-3), ("centre_of_mass", 5e-4), ("inertia_products", 2e-5), ("rate_integral_gain", 9.0),
    ):  # fmt: skip
        assert np.allclose(values[name].value, getattr(STRUCTURE, name), rtol=0, atol=off), name
    assert np.allclose(values["rate_gain"].value, STRUCTURE.rate_gain, rtol=0.05)
    assert np.allclose(values["inertia"].value, STRUCTURE.inertia, rtol=0.03)
    assert not any(each.alarming for each in found.misfits)
    names, matrix = correlation([found], {e.name: e for e in found.estimates}, 0.0)
    assert {"motor_time_constant_down", "centre_of_mass[0]", "inertia_products[2]", "rate_gain[0]"} <= set(names)
    assert np.linalg.eigvalsh(matrix).min() > 0


def test_structure_that_a_fit_does_not_have_rings_the_alarm_and_widens_every_sigma(odd: Record) -> None:
    weighed = dataclasses.replace(FILE, mass=BODY.mass)
    plain = identify(weighed, [odd], believed=FILE, plain=True)
    alarms = [each for each in plain.misfits if each.alarming]
    assert alarms
    assert "unexplained" in str(alarms[0])
    whole = identify(weighed, [odd], believed=FILE)
    assert plain.response is not None
    assert whole.response is not None
    assert plain.response.sigma[0] > 3 * whole.response.sigma[0]


def test_biases_and_sag_are_told_apart_from_the_vehicle(found: Found) -> None:
    (q,) = found.fit.q
    assert abs(q[9] - 0.04) < 0.01
    assert 0.01 < found.fit.noise["velocity"] < 0.03


def test_what_is_found_over_the_mass_goes_with_it(found: Found) -> None:
    """A scale that is 3 % off moves thrust and inertia by 3 %, together; lag and delay keep the fit's correlation."""
    off = 0.03
    said = [
        dataclasses.replace(e, sigma=np.hypot(e.sigma, off * e.value)) if e.name in OVER_MASS else e
        for e in found.estimates
    ]
    mass = Estimate("mass", np.array(BODY.mass), np.array(off * BODY.mass), "scale")
    names, matrix = correlation([found], {e.name: e for e in [*said, mass]}, off)
    at = {name: i for i, name in enumerate(names)}
    assert matrix[at["mass"], at["thrust_map"]] > 0.95
    assert matrix[at["thrust_map"], at["inertia[0]"]] > 0.95
    assert matrix[at["mass"], at["latency"]] == 0
    assert found.response is not None
    own = found.response.covariance
    i, j = ([u.name for u in found.response.unknowns].index(name) for name in ("motor_time_constant", "latency"))
    assert np.isclose(matrix[at["motor_time_constant"], at["latency"]], own[i, j] / np.sqrt(own[i, i] * own[j, j]))
    assert np.linalg.eigvalsh(matrix).min() > 0
    exact = {e.name: e for e in [*said, mass]} | {
        "inertia": Estimate("inertia", BODY.inertia, 1e-4 * BODY.inertia, "pendulum and flight")
    }
    names, matrix = correlation([found], exact, off)
    assert abs(matrix[names.index("inertia[0]"), names.index("mass")]) < 0.01  # the pendulum did not weigh it


@pytest.mark.whole
def test_drag_that_the_file_does_not_have_is_found_or_named() -> None:
    """MuJoCo's body has a quadratic drag; the file has none."""
    record = flown(BODY, 24.0)  # lines there and back, which tell drag from wind
    bare = dataclasses.replace(
        FILE, mass=BODY.mass, drag_linear=0 * FILE.drag_linear, drag_quadratic=0 * BODY.drag_linear
    )
    found = identify(bare, [record], believed=FILE)
    vehicle = merged(bare, {e.name: e for e in found.estimates})
    drag = vehicle.drag_linear * 4 + vehicle.drag_quadratic * 16
    assert np.allclose(drag[:2], (BODY.drag_linear * 4 + BODY.drag_quadratic * 16)[:2], rtol=0.15)
    told = {r.unknown.name: str(r) for r in found.refusals}
    for i, axis in enumerate("xyz"):
        for name in ("drag_linear", "drag_quadratic"):
            left = f"{name}_{axis}" in told
            assert left == (getattr(vehicle, name)[i] == 0)
            assert (
                not left
                or f"{name}_{axis} stays 0, as in the file: the flights show it to +- " in told[f"{name}_{axis}"]
            )
    names, matrix = correlation([found], {e.name: e for e in found.estimates}, 0.0)
    assert np.linalg.eigvalsh(matrix).min() > 0 and np.all(np.abs(matrix) < 1 + 1e-9)


@pytest.mark.whole
def test_flights_that_disagree_widen_sigma() -> None:
    """Two bodies whose inertia differs by a sixth: what one flight shows does not hold for the other."""
    bodies = [dataclasses.replace(BODY, inertia=BODY.inertia * [k, 1, 1]) for k in (0.92, 1.08)]
    found = identify(FILE, [flown(body, 6.0, seed=i) for i, body in enumerate(bodies)], believed=FILE)
    at = [u.name for u in found.model.unknowns].index("inertia_x")
    assert found.sigma[at] > 0.04 > 2 * np.sqrt(found.fit.assumed[at, at])


@pytest.mark.whole
def test_without_rotor_speeds_the_inertia_is_less_sure(record: Record, found: Found) -> None:
    """By commands alone, inertia and rate gain show mostly by their product."""
    streams = {k: s for k, s in record.streams.items() if k != "rotor_speed"}
    bare = identify(FILE, [dataclasses.replace(record, streams=streams)], believed=FILE)
    less, more = ([u.name for u in each.model.unknowns].index("inertia_x") for each in (bare, found))
    assert bare.sigma[less] > 5 * found.sigma[more]
    latency = next(e for e in bare.estimates if e.name == "latency")
    assert abs(float(latency.value) - BODY.latency) < 2e-3
    thrust = next(e for e in bare.estimates if e.name == "thrust_map")
    ratio = BODY.thrust_map[0] / BODY.mass * FILE.mass  # over mass, as nobody weighed it
    assert np.isclose(thrust.value[0], ratio, rtol=0.01)


@pytest.mark.whole
def test_motor_outputs_give_the_motors_lag_and_the_thrust(record: Record) -> None:
    """Outputs of which the rotor speed is a fifth by their root, which the fit does not know at first."""
    curve = 0.2
    plain = find_plant("mujoco")(FILE)
    plain.meet(BODY)
    exact = fly_excitation(plain, FILE, 0.0, seconds=10.0)
    speed = exact.streams["rotor_speed"].values
    # the speed that was asked for, from the one that was reached by a first-order lag
    asked = speed + BODY.motor_time_constant * np.gradient(speed, exact.streams["rotor_speed"].time, axis=0)
    share = np.clip(asked / FILE.full_rotor_speed, 0.0, 1.0)
    output = ((np.sqrt(curve**2 + 4 * (1 - curve) * share) - curve) / (2 * (1 - curve))) ** 2
    streams = {k: s for k, s in sensed(exact, Sensors(), 3).streams.items() if k not in ("rotor_speed", "command")}
    streams["motor"] = dataclasses.replace(exact.streams["rotor_speed"], values=output)
    found = identify(dataclasses.replace(FILE, mass=BODY.mass), [dataclasses.replace(record, streams=streams)])
    vehicle = merged(FILE, {e.name: e for e in found.estimates})
    assert found.model.driver == "motor"
    assert np.isclose(vehicle.thrust_map[0], BODY.thrust_map[0], rtol=0.03)
    names = [u.name for u in found.model.unknowns]
    late = FILE.latency + float(found.fit.p[names.index("latency")])
    assert abs(vehicle.motor_time_constant + late - BODY.motor_time_constant) < 5e-3
    assert "latency" not in {e.name for e in found.estimates}  # how late motors hear is not how late a vehicle is
    assert np.allclose(vehicle.inertia[:2], BODY.inertia[:2], rtol=0.1)
    off = found.sigma[[u.name for u in found.model.unknowns].index("motor_time_constant")]
    assert "without delay" in found.structures and off > 0.01


@pytest.mark.whole
def test_slow_motor_outputs_give_thrust_while_the_measured_rates_turn_the_vehicle(record: Record) -> None:
    rotors = record.streams["rotor_speed"]
    share = np.clip(FILE.thrust_map[0] * rotors.values**2 / FILE.thrust_range[1], 0.0, 1.0)
    output = np.sqrt(0.25 + 2 * share) - 0.5
    streams = {k: s for k, s in record.streams.items() if k not in ("rotor_speed", "command")}
    streams["motor"] = dataclasses.replace(rotors, time=rotors.time[::3], values=output[::3])
    found = identify(dataclasses.replace(FILE, mass=BODY.mass), [dataclasses.replace(record, streams=streams)])
    assert found.model.driver == "motor_and_rate"
    assert not {"inertia", "torque_ratio"} & {e.name for e in found.estimates}
    thrust = next(e for e in found.estimates if e.name == "thrust_map")
    assert np.isclose(thrust.value[0], BODY.thrust_map[0], rtol=0.05)


@pytest.mark.whole
def test_poses_are_not_younger_because_slow_telemetry_is_late(record: Record) -> None:
    rotors, command = record.streams["rotor_speed"], record.streams["command"]
    late, link, age = 0.012, 0.02, 0.04  # of what the flight controller tells; of the commands; of the poses
    seen = {
        name: dataclasses.replace(s, time=s.time + late) if name in ("body_rate", "specific_force") else s
        for name, s in record.streams.items()
        if name != "rotor_speed"
    }
    share = np.clip(FILE.thrust_map[0] * rotors.values**2 / FILE.thrust_range[1], 0.0, 1.0)
    motor = dataclasses.replace(rotors, time=rotors.time[::3] + late, values=(np.sqrt(0.25 + 2 * share) - 0.5)[::3])
    times = np.arange(command.time[0] + 0.2, command.time[-1] - 0.2, 0.0173)
    asked = command.values[np.searchsorted(command.time, times - link, side="right") - 1, 1:]
    streams = seen | {"motor": motor, "setpoint": dataclasses.replace(rotors, time=times, values=asked)}
    told = dataclasses.replace(record, streams=streams, pose_age=age)
    found = identify(dataclasses.replace(FILE, mass=BODY.mass), [told])
    assert found.model.driver == "motor_and_rate"
    latency = next(e for e in found.estimates if e.name == "latency")
    assert abs(float(latency.value) - (link + age)) < 0.004 < 1.645 * float(latency.sigma)


@pytest.mark.whole
def test_hover_does_not_give_the_inertia() -> None:
    plant = find_plant("mujoco")(FILE)
    record = sensed(fly_excitation(plant, FILE, 0.05, seconds=6.0, speed=0.0, pulses=False), Sensors(), 1)
    refused = {r.unknown.name: str(r) for r in identify(FILE, [record]).refusals}
    assert {"inertia_x", "inertia_y", "inertia_z"} <= set(refused)
    assert "fly: doublets of body rate about this axis" in refused["inertia_x"]


@pytest.mark.whole
def test_a_log_of_steps_gives_delay_and_rate_loop_alone(record: Record) -> None:
    found = identify(BODY, [record], believed=FILE, step=True)
    assert {e.name for e in found.estimates} == {"latency", "rate_gain"}
    values = {e.name: e.value for e in found.estimates}
    assert abs(float(values["latency"]) - BODY.latency) < 4e-3


def test_logs_without_what_is_needed_are_refused_by_name(tmp_path: Path) -> None:
    record = flown(BODY, 1.6, PERFECT)
    bare = dataclasses.replace(record, streams={"body_rate": record.streams["body_rate"]})
    with pytest.raises(ValueError, match="has the streams body_rate; accepted: command or rotor_speed or motor"):
        identify(FILE, [bare])
    gone = {k: s for k, s in record.streams.items() if k != "body_rate"}
    with pytest.raises(ValueError, match="has no body_rate"):
        identify(FILE, [dataclasses.replace(record, streams=gone)])
    with pytest.raises(ValueError, match=r"accepted: 1\.5 s or more"):
        identify(FILE, [record])


@pytest.mark.whole
def test_the_command_writes_a_vehicle_that_loads_and_says_what_it_did(
    tmp_path: Path, record: Record, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    from e2efly.commands.cli import run
    from e2efly.vehicles.loading import read_sigmas

    write_csv(record, tmp_path / "log.csv")
    out = tmp_path / "mine"
    words = ["identify", "flight", str(tmp_path / "log.csv"), "--vehicle", "vis_r", "--mass", "0.9", "0.001"]
    assert run([*words, "--out", str(out)]) == 0
    vehicle: Vehicle = load_vehicle(out / "vehicle.toml")
    assert np.isclose(vehicle.mass, 0.9)
    assert np.allclose(vehicle.inertia, BODY.inertia, rtol=0.03)
    sigma = read_sigmas(out / "vehicle.toml")
    assert 0 < sigma["inertia"][0] < 0.1 * vehicle.inertia[0]
    assert np.isnan(sigma["radius"])
    assert {p.name for p in out.iterdir()} >= {
        "vehicle.toml", "identified.json", "parameters.png", "flight_prediction.png", "flight_fit.png",
        "posterior.png",
    }  # fmt: skip
    assert "thrust_map[0]" in capsys.readouterr().out
    bad = ["identify", "flight", str(tmp_path / "gone.csv"), "--out", str(tmp_path / "none")]
    assert run(bad) == 2
    assert not (tmp_path / "none").exists()
