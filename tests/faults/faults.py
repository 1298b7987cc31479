"""Faults injected into flights through the real firmware, and what must come of each. Scripted pilot, virtual time."""

import dataclasses
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Any

import numpy as np

from e2efly.control.vectors import Quat
from e2efly.flight.betaflight.messages import BatteryState, FcVariant, StatusEx
from e2efly.flight.betaflight.settings_messages import RcTuning, RxMap
from e2efly.flight.pilot.estimate import OUTLIERS_S
from e2efly.flight.pilot.fence import fence_problem
from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.policy.odometry import Odometry, Sample, yaw_of
from tests.faults.stage import FENCE, LATENCY_S, POSE_S, SETTINGS, Stage

RECEIVER_S = 0.05
"""From the pilot's hand to the bridge: the receiver's frame (20 ms), the controller's receiver task, the question for
its channels (20 ms)."""
GUST, WALL = 50.0, 0.6
"""Wind of a gust, m/s, until the policy has lost the vehicle; distance of the fence, m."""
DRIFT_RATE, ASTRAY, HEADING_S = 0.7, 0.3, 0.6
"""How fast a heading drifts, rad/s; the speed, m/s, from which on the vehicle shows it, and how soon, s."""
SAGGED = 0.85
"""Share of their speed that the rotors still reach on a sagging battery: 0.72 of the thrust."""
SILENCE_S = 0.3
"""Of MSP, both ways, s."""
LOST_S = 0.8
"""Until the controller says that it does not hear the receiver, s: `failsafe_delay`, and the frames before."""
SPIN_S = 1.0
"""Until a vehicle that lost a motor is known to be lost, s."""
BATTERY_S = 0.55
"""The battery is asked for at 2 Hz; the question and its answer take their time."""


class End(StrEnum):
    """The safe states that a fault may end in."""

    GOES_ON = "the flight goes on"
    HOVER = "hover"
    LANDED = "landed"
    STANDS = "stands, throttle closed"
    PILOT = "the pilot flies"
    OFF = "motors off"
    FAILSAFE = "the controller lands it"
    FALLS = "it falls"
    REFUSED = "no take-off"


@dataclass(frozen=True)
class Fault:
    name: str
    during: Mode
    """In which mode it strikes: INIT, HOVER or POLICY."""
    inject: Callable[[Stage], None]
    """Makes it happen."""
    end: End
    """What must come of it."""
    reason: Reason | None = None
    """What the first change of mode must say, or the refusal."""
    within: float = 0.0
    """Stated time to react beyond one control period, s."""
    begins: Callable[[Stage], bool] = lambda stage: True
    """Whether it has become visible to anybody: the time to react counts from there."""
    each: Callable[[Stage], None] = lambda stage: None
    """Done before every control step while it lasts."""
    asked: bool = False
    """The policy must be asked first: its period comes on top."""
    watch: float = 1.0
    """How long the flight is watched where nothing is to change any more, s."""


def _alter(change: Callable[[Sample], Sample | None]) -> Callable[[Stage], None]:
    def inject(stage: Stage) -> None:
        stage.poses.alter = change

    return inject


def _freeze(stage: Stage) -> None:
    kept = stage.poses.newest
    assert kept is not None
    stage.poses.alter = lambda sample: dataclasses.replace(kept, received=sample.received, stamp=sample.stamp)


def _gaps(stage: Stage) -> None:
    """Twice a second."""
    stage.poses.alter = lambda sample: None if sample.received % 0.5 < 0.12 else sample


def _nan(sample: Sample) -> Sample:
    return dataclasses.replace(sample, position=np.array([np.nan, 0.0, 1.0]))


def _jump(stage: Stage) -> None:
    step = stage.random.uniform(1.0, 3.0, 3) * stage.random.choice([-1, 1], 3)
    stage.poses.alter = lambda sample: dataclasses.replace(sample, position=sample.position + step)


def _outlier(stage: Stage) -> None:
    def once(sample: Sample) -> Sample:
        stage.poses.alter = None
        return dataclasses.replace(sample, position=sample.position + 5.0)

    stage.poses.alter = once


def _drift(stage: Stage) -> None:
    """The heading turns away, to either side, until it is half a turn off."""
    began, side = stage.rig.now(), float(stage.random.choice([-1.0, 1.0]))

    def turned(sample: Sample) -> Sample:
        angle = side * min(DRIFT_RATE * (stage.rig.now() - began), math.pi)
        turn = Quat(math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)).compose(Quat(*sample.quaternion))
        return dataclasses.replace(sample, quaternion=np.array([turn.w, turn.x, turn.y, turn.z]))

    stage.poses.alter = turned


def _led_astray(stage: Stage) -> bool:
    """Nothing is to be seen of a wrong heading before it leads the vehicle to the wrong side, and it moves by it."""
    odometry, true = stage.session.bridge.odometry, stage.rig.state
    error = math.remainder(yaw_of(odometry.quaternion) - yaw_of(true.quaternion), math.tau)
    return abs(error) > math.pi / 2 and float(np.linalg.norm(true.velocity[:2])) > ASTRAY


