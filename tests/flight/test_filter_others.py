"""The filter among other vehicles: each keeps to its half of the space between, and a lost one grows."""

import math

import numpy as np
import pytest

from e2efly.control import Ctbr, Vec3
from e2efly.flight.filter.arithmetic import SCALARS
from e2efly.flight.filter.filter import Filter, FilterMemory, filtered, remember, watch
from e2efly.flight.filter.forecast import NOTHING, ForecastCommand, ForecastMotion, moved
from e2efly.flight.filter.guard import keep
from e2efly.flight.filter.margins import halves
from e2efly.flight.pose.neighbours import OtherVehicle
from e2efly.flight.settings import Fence
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle

VEHICLE = load_vehicle("vis_r")
FILTER = Filter.of(VEHICLE, Fence(low=(-20.0, -20.0, 0.2), high=(20.0, 20.0, 10.0), speed=6.0, tilt=1.4))
HOVER = ForecastCommand(GRAVITY, 0.0, 0.0, 0.0)
DT, DELAY = 0.01, 6
STEP = FILTER.backup.response.step(DT)


def body(x: float, y: float = 0.0, v: float = 0.0) -> ForecastMotion:
    return ForecastMotion(x, y, 3.0, v, 0.0, 0.0, 1.0, *[0.0] * 8, GRAVITY)


def seen(m: ForecastMotion, now: float) -> Odometry:
    p, v = np.array([m.px, m.py, m.pz]), np.array([m.vx, m.vy, m.vz])
    return Odometry(now, p, v, np.array([m.qw, m.qx, m.qy, m.qz]), np.array([m.wx, m.wy, m.wz]))


def other(m: ForecastMotion) -> OtherVehicle:
    return OtherVehicle((m.px, m.py, m.pz), (m.vx, m.vy, m.vz))


def meet(bodies: list[ForecastMotion], leans: list[float], seconds: float, keeping: bool = True) -> np.ndarray:
    """(steps, k, 3) places of vehicles whose policies hold a lean to +x, each behind the same delay."""
    memories = [FilterMemory() for _ in bodies]
    pipes, places = [[HOVER] * DELAY for _ in bodies], []
    for k in range(-34, 0):
        memories = [remember(memory, HOVER, k * DT) for memory in memories]
    for k in range(round(seconds / DT)):
        now, before = k * DT, list(bodies)
        for i, m in enumerate(before):
            motion = seen(m, now)
            memories[i] = watch(FILTER, memories[i], motion, now, flying=True)
            wanted = ForecastCommand(GRAVITY, -6 * m.qx * m.qw, 3 * leans[i] - 6 * m.qy * m.qw, 0.0)
            rest = [other(x) for j, x in enumerate(before) if j != i] if keeping else []
            given = filtered(FILTER, memories[i], motion, now, wanted, others=rest).command
            memories[i] = remember(memories[i], given, now)
            pipes[i].append(given)
            bodies[i] = moved(SCALARS, FILTER.backup.response, m, pipes[i].pop(0), NOTHING, STEP)
        places.append([[m.px, m.py, m.pz] for m in bodies])
    return np.array(places)


def gap(places: np.ndarray) -> float:
    return float(np.linalg.norm(places[:, 0] - places[:, 1], axis=-1).min()) - 2 * VEHICLE.radius


@pytest.mark.parametrize("aside", [0.0, 0.15])
def test_two_that_fly_at_each_other_do_not_meet(aside: float) -> None:
    free = meet([body(-4.0), body(4.0, aside)], [0.3, -0.3], 3.0, keeping=False)
    assert gap(free) < 0
    kept = meet([body(-4.0), body(4.0, aside)], [0.3, -0.3], 6.0)
    assert gap(kept) > 0
    assert np.abs(kept[-1, :, 0]).max() < 2.0  # they went as far as they could, and wait there


def test_one_that_follows_does_not_run_into_the_one_before_it() -> None:
    places = meet([body(-3.0, v=3.0), body(0.0)], [0.25, 0.0], 5.0)
    assert gap(places) > 0


def test_a_command_passes_that_leads_away_and_one_that_leads_there_is_named() -> None:
    memory = FilterMemory()
    for k in range(-34, 0):
        memory = remember(memory, HOVER, k * DT)
    m = body(0.0, v=2.0)
    memory = watch(FILTER, memory, seen(m, 0.0), 0.0, flying=True)
    wanted = Ctbr(GRAVITY, Vec3(0.0, 1.0, 0.0))
    given, change = keep(FILTER, memory, seen(m, 0.0), 0.0, wanted, others=[other(body(-1.0))])
    assert given is wanted and change is None
    _, change = keep(FILTER, memory, seen(m, 0.0), 0.0, wanted, others=[other(body(1.2))])
    assert change is not None and change.limit == "another vehicle" and change.share > 0


def test_each_takes_half_and_a_lost_one_takes_more() -> None:
    m, limits = body(0.0), FILTER.limits
    there = OtherVehicle((3.0, 4.0, 3.0), (0.0, 0.0, 0.0))
    (plane,) = halves(limits, m, [there], 0.05, 9.0)
    assert (plane.x, plane.y, plane.z) == pytest.approx((0.6, 0.8, 0.0))
    assert plane.gap == pytest.approx(2.5 - limits.radius)
    (lost,) = halves(limits, m, [there._replace(ball=2.0)], 0.05, 9.0)
    assert lost.gap == pytest.approx(1.5 - limits.radius)
    (coming,) = halves(limits, m, [there._replace(velocity=(-3.0, -4.0, 0.0))], 0.1, 9.0)
    assert coming.gap == pytest.approx(2.25 - limits.radius)
    assert halves(limits, m, [there], 0.05, 2.0) == ()
    (same,) = halves(limits, m, [OtherVehicle((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))], 0.0, 9.0)
    assert math.isfinite(same.gap) and same.x == 1.0
