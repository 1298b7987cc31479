"""The excitation flight, or one of steps, through the real firmware, on a body that differs from the bridge's
vehicle.
"""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.flight.betaflight.autopilot import EXCITATION_SCHEDULE
from e2efly.flight.excitation import ExcitationOptions, InPlace, excitation
from e2efly.flight.log_record import Log
from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.flight.pilot.hover import rates_of
from e2efly.flight.pose.pose_source import PlantSource
from e2efly.flight.settings import FlightSettings
from e2efly.logs.recording import Record, Stream
from e2efly.policy.odometry import Sample
from e2efly.validation.bridge_session import FlownSession, Session
from e2efly.validation.firmware_program import Firmware
from e2efly.validation.rehearsal import LINK_S
from e2efly.validation.rig import BLACKBOX, Rig
from e2efly.validation.sitl import FirmwareState
from e2efly.vehicles.vehicle import Vehicle

STEP_S = 0.001
"""Interval at which sensors are updated and motors are read, s. The motor outputs react at once to each new gyroscope
sample and then decay. With an interval of 2 ms they are therefore 6 to 8 % larger than the effect of the outputs that
the rig holds."""


@dataclass(frozen=True)
class Excited:
    """The result of the flight."""

    flown: FlownSession
    """The record of the whole flight."""
    complete: bool
    """Whether it took off, had its whole time, hovered, landed and was disarmed."""
    truth: Record
    """Body rates, and commands as they were sent, on the rig's own clock, with the mean age of the poses."""
    blackbox: Path | None
    """The firmware's own log, if it was requested."""


def fly_excited(
    firmware: Firmware,
    believed: Vehicle,
    body: Vehicle,
    settings: FlightSettings,
    *,
    options: InPlace | None = None,
    log: Log | None = None,
    folder: Path | None = None,
    blackbox: bool = False,
    sag: float = 0.0,
    seed: int = 0,
) -> Excited:
    """Take off, fly the excitation, hover and land. The delay of the poses follows from the latency of the body.

    `sag` is the share of the thrust that is lost by the end of the excitation, at a constant rate. `folder` gets the
    files of the firmware and, with `blackbox`, its own log. If left out, it is a temporary one.

    Raises:
        ValueError: for a fence that is too small.
    """
    options = options or ExcitationOptions()
    acts, course = excitation(believed, settings, options)
    late = max(float(body.latency) - LINK_S, 0.0)
    with tempfile.TemporaryDirectory(prefix="e2efly-") as temporary:
        there = folder or Path(temporary)
        rig = Rig(
            firmware, there, believed, latency=late, seed=seed, step=STEP_S, settings=BLACKBOX if blackbox else ()
        )
        with rig:
            rig.sleep(0.5)
            ages: list[float] = []
            rates: list[tuple[float, np.ndarray]] = []
            commands: list[tuple[float, ...]] = []
            newest = 0.0

            def felt(state: FirmwareState) -> FirmwareState:
                rates.append((rig.now() + STEP_S, state.body_rate))  # for the step that begins now
                return state

            rig.felt = felt

            def poses(now: float) -> Sequence[Sample]:
                nonlocal newest
                found = rig.poses(now)
                newest = found[-1].stamp or newest if found else newest
                ages.append(now - newest)
                return found

            session = Session(
                rig, settings, policy=acts, course=course, log=log, source=PlantSource(poses, "rig"),
                autopilot=rig.autopilot(settings, schedule=EXCITATION_SCHEDULE),
            )  # fmt: skip
            rig.carry(body)
            try:
                done = session.take_off(3.0)
                rig.set(mission="policy")
                done &= session.fly(0.5, session.in_mode(Mode.POLICY))
                begun, bridge = rig.now(), session.bridge
                while done and bridge.flight.mode is Mode.POLICY:
                    rig.thrust_shares = np.full(4, 1 - sag * (rig.now() - begun) / acts.schedule.seconds)
                    session.step()
                    if (sent := bridge.sent.command) is not None:
                        commands.append((rig.now(), float(sent.thrust), *rates_of(sent)))
                done &= Reason.POLICY_DONE in bridge.flight.reasons
                rig.set(mission="hover")
                session.fly(1.0)
                done &= session.land()
            finally:
                session.close()
        written = sorted(there.glob("LOG*.BF*")) if blackbox else []
        sent_at = np.array(commands).reshape(-1, 5)
        streams = {
            "body_rate": Stream(np.array([t for t, _ in rates]), np.array([w for _, w in rates])),
            "command": Stream(sent_at[:, 0], sent_at[:, 1:]),
        }
        truth = Record(there / "truth.csv", streams, pose_age=float(np.mean(ages)))
        return Excited(session.flown, done, truth, written[-1] if written else None)