def _source_clock(sample: Sample) -> Sample:
    assert sample.stamp is not None
    return dataclasses.replace(sample, stamp=sample.stamp + 3600.0)


def wall_clock(stage: Stage) -> None:
    """The wall clock is set by hours, forth and back, over and over."""
    wall, wall_ns = time.time, time.time_ns

    def off() -> float:
        return 7200.0 * math.copysign(1.0, math.sin(10 * stage.rig.now()))

    time.time = lambda: wall() + off()
    time.time_ns = lambda: wall_ns() + round(off() * 1e9)
    stage.undo.callback(setattr, time, "time", wall)
    stage.undo.callback(setattr, time, "time_ns", wall_ns)


def _network(fault: str) -> Callable[[Stage], None]:
    def inject(stage: Stage) -> None:
        if fault == "late":
            stage.patience(0.3)
            stage.network.late = 0.6
        stage.network.fault = fault

    return inject


def _made(part: str, **faults: Any) -> Callable[[Stage], None]:
    """Attributes of a part of the stage have other values from now on."""

    def inject(stage: Stage) -> None:
        for name, value in faults.items():
            setattr(getattr(stage, part), name, value)

    return inject


_link = partial(_made, "link")


def _rewrite(code: int, change: Callable[[bytes], bytes]) -> Callable[[Stage], None]:
    def inject(stage: Stage) -> None:
        stage.link.rewrites[code] = change

    return inject


def _once(code: int, change: Callable[[bytes], bytes]) -> Callable[[Stage], None]:
    def inject(stage: Stage) -> None:
        def altered(payload: bytes) -> bytes:
            del stage.link.rewrites[code]
            return change(payload)

        stage.link.rewrites[code] = altered

    return inject


def _disarmed(payload: bytes) -> bytes:
    """STATUS_EX without the first mode, which is ARM."""
    return payload[:6] + bytes([payload[6] & ~1]) + payload[7:]


def _low_battery(payload: bytes) -> bytes:
    """Four cells, 13.2 V."""
    return bytes([4]) + payload[1:9] + (1320).to_bytes(2, "little") + payload[11:]


def _slow_rates(payload: bytes) -> bytes:
    """Roll, pitch and yaw of 200 deg/s at full stick, in ACTUAL rates."""
    changed = bytearray(payload)
    changed[0] = changed[11] = changed[12] = 20
    changed[2:5] = bytes([20, 20, 20])
    return bytes(changed)


def _other_map(payload: bytes) -> bytes:
    """Roll and yaw change places."""
    return bytes([payload[2], payload[1], payload[0]]) + payload[3:]


def _set(**changes: object) -> Callable[[Stage], None]:
    return lambda stage: stage.rig.set(**changes)


def _gust(stage: Stage) -> None:
    """From any side, and a fence that begins not far from where the vehicle is."""
    angle = stage.random.uniform(-np.pi, np.pi)
    (x, y, _), bridge = stage.rig.state.position, stage.session.bridge
    low, high = (x - WALL, y - WALL, FENCE.low[2]), (x + WALL, y + WALL, FENCE.high[2])
    bridge.settings = dataclasses.replace(SETTINGS, fence=dataclasses.replace(FENCE, low=low, high=high))
    stage.undo.callback(setattr, bridge, "settings", SETTINGS)
    stage.rig.wind = GUST * np.array([np.cos(angle), np.sin(angle), 0.0])


def _calm(stage: Stage) -> None:
    if stage.mode is not Mode.POLICY:
        stage.rig.wind = np.zeros(3)


def _past_fence(stage: Stage) -> bool:
    s = stage.rig.state
    truth = Odometry(stage.rig.now(), s.position, s.velocity, s.quaternion, s.body_rate)
    return fence_problem(stage.session.bridge.settings.fence, truth) is not None


def _motor(stage: Stage) -> None:
    stage.rig.shares = np.array([1.0, 1.0, 1.0, 1.0])
    stage.rig.shares[int(stage.random.integers(4))] = 0.0


def _short_silence(stage: Stage) -> None:
    end = stage.rig.now() + SILENCE_S
    stage.link.silent = True
    stage.each = lambda: setattr(stage.link, "silent", stage.rig.now() < end)


