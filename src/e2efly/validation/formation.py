"""Several vehicles through the real firmware at once: one firmware for each, in lockstep, among each other.

Each takes off and lands alone, while the others wait with their time stopped; between, all fly the policy together.
"""

import dataclasses
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from e2efly.flight.pilot.flight_state import Mode
from e2efly.flight.pilot.hovering import hover_controller
from e2efly.flight.pose.neighbours import Neighbours
from e2efly.flight.pose.pose_source import PlantSource
from e2efly.policy.odometry import Sample
from e2efly.policy.others import USUAL
from e2efly.policy.runtime import Acting
from e2efly.tasks.route import Route, course_for
from e2efly.validation.bridge_session import Session, open_fence, rehearsal_settings
from e2efly.validation.firmware_program import Firmware
from e2efly.validation.rehearsal import HOVER, LINK_S, REACH
from e2efly.validation.rig import Rig
from e2efly.vehicles.vehicle import Vehicle

SEEN_M = 0.002
"""Standard deviation of the position in which the others are seen, m per axis."""


@dataclass(frozen=True)
class FormationFlight:
    """A flight of several vehicles."""

    complete: tuple[bool, ...]
    """Whether each took off, flew the policy for its whole time, landed and was disarmed."""
    error: tuple[float, ...]
    """Distance of each to its place, the first point of its course, at the end of the policy's flight, m."""
    nearest: float
    """Smallest distance between the centres of two vehicles while the policy flew, m."""
    track: np.ndarray
    """(steps, vehicles, 3) positions while the policy flew, m. The time between two steps is `step_s`."""
    step_s: float
    """s."""
    modes: tuple[str, ...]
    """The modes of each, with the reason for each mode."""


def fly_formation(
    firmware: Firmware,
    policy: Acting,
    vehicle: Vehicle,
    routes: Sequence[Route],
    starts: Sequence[np.ndarray],
    seconds: float,
    seed: int = 0,
) -> FormationFlight:
    """Fly a policy on several vehicles, for some seconds.

    Args:
        firmware: the firmware of each.
        policy: the policy of all.
        vehicle: the vehicle of all.
        routes: where each is to fly.
        starts: (3,) m, where each hovers before.
        seconds: for how long the policy flies.
        seed: seed of the noise.

    Raises:
        ValueError: for a route that the policy cannot fly.
        OSError: when the firmware cannot be started.
    """
    random = np.random.default_rng(seed)
    latency = max(policy.contract.latency_of(vehicle) - LINK_S, 0.0)
    with ExitStack() as stack:
        rigs = []
        courses = [
            dataclasses.replace(course_for(policy.contract, vehicle, route), start=start)
            for route, start in zip(routes, starts, strict=True)
        ]
        for i, (start, course) in enumerate(zip(starts, courses, strict=True)):
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="e2efly-"))
            rigs.append(stack.enter_context(Rig(firmware, Path(folder), vehicle, latency=latency, seed=seed + i)))
            yaw = random.uniform(-np.pi, np.pi) if course.heading is None else course.heading
            rigs[i].state = rigs[i].world.at_rest(start[0], start[1], yaw)
            rigs[i].sleep(0.5)

        def seen(rig: Rig, now: float) -> list[Sample]:
            """The pose of another vehicle as it is, with noise, at the time of the one that sees it."""
            state = rig.state
            position = np.asarray(state.position) + random.normal(0.0, SEEN_M, 3)
            return [Sample(now, position, np.array(state.quaternion), velocity=np.array(state.velocity))]

        sessions = []
        for rig, course, start in zip(rigs, courses, starts, strict=True):
            others = [PlantSource(lambda now, r=other: seen(r, now), "rig") for other in rigs if other is not rig]
            session = Session(
                rig, rehearsal_settings(start[2] - vehicle.feet_height, fence=open_fence(vehicle, REACH)),
                policy=policy, course=course, hover=hover_controller(HOVER, vehicle, latency + LINK_S),
                neighbours=Neighbours(others, 0.1, policy.contract.others or USUAL),
            )  # fmt: skip
            stack.callback(session.close)
            sessions.append(session)
        up = [session.take_off(3.0) for session in sessions]
        for rig in rigs:
            rig.set(mission="policy")
        track, until = [], [rig.now() + seconds for rig in rigs]
        while any(rig.now() < end for rig, end in zip(rigs, until, strict=True)):
            for session in sessions:
                session.step()
            track.append([np.array(rig.state.position) for rig in rigs])
        flew = [session.bridge.flight.mode is Mode.POLICY for session in sessions]
        goals = [session.worker.runtime.course.points[0] for session in sessions if session.worker is not None]
        error = [float(np.linalg.norm(np.subtract(at, goal))) for at, goal in zip(track[-1], goals, strict=True)]
        landed = []
        for rig, session in zip(rigs, sessions, strict=True):
            rig.set(mission="hover")
            session.fly(2.0)
            landed.append(session.land())
    positions, changes = np.array(track), [session.flown.changes for session in sessions]
    modes = tuple(", ".join(f"{mode} ({'; '.join(why)})" for _, mode, why in each) for each in changes)
    pairs = combinations(range(len(rigs)), 2)
    nearest = min(float(np.linalg.norm(positions[:, i] - positions[:, j], axis=-1).min()) for i, j in pairs)
    complete = tuple(bool(a and b and c) for a, b, c in zip(up, flew, landed, strict=True))
    return FormationFlight(complete, tuple(error), nearest, positions, sessions[0].period, modes)
