"""Whole flights through the real firmware: take-off, hover, policy, landing, with a pilot who only moves switches."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.deploy.flight_state import Mode, Reason
from e2efly.deploy.goals import GatesGoal, Goal, HoverGoal, LandGoal, ReferenceGoal
from e2efly.deploy.policy import Policy
from e2efly.deploy.record import Log
from e2efly.validate.firmware import Firmware
from e2efly.validate.rig import Rig
from e2efly.validate.session import Flown, Session, rehearsal_settings
from e2efly.vehicles.vehicle import Vehicle

PARKED = 0.3
"""The vehicle stands within this of where the policy's course begins, m an axis."""
ASKEW = 0.05
"""How far a race's heading at the start is off, rad."""
LINK_S = 0.01
"""What link and firmware take from a pose to the rate loop's setpoint on the rig, s; the poses are late by the rest."""
WATCHED = {"hover": 8.0, "track": 12.0, "land": 15.0, "race": 40.0}
"""The longest that a policy is let fly, s."""


@dataclass(frozen=True)
class Rehearsal:
    """A whole flight."""

    modes: tuple[str, ...]
    """The modes in order."""
    reasons: tuple[str, ...]
    """Why each began."""
    complete: bool
    """Took off, hovered, gave the policy its whole time, landed and was disarmed, without anybody's help."""
    hover_error: float
    """Mean distance of the hover before the policy to its target, m."""
    policy_error: float
    """Mean distance to the goal: of hovering over its last second, of tracking after 2 s; else NaN. m."""
    gates: int
    """Gates passed."""
    laps: float
    """Laps flown."""
    lap_time: float
    """Mean time of a lap, s; NaN."""
    touch: tuple[float, float]
    """Distance from the pad's centre, m, and speed, m/s, when a landing policy touched; NaN."""
    top_speed: float
    """Of the policy, m/s."""
    flown: Flown
    """The flight."""


def rehearse(
    firmware: Firmware,
    policy: Policy,
    goal: Goal,
    vehicle: Vehicle,
    *,
    seed: int = 0,
    log: Log | None = None,
    folder: Path | None = None,
) -> Rehearsal:
    """One whole flight.

    Args:
        firmware: the built firmware.
        policy: as loaded.
        goal: where it flies.
        vehicle: of the world and of the bridge.
        seed: of where it stands and of the poses' noise.
        log: keeps the flight's record.
        folder: of the firmware's files; left out: a temporary one.
    """
    with tempfile.TemporaryDirectory(prefix="e2efly-") as temporary:
        latency = max(policy.contract.latency_s - LINK_S, 0.0)
        with Rig(firmware, folder or Path(temporary), vehicle, latency=latency, seed=seed) as rig:
            return _fly(rig, policy, goal, seed, log)


def _fly(rig: Rig, policy: Policy, goal: Goal, seed: int, log: Log | None) -> Rehearsal:
    random = np.random.default_rng(seed)
    first = _begin(goal)
    x, y = first[:2] + random.uniform(-PARKED, PARKED, 2)
    rig.state = rig.world.at_rest(x, y, _heading(goal, random))
    rig.sleep(0.5)
    feet = rig.world.vehicle.feet_height
    session = Session(rig, rehearsal_settings(first[2] - feet), policy=policy, goal=goal, log=log)
    try:
        up = session.take_off(3.0)
        rig.set(mission="policy")
        bridge, worker = session.bridge, session.worker
        assert worker is not None
        begun = session.fly(0.5, session.in_mode(Mode.POLICY))
        passed, times, start = 0, [], rig.now()
        end = rig.now() + WATCHED[policy.contract.task]
        while begun and rig.now() < end and bridge.flight.mode is Mode.POLICY:
            session.step()
            state = worker.state
            if isinstance(goal, GatesGoal) and state is not None and state.goal.passed > passed:
                passed = state.goal.passed
                times.append(rig.now() - start)
        done = Reason.POLICY_DONE in bridge.flight.reasons
        if done and isinstance(goal, GatesGoal) and passed < goal.laps * goal.gates.count:
            passed += 1  # the last gate ends the policy's flight in the same step
            times.append(rig.now() - start)
        whole = done or bridge.flight.mode is Mode.POLICY
        if not isinstance(goal, LandGoal):
            rig.set(mission="hover")
            session.fly(3.0)
        landed = session.land()
        flown = session.flown
        modes = tuple(mode for _, mode, _ in flown.changes)
        reasons = tuple("; ".join(reasons) for _, _, reasons in flown.changes)
        return Rehearsal(
            modes=modes,
            reasons=reasons,
            complete=up and begun and whole and landed,
            hover_error=_mean(_first_hover(flown)),
            policy_error=_policy_error(goal, flown),
            gates=passed,
            laps=passed / goal.gates.count if isinstance(goal, GatesGoal) else 0.0,
            lap_time=float(np.mean(np.diff([0.0, *times[goal.gates.count - 1 :: goal.gates.count]])))
            if isinstance(goal, GatesGoal) and len(times) >= goal.gates.count
            else float("nan"),
            touch=_touch(goal, flown, feet),
            top_speed=max((float(np.linalg.norm(flown.velocity[i])) for i in flown.where(Mode.POLICY)), default=0.0),
            flown=flown,
        )
    finally:
        session.close()


def _begin(goal: Goal) -> np.ndarray:
    """Where the policy is handed the vehicle, world, m."""
    if isinstance(goal, HoverGoal):
        return np.asarray(goal.target) + np.array([1.0, -0.5, -1.0])
    if isinstance(goal, LandGoal):
        return goal.pad + np.array([1.0, 0.5, 2.0])
    if isinstance(goal, ReferenceGoal):
        return np.array(goal.spline.position(np.zeros((1, 1)))[0, 0], np.float64)
    assert isinstance(goal, GatesGoal)
    return np.asarray(goal.gates.start, np.float64)


def _heading(goal: Goal, random: np.random.Generator) -> float:
    """In which the vehicle is put down, rad: any, but that races begin as their track says."""
    if isinstance(goal, GatesGoal):
        return float(goal.gates.start_yaw) + random.uniform(-ASKEW, ASKEW)
    return random.uniform(-np.pi, np.pi)


def _first_hover(flown: Flown) -> np.ndarray:
    """Errors over the last second of the hover before the policy."""
    end = next((at for at, mode, _ in flown.changes if mode == Mode.POLICY), flown.time[-1])
    rows = zip(flown.time, flown.mode, flown.position, flown.goal, strict=True)
    last = [(p, g) for at, mode, p, g in rows if mode == Mode.HOVER and end - 1.0 <= at < end]
    return np.array([np.linalg.norm(p - g) for p, g in last if g is not None])


def _policy_error(goal: Goal, flown: Flown) -> float:
    if isinstance(goal, HoverGoal):
        return _mean(flown.errors(Mode.POLICY, last=1.0))
    if isinstance(goal, ReferenceGoal):
        return _mean(flown.errors(Mode.POLICY, settle=2.0))
    return float("nan")


def _touch(goal: Goal, flown: Flown, feet: float) -> tuple[float, float]:
    if not isinstance(goal, LandGoal):
        return float("nan"), float("nan")
    for i in flown.where(Mode.POLICY):
        if i + 1 < len(flown.position) and flown.position[i + 1][2] <= goal.pad[2] + feet + 1e-3:
            sideways = flown.position[i + 1][:2] - goal.pad[:2]
            return float(np.linalg.norm(sideways)), float(np.linalg.norm(flown.velocity[i]))
    return float("nan"), float("nan")


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else float("nan")