FAULTS = (
    # what the flight takes without a change of mode
    Fault("poses: one outlier", Mode.POLICY, _outlier, End.GOES_ON),
    Fault("clock: the pose source's jumps by an hour", Mode.POLICY, _alter(_source_clock), End.GOES_ON),
    Fault("clock: the wall clock jumps to and fro", Mode.POLICY, wall_clock, End.GOES_ON),
    Fault("link: garbage between frames", Mode.POLICY, _link(garbage=0.5), End.GOES_ON),
    Fault("link: one frame of five halved", Mode.POLICY, _link(halved=0.2), End.GOES_ON),
    Fault("controller: one message says disarmed", Mode.POLICY, _once(StatusEx.CODE, _disarmed), End.GOES_ON),
    # the policy loses the vehicle to the hover controller
    Fault("policy: NaN", Mode.POLICY, _network("nan"), End.HOVER, Reason.POLICY, asked=True),
    Fault("policy: exception", Mode.POLICY, _network("raise"), End.HOVER, Reason.POLICY, asked=True),
    Fault("policy: late", Mode.POLICY, _network("late"), End.HOVER, Reason.POLICY, asked=True),
    Fault("control steps late", Mode.POLICY, lambda stage: None, End.HOVER, Reason.DEADLINES, 0.03,
          each=_made("session", lateness=0.05)),
    Fault("pilot: policy switch off", Mode.POLICY, _set(mission="hover"), End.HOVER, Reason.MISSION, RECEIVER_S),
    Fault("pilot: stick input", Mode.POLICY, _set(roll=0.5), End.HOVER, Reason.STICK_INPUT, RECEIVER_S),
    Fault("fence: a gust", Mode.POLICY, _gust, End.HOVER, None, POSE_S + LATENCY_S, begins=_past_fence,
          each=_calm),
    Fault("pilot: override off", Mode.POLICY, lambda stage: setattr(stage, "pilot", stage.pilot_holds), End.PILOT,
          Reason.OVERRIDE_OFF, RECEIVER_S + 0.05),
    # the vehicle lands
    Fault("poses: none come", Mode.POLICY, _alter(lambda sample: None), End.LANDED, Reason.NO_ODOMETRY, 0.1),
    Fault("poses: frozen", Mode.POLICY, _freeze, End.LANDED, Reason.NO_ODOMETRY, 0.2 + POSE_S),
    Fault("poses: jump for good", Mode.POLICY, _jump, End.LANDED, Reason.NO_ODOMETRY, OUTLIERS_S + POSE_S),
    Fault("poses: NaN", Mode.POLICY, _alter(_nan), End.LANDED, Reason.NO_ODOMETRY, OUTLIERS_S + POSE_S),
    Fault("poses: the heading drifts away", Mode.HOVER, _drift, End.LANDED, Reason.NO_ODOMETRY, HEADING_S,
          begins=_led_astray),
    Fault("link: nothing but garbage comes back", Mode.POLICY, _link(spoilt=1.0), End.STANDS, Reason.LINK, 0.25),
    Fault("link: half frames", Mode.POLICY, _link(halved=1.0), End.STANDS, Reason.LINK, 0.25),
    Fault("link: slow, 60 ms each way", Mode.POLICY, _link(delay=0.06), End.LANDED, Reason.LINK, 0.25),
    Fault("battery low", Mode.HOVER, _rewrite(BatteryState.CODE, _low_battery), End.LANDED, Reason.BATTERY_LOW,
          BATTERY_S),
    Fault("battery: sag", Mode.HOVER, _made("rig", shares=np.full(4, SAGGED)), End.GOES_ON, watch=3.0),
    Fault("link: silent for 0.3 s", Mode.HOVER, _short_silence, End.LANDED, Reason.LINK, 0.25),
    Fault("receiver: silent", Mode.HOVER, _made("rig", heard=False), End.FAILSAFE, Reason.NO_PILOT, LOST_S),
    Fault("motor: one stops", Mode.HOVER, _motor, End.FALLS, within=SPIN_S),
    # nobody but the pilot can help
    Fault("link: cut", Mode.HOVER, _link(silent=True), End.PILOT, Reason.LINK, 0.25),
    Fault("link: unplugged", Mode.HOVER, _link(gone=True), End.PILOT, Reason.LINK, 0.25),
    Fault("controller reboots", Mode.HOVER, lambda stage: stage.rig.power(False), End.OFF, Reason.LINK, 0.25),
    # on the ground
    Fault("wrong firmware", Mode.INIT, _rewrite(FcVariant.CODE, lambda payload: b"INAV"), End.REFUSED),
    Fault("wrong rates", Mode.INIT, _rewrite(RcTuning.CODE, _slow_rates), End.REFUSED, Reason.SETTINGS),
    Fault("wrong channel map", Mode.INIT, _rewrite(RxMap.CODE, _other_map), End.REFUSED, Reason.SETTINGS),
    Fault("poses: gaps of 0.12 s before take-off", Mode.INIT, _gaps, End.REFUSED, Reason.SETTINGS),
    Fault("battery low before take-off", Mode.INIT, _rewrite(BatteryState.CODE, _low_battery), End.REFUSED,
          Reason.BATTERY_LOW),
)  # fmt: skip
"""All that can be done in virtual time; those of the bridge's process are in `process_faults`."""
