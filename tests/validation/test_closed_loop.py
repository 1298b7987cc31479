"""A policy's flight is flown again by the simulator, from where the policy took over, as the log says."""

import dataclasses
import json
import time
from pathlib import Path

import numpy as np
import pytest

from e2efly.logs.flight_log import FlightLog, read_log
from e2efly.logs.recording import Record, Stream
from e2efly.logs.telemetry import Telemetry
from e2efly.policy.loader import load_policy
from e2efly.policy.runtime import Runtime
from e2efly.policy.zoo import policy_file
from e2efly.tasks.route import course_for, route_of
from e2efly.validation.closed_loop import closed_loop, policy_of
from e2efly.validation.plant import RigidState
from e2efly.validation.plants import find_plant
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.closed_loop_plot import plot_closed_loop
from tests.validation.alone import fly

FILE = load_vehicle("vis_r")
POLICY = policy_file("hover", "vis_r")
TARGET = (0.4, -0.3, 1.6)
BEGUN, LASTS, POSES = 2.0, 3.0, 0.03
"""When the policy took over, how long it flew, and how late the poses were, s."""


def flown(path: Path, **meta: object) -> tuple[FlightLog, Record]:
    """The log and the record of a flight of a vehicle with a quicker rate loop and less latency."""
    policy = load_policy(POLICY)
    route = route_of(policy.contract)(target=TARGET)  # type: ignore[call-arg]
    plant = find_plant("simulator").of(FILE, policy.contract)
    body = dataclasses.replace(FILE, rate_gain=FILE.rate_gain * 1.4, latency=0.045)
    plant.meet(body)
    start = RigidState(np.array([0.0, 0.2, 1.2]), np.array([0.1, 0.0, 0.0]), np.eye(4)[0], np.zeros(3))
    runtime = Runtime.of(policy, course_for(policy.contract, FILE, route), FILE, imu=True)
    told = fly(runtime, plant, start, LASTS, body.latency, sample=0.005)
    moments = BEGUN - POSES + np.array([s.time for s in told.samples])
    states = {
        name: Stream(moments, np.array([getattr(s.state, name) for s in told.samples]))
        for name in ("position", "velocity", "quaternion", "body_rate")
    }
    sent = Stream(BEGUN + told.time[:-1], told.command)
    settings = {"policy": str(POLICY), "goal": vars(route)} | meta
    with Telemetry(path) as log:
        start_s = time.monotonic()
        said = {"contract": policy.contract.to_json(), "settings": json.dumps(settings)}
        log.record("meta", start_s, {"vehicle": "vis_r", "versions": "{}", **said})
        for at, mode, previous in ((BEGUN, "policy", "hover"), (BEGUN + LASTS - POSES, "hover", "policy")):
            log.record("mode", start_s + at, {"mode": mode, "previous": previous, "reasons": []})
    return read_log(path), Record(path, {**states, "command": sent})


def test_the_right_vehicle_flies_as_the_flight_did_and_the_files_does_not(tmp_path: Path) -> None:
    log, record = flown(tmp_path / "flight.mcap")
    found = policy_of(log)
    assert found is not None and found[0] == POLICY
    body = dataclasses.replace(FILE, rate_gain=FILE.rate_gain * 1.4, latency=0.045)
    loop = closed_loop(log, record, *found, {"before": FILE, "aligned": body}, POSES)
    assert loop.begin == pytest.approx(BEGUN - POSES, abs=1e-3)
    assert loop.difference("aligned", "position") < 0.01 and loop.difference("aligned", "body_rate") < 0.05
    assert loop.difference("before", "body_rate") > 5 * loop.difference("aligned", "body_rate")
    assert np.linalg.norm(loop.simulated["aligned"].position[-1] - TARGET) < 0.15  # the goal that the log tells
    plot_closed_loop(tmp_path / "policy.png", loop)
    assert (tmp_path / "policy.png").stat().st_size > 10_000


def test_another_policy_and_a_policy_whose_file_is_gone_are_not_flown(tmp_path: Path) -> None:
    log, _ = flown(tmp_path / "flight.mcap", policy=str(tmp_path / "gone.onnx"))
    assert policy_of(log) is None
    found = policy_of(log, POLICY)
    assert found is not None and found[0] == POLICY
    assert policy_of(log, policy_file("track", "vis_r")) is None
