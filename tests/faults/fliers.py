"""Who flies in mode POLICY of a campaign's flight: policy, course, settings and gear, as its faults need them."""

import dataclasses
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from e2efly.environment import Env
from e2efly.flight.settings import FlightSettings
from e2efly.policy.goal import Course
from e2efly.policy.loader import Policy
from e2efly.tasks.hover.goal import HoverRoute
from e2efly.tasks.route import course_for
from e2efly.validation.bridge_session import rehearsal_settings
from e2efly.validation.candidate import Candidate, candidate
from e2efly.validation.plant import RigidState
from e2efly.validation.rehearsal import REACH_IN_SIGHT, whole_course
from e2efly.validation.rig import Rig
from e2efly.validation.scenery import Scenery
from e2efly.vehicles.vehicle import Vehicle
from tests.faults.injected_fliers import BEYOND
from tests.faults.injection import Flier
from tests.faults.injections import KINDS, Strike
from tests.faults.stage import SETTINGS, TARGET, Gear

BY_SIGHT = ("avoid", "land_visual")
"""The zoo's policies that fly by images, in turn of the seeds: of depth, and of a mask."""


@dataclass(frozen=True)
class Outfit:
    """What a flight is flown with."""

    policy: Policy
    course: Course
    settings: FlightSettings
    gear: Gear


def flier_of(strikes: tuple[Strike, ...]) -> Flier:
    """Who has to fly for these faults to matter. Kinds that need two are refused."""
    fliers = {KINDS[strike.kind].flier for strike in strikes} - {Flier.POLICY}
    if len(fliers) > 1:
        raise ValueError(f"strikes need {' and '.join(sorted(fliers))} to fly; accepted: one of them")
    return fliers.pop() if fliers else Flier.POLICY


def body_of(strikes: tuple[Strike, ...], vehicle: Vehicle) -> Vehicle:
    """The vehicle that flies, given the one of the bridge's file."""
    for strike in strikes:
        if (body := KINDS[strike.kind].body) is not None:
            vehicle = body(vehicle, **strike.parameters)
    return vehicle


def outfit(
    strikes: tuple[Strike, ...], height: float, seed: int, rig: Rig, policy: Policy, vehicle: Vehicle, folder: Path
) -> Outfit:
    """Equip a flight, and put the vehicle where it begins; `policy` hovers, for a flight without images."""
    kinds, flier = [KINDS[strike.kind] for strike in strikes], flier_of(strikes)
    gear = Gear(
        commands=flier is Flier.COMMANDS, filtered=flier is Flier.FILTER, believed=vehicle,
        watched=any(kind.watched for kind in kinds),
        log=folder / "flight.mcap" if any(kind.logged for kind in kinds) else None,
    )  # fmt: skip
    if flier is Flier.SIGHT:
        return _by_sight(BY_SIGHT[seed % len(BY_SIGHT)], seed, rig, vehicle, gear)
    settings = dataclasses.replace(SETTINGS, takeoff_height=height)
    if flier is Flier.FILTER:
        settings = dataclasses.replace(settings, fence=BEYOND)
    x, y, _ = TARGET
    return Outfit(policy, course_for(policy.contract, vehicle, HoverRoute(target=(x, y, height))), settings, gear)


@cache
def _found(task: str) -> tuple[Candidate, Env]:
    found = candidate(task)
    return found, found.environment(next(iter(found.task.criteria().values())))


def _by_sight(task: str, seed: int, rig: Rig, vehicle: Vehicle, gear: Gear) -> Outfit:
    found, env = _found(task)
    scenery = Scenery.draw(env, seed)
    course = scenery.on(whole_course(found.policy, vehicle))
    x, y, z = course.origin.points(course.start)
    rig.state = rig.world.at_rest(float(x), float(y), (course.heading or 0.0) + course.origin.yaw)
    rig.sleep(0.5)
    settings = dataclasses.replace(
        rehearsal_settings(float(z) - vehicle.feet_height, REACH_IN_SIGHT), land_settle=SETTINGS.land_settle
    )
    cameras = tuple(scenery.sources(lambda: RigidState.of(rig.state), course.origin))
    return Outfit(found.policy, course, settings, dataclasses.replace(gear, cameras=cameras))
