"""A whole flight through the real firmware."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from e2efly.logs.flight_log import read_log
from e2efly.logs.telemetry import Telemetry
from e2efly.policy.loader import load_policy
from e2efly.tasks.route import usual_route
from e2efly.validation import firmware_program, rehearsal
from e2efly.validation.candidate import candidate
from e2efly.validation.gate_pose import GateCamera
from e2efly.validation.rehearsal import rehearse
from e2efly.validation.scenery import Scenery
from e2efly.vehicles.loading import load_vehicle


@pytest.mark.whole
def test_take_off_hover_policy_hover_land_by_switches_alone(policy_of: Callable[..., Path], tmp_path: Path) -> None:
    vehicle, policy = load_vehicle("vis_r"), load_policy(policy_of("hover"))
    with Telemetry(tmp_path / "flight.mcap") as log:
        flight = rehearse(firmware_program.chosen(), policy, vehicle, seed=3, log=log)
    assert flight.modes == ("init", "takeoff", "hover", "policy", "hover", "land", "done", "init")
    assert flight.complete
    assert flight.hover_error < 0.10
    assert flight.mean_error < 0.10
    assert flight.success
    assert flight.told == f"{100 * flight.mean_error:.1f} cm off"
    assert 0.5 < flight.top_speed < 6.0
    read = read_log(tmp_path / "flight.mcap")
    assert read.cut_off == ""
    assert tuple(m["mode"] for m in read["mode"].values) == flight.modes[1:]
    begins, ends = (read["mode"].stamp[i] / 1e9 for i in (2, 3))
    assert len(read["policy"]) == pytest.approx((ends - begins) * policy.contract.control_rate_hz, abs=2)


@pytest.mark.whole
def test_the_guard_ends_no_race_that_flies_high_enough() -> None:
    """Laps at full speed, on the track of a rehearsal without a route."""
    flight = rehearse(firmware_program.chosen(), load_policy("race"), load_vehicle("vis_r"), seed=3)
    assert flight.complete, flight.reasons
    assert flight.success
    assert flight.top_speed > 9.0


@pytest.mark.whole
def test_a_whole_race_is_flown_by_a_camera_and_the_firmwares_own_imu() -> None:
    """No motion capture: rendered gates, and what MSP tells of gyroscope and accelerometer."""
    flight = rehearse(firmware_program.chosen(), load_policy("race"), load_vehicle("vis_r"), seed=3, gates=GateCamera())
    assert flight.complete and flight.success, (flight.told, flight.reasons)
    assert flight.top_speed > 9.0


@pytest.mark.whole
def test_a_whole_race_is_flown_by_an_eye_and_an_imu_with_no_place_at_all() -> None:
    """Nobody tells where the vehicle is: take-off, the race, braking, and a landing that it feels. How often the laps
    are flown is for benchmarks/race_eyes.py.
    """
    policy = load_policy("race_eyes")
    asked = candidate("race_eyes", task={"track": ("circle_3d",), "laps": 3, "episode_s": 40.0})
    env = asked.environment(*asked.task.criteria().values())
    usual: Any = usual_route(policy.contract)
    route = dataclasses.replace(usual, outside=True, **(usual.whole | {"track": "circle_3d", "laps": 3}))
    flight = rehearse(
        firmware_program.chosen(), policy, load_vehicle("vis_r"), seed=5_000_000, route=route, placed=False,
        scenery=Scenery.draw(env, 5_000_000),
    )  # fmt: skip
    assert flight.modes == ("init", "takeoff", "hover", "policy", "hover", "land", "done", "init")
    assert flight.complete, (flight.told, flight.reasons)
    assert flight.top_speed > 6.0
    flown = flight.flown
    blind = [i for i in flown.where("land") if flown.position[i][2] > 0.1]
    assert np.linalg.norm(flown.velocity[blind[-1]]) < 2.0, "it arrives slowly"
    assert min(flown.tilt_cosine[i] for i in flown.where("land")) > 0.9, "and upright"


@pytest.mark.whole
@pytest.mark.parametrize(("vehicle", "task"), [("crazyflie", "hover"), ("crazyflie", "race"), ("vis_h", "race")])
def test_the_firmware_flies_the_smaller_vehicles_by_their_own_gains(vehicle: str, task: str) -> None:
    flight = rehearse(firmware_program.chosen(), load_policy(f"{vehicle}/{task}"), load_vehicle(vehicle), seed=3)
    assert flight.complete and flight.success, (flight.told, flight.reasons)


@pytest.mark.whole
def test_a_flight_that_touches_the_ground_before_its_landing_is_not_complete(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same flight is complete in the test before; here the ground counts as touched from 10 m on."""
    monkeypatch.setattr(rehearsal, "TOUCH", 10.0)
    flight = rehearse(firmware_program.chosen(), load_policy("vis_h/race"), load_vehicle("vis_h"), seed=3)
    assert flight.done and flight.success and not flight.complete
    assert flight.told.endswith(", touched the ground")
