"""The filter between policy and sticks: what it lets pass, what it keeps, what it refuses."""

import dataclasses
import math
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control import Ctbr, Vec3
from e2efly.courses.solids import DISC, SIZES, SQUARE
from e2efly.flight.filter.arithmetic import SCALARS
from e2efly.flight.filter.backup import GUST, UNSEEN, Backup, brake, command
from e2efly.flight.filter.filter import (
    Filter,
    FilterMemory,
    feel,
    filtered,
    forecast,
    remember,
    stopping_distance,
    watch,
)
from e2efly.flight.filter.forecast import NOTHING, ForecastCommand, ForecastMotion, moved
from e2efly.flight.filter.guard import FilterError, Keeper, keep
from e2efly.flight.filter.margins import NAMES, MarginLimits, rooms
from e2efly.flight.filter.obstacle import obstacles
from e2efly.flight.settings import Fence
from e2efly.policy.odometry import Odometry
from e2efly.simulation.scenes.file import load_scene
from e2efly.simulation.scenes.scene import clearance
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

VEHICLE = load_vehicle("vis_r")
FENCE = Fence(low=(-6.0, -6.0, 0.2), high=(6.0, 6.0, 6.0), speed=6.0, tilt=1.4)
FILTER = Filter.of(VEHICLE, FENCE)
HOVER = ForecastCommand(GRAVITY, 0.0, 0.0, 0.0)
DT = 0.01
STEP = FILTER.backup.response.step(DT)


def pitched(tilt: float) -> tuple[float, float, float, float]:
    """A quaternion whose thrust leans to +x."""
    return math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0


def state(x: float = 0.0, v: float = 0.0, tilt: float = 0.0, z: float = 3.0, vz: float = 0.0) -> ForecastMotion:
    w, _, y, _ = pitched(tilt)
    return ForecastMotion(x, 0.0, z, v, 0.0, vz, w, 0.0, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY / math.cos(tilt))


def odometry(m: ForecastMotion, now: float) -> Odometry:
    p, v = np.array([m.px, m.py, m.pz]), np.array([m.vx, m.vy, m.vz])
    return Odometry(now, p, v, np.array([m.qw, m.qx, m.qy, m.qz]), np.array([m.wx, m.wy, m.wz]))


def after(
    sent: ForecastCommand = HOVER, m: ForecastMotion | None = None, filter: Filter = FILTER
) -> tuple[FilterMemory, Odometry]:
    """The memory after a third of a second of one command, and the odometry of now, 0 s."""
    memory = FilterMemory()
    for k in range(-34, 0):
        memory = remember(memory, sent, k * DT)
    seen = odometry(m or state(), 0.0)
    return watch(filter, memory, seen, 0.0, flying=True), seen


def passes(wanted: ForecastCommand, m: ForecastMotion, sent: ForecastCommand = HOVER, filter: Filter = FILTER) -> bool:
    memory, seen = after(sent, m, filter)
    return filtered(filter, memory, seen, 0.0, wanted).share == 0.0


def fly(
    m: ForecastMotion, seconds: float, delay: float = 0.06, filter: Filter = FILTER, lean: float = 0.0
) -> list[ForecastMotion]:
    """The forecast's own body behind a delay, with a policy that holds a lean to +x, rad, and no more; every state."""
    memory, flown, late = FilterMemory(), [m], round(delay / DT)
    pipe = [HOVER] * late
    for k in range(-34, 0):
        memory = remember(memory, HOVER, k * DT)
    for k in range(round(seconds / DT)):
        now, seen, body = k * DT, odometry(flown[-1], k * DT), flown[-1]
        memory = watch(filter, memory, seen, now, flying=True)
        level = ForecastCommand(GRAVITY, -6 * body.qx * body.qw, 3 * lean - 6 * body.qy * body.qw, 0.0)
        given = filtered(filter, memory, seen, now, level).command
        memory = remember(memory, given, now)
        pipe.append(given)
        flown.append(moved(SCALARS, filter.backup.response, body, pipe.pop(0), NOTHING, STEP))
    return flown


def test_far_from_everything_a_command_passes_bit_for_bit() -> None:
    wanted = Ctbr(np.float64(11.3), Vec3(0.3, -0.7, 0.1))
    memory, seen = after(m=state(v=1.0))
    given, change = keep(FILTER, memory, seen, 0.0, wanted)
    assert given is wanted and change is None


@pytest.mark.parametrize(
    ("wanted", "limit"),
    [
        (ForecastCommand(14.0, 0.0, 4.0, 0.0), "x high"),
        (ForecastCommand(14.0, -4.0, 0.0, 0.0), "y high"),
        (ForecastCommand(2.0, 0.0, 0.0, 0.0), "floor"),
        (ForecastCommand(25.0, 0.0, 0.0, 0.0), "ceiling"),
        (ForecastCommand(GRAVITY, 9.0, 0.0, 0.0), "tilt"),
    ],
)
def test_one_command_for_ever_breaches_nothing_and_names_what_it_was_changed_for(
    wanted: ForecastCommand, limit: str
) -> None:
    keeper, flown = Keeper(FILTER), [state()]
    pipe, limits = [HOVER] * 6, list[str]()
    for k in range(-34, 0):
        keeper.sent(Ctbr(GRAVITY, Vec3(0.0, 0.0, 0.0)), k * DT)
    for k in range(400):
        now, seen = k * DT, odometry(flown[-1], k * DT)
        # a policy that turns until it leans, and then pushes on
        leans = (
            2 * (flown[-1].qx * flown[-1].qz + flown[-1].qw * flown[-1].qy),
            -2 * (flown[-1].qy * flown[-1].qz - flown[-1].qw * flown[-1].qx),
        )
        still = limit != "tilt" and math.hypot(*leans) > 0.5
        asked = wanted._replace(x=0.0, y=0.0) if still else wanted
        keeper.see(seen, now, flying=True)
        given = keeper.keep(seen, now, Ctbr(asked.thrust, Vec3(*asked[1:])), floor=True)
        assert given is not None and keeper.problem is None
        limits += [keeper.change.limit] if keeper.change else []
        keeper.sent(given, now)
        pipe.append(ForecastCommand(given.thrust, given.rate.x, given.rate.y, given.rate.z))
        flown.append(moved(SCALARS, FILTER.backup.response, flown[-1], pipe.pop(0), NOTHING, STEP))
    assert limit in limits
    for m in flown:
        assert all(low < at < high for low, at, high in zip(FENCE.low, (m.px, m.py, m.pz), FENCE.high, strict=True))
        assert math.hypot(m.vx, m.vy, m.vz) < FENCE.speed
        assert math.acos(1 - 2 * (m.qx**2 + m.qy**2)) < FENCE.tilt


def test_a_policy_that_was_stopped_at_a_wall_may_leave_it() -> None:
    stopped = fly(state(x=3.0, v=3.0), 3.0)
    assert max(m.px for m in stopped) < FENCE.high[0] - 0.05
    assert abs(stopped[-1].vx) < 0.5 and stopped[-1].px > 4.8
    assert fly(stopped[-1], 2.0, lean=-0.2)[-1].px < 4.0


def test_commands_on_their_way_count() -> None:
    m = state(x=5.0, v=2.0)
    towards, away = ForecastCommand(14.0, 0.0, 6.0, 0.0), ForecastCommand(14.0, 0.0, -6.0, 0.0)
    assert passes(HOVER, m, away)
    assert not passes(HOVER, m, towards)


def test_a_longer_delay_steps_in_earlier() -> None:
    late = Filter.of(VEHICLE, FENCE, 0.15)
    m = state(x=4.4, v=3.5)
    assert passes(HOVER, m)
    assert not passes(HOVER, m, filter=late)
    for speed in (1.0, 4.0):
        assert stopping_distance(late, speed) == pytest.approx(stopping_distance(FILTER, speed) + 0.09 * speed)


def test_what_the_gyro_felt_since_the_odometry_counts() -> None:
    memory, seen = after()
    told = forecast(FILTER, memory, seen, 0.0)
    assert told.wy == pytest.approx(0.0, abs=1e-9) and told.qy == pytest.approx(0.0, abs=1e-9)
    for asked in (-0.05, -0.03, -0.01):  # a rate loop that overshoots: no command explains it
        memory = feel(memory, (0.0, 3.0, 0.0), asked)
    felt = forecast(FILTER, memory, seen, 0.0)
    assert 1.0 < felt.wy < 3.0  # the commands have 10 ms left to stop it
    assert 2 * felt.qy == pytest.approx(0.04 * 3.0 + 0.02, abs=0.03)
    old = feel(memory, (0.0, 9.0, 0.0), 0.7)  # after it, what was felt half a second ago is forgotten
    assert [at for at, _ in old.felt] == [0.7]
    keeper = Keeper(FILTER)
    keeper.feel(np.array([0.0, math.nan, 0.0]), 0.0)
    assert keeper.memory.felt == ()


def test_the_floor_is_open_to_a_policy_that_lands() -> None:
    memory, seen = after(m=state(z=0.5, vz=-0.8))
    assert filtered(FILTER, memory, seen, 0.0, HOVER, floor=True).share > 0
    assert filtered(FILTER, memory, seen, 0.0, HOVER, floor=False).share == 0


def test_a_solid_is_kept_away_from() -> None:
    box = (2.0, -1.0, 0.0, 3.0, 1.0, 6.0)
    filter = Filter.of(VEHICLE, dataclasses.replace(FENCE, solids=(box,)))
    flown = fly(state(x=0.5, v=2.5), 3.0, filter=filter)
    assert max(m.px for m in flown) < box[0] - float(VEHICLE.radius)
    memory, seen = after(m=state(x=1.2, v=2.5), filter=filter)
    _, change = keep(filter, memory, seen, 0.0, Ctbr(GRAVITY, Vec3(0.0, 0.0, 0.0)))
    assert change is not None and change.limit == "solid 1"
    assert passes(HOVER, state(x=1.2, v=2.5))  # without it
    far = (40.0, 40.0, 0.0, 41.0, 41.0, 1.0)  # is no limit here, and takes no name from the one that is
    behind = Filter.of(VEHICLE, dataclasses.replace(FENCE, solids=(far, box)))
    memory, seen = after(m=state(x=1.2, v=2.5), filter=behind)
    _, change = keep(behind, memory, seen, 0.0, Ctbr(GRAVITY, Vec3(0.0, 0.0, 0.0)))
    assert change is not None and change.limit == "solid 2"


SOLIDS = """
ground = false
[[solids]]
kind = "{kind}"
centre = [2.5, 0.0, 3.0]
size = {size}
{more}
"""


@pytest.mark.parametrize(
    ("kind", "size", "surface", "more"),
    [
        ("box", [0.5, 1.0, 3.0], 2.0, ""),
        ("sphere", [0.5], 2.0, ""),
        ("cylinder", [0.4, 3.0], 2.1, ""),
        ("cylinder", [0.4, 3.0], -0.5, "roll = 90\nyaw = -90"),
        ("capsule", [0.3, 3.0], 2.2, "path = { cosine = [0, 0, 1], rate = 0 }"),
    ],
)
def test_a_solid_of_a_scene_file_is_kept_away_from(
    tmp_path: Path, kind: str, size: list[float], surface: float, more: str
) -> None:
    scene = tmp_path / "room.toml"
    scene.write_text(SOLIDS.format(kind=kind, size=size, more=more))
    filter = Filter.of(VEHICLE, dataclasses.replace(FENCE, scene=str(scene)))
    flown = fly(state(x=surface - 1.5, v=2.0), 3.0, filter=filter)
    assert surface - 0.8 < max(m.px for m in flown) < surface - float(VEHICLE.radius)
    assert fly(state(x=surface - 1.5, v=2.0), 1.0)[-1].px > surface  # without it


def test_a_gate_is_flown_through_in_its_middle_and_not_at_its_bars(tmp_path: Path) -> None:
    scene = tmp_path / "room.toml"
    scene.write_text(SOLIDS.format(kind="gate", size=[0.9, 0.9, 0.3, 0.05], more="yaw = 180"))
    filter = Filter.of(VEHICLE, dataclasses.replace(FENCE, scene=str(scene)))
    assert max(m.px for m in fly(state(x=0.8, v=1.5), 3.0, filter=filter)) > 3.5
    beside = state(x=0.8, v=1.5)._replace(py=1.05)
    assert max(m.px for m in fly(beside, 3.0, filter=filter)) < 2.5 - float(VEHICLE.radius)


@pytest.mark.parametrize("kind", ["box", "sphere", "cylinder", "capsule", "gate", "pad"])
def test_gaps_are_the_distances_of_the_simulator_s_solids(tmp_path: Path, kind: str) -> None:
    random, scene = np.random.default_rng(0), tmp_path / "room.toml"
    size = random.uniform(0.2, 0.7, len(SIZES[kind])).round(2).tolist()
    for outline in (DISC, SQUARE) if kind == "pad" else (None,):
        size = [*size[:2], outline] if kind == "pad" else size
        scene.write_text(SOLIDS.format(kind=kind, size=size, more="roll = 20\npitch = -35\nyaw = 130"))
        places = random.uniform([1.0, -1.5, 1.5], [4.0, 1.5, 4.5], (400, 3))
        wanted = np.asarray(clearance(load_scene(scene, 400), jnp.asarray(places), jnp.zeros(400)))
        bodies = obstacles(dataclasses.replace(FENCE, scene=str(scene)))
        for place, distance in zip(places.tolist(), wanted.tolist(), strict=True):
            near = min((plane for body in bodies if (plane := body.plane(*place, 9.0))), key=lambda plane: plane.gap)
            assert near.gap == pytest.approx(distance, abs=2e-5)
            assert math.hypot(near.x, near.y, near.z) == pytest.approx(1.0)
            nearer = [p + 1e-4 * n for p, n in zip(place, (near.x, near.y, near.z), strict=True)]
            moved = min(plane.gap for body in bodies if (plane := body.plane(*nearer, 9.0)))
            assert moved == pytest.approx(near.gap - 1e-4, abs=1e-6)
            assert any(body.plane(*place, near.gap + 1e-6) for body in bodies)
            assert all(body.plane(*place, near.gap - 1e-6) is None for body in bodies)  # what is farther is left out


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (SOLIDS.format(kind="bol", size=[1.0], more=""), r"solids\[0\].kind: .*'bol'"),
        (SOLIDS.format(kind="sphere", size=[1.0], more="path = { sine = [0, 1, 0], rate = 2 }"),
         r"flight.fence.scene: .*solids\[0\].path.rate is 2 rad/s; accepted: solids that stand"),
    ],
)  # fmt: skip
def test_a_scene_file_that_cannot_be_kept_is_refused_by_name(tmp_path: Path, text: str, told: str) -> None:
    scene = tmp_path / "room.toml"
    scene.write_text(text)
    with pytest.raises(ValueError, match=told):
        Filter.of(VEHICLE, dataclasses.replace(FENCE, scene=str(scene)))


def test_a_loss_of_thrust_is_noticed_and_made_up_for() -> None:
    memory, m, now = FilterMemory(), state(), 0.0
    for k in range(60):
        now = k * DT
        memory = watch(FILTER, memory, odometry(m, now), now, flying=True)
        memory = remember(memory, HOVER, now)
        m = moved(SCALARS, FILTER.backup.response, m, HOVER, NOTHING._replace(share=0.8), STEP)
    assert memory.air.share == pytest.approx(0.8, abs=0.02)
    assert memory.air.x == pytest.approx(0.0, abs=0.01)
    lost, full = memory.air, NOTHING
    thrusts = [command(SCALARS, FILTER.backup, m, brake(SCALARS, FILTER.backup, m, air)).thrust for air in (full, lost)]
    assert thrusts[1] > 1.2 * thrusts[0]


def test_numbers_that_are_not_finite_are_refused_and_end_the_flight() -> None:
    memory, seen = after()
    with pytest.raises(FilterError, match="finite"):
        keep(FILTER, memory, seen, 0.0, Ctbr(math.nan, Vec3(0.0, 0.0, 0.0)))
    keeper = Keeper(FILTER)
    keeper.sent(None, -0.1)
    keeper.see(seen, 0.0, flying=True)
    assert keeper.keep(seen, 0.0, Ctbr(math.nan, Vec3(0.0, 0.0, 0.0)), floor=True) is None
    assert keeper.problem is not None and keeper.problem.startswith("filter: ")


@pytest.mark.parametrize("axis", [0, 1])
def test_a_fence_in_which_it_could_not_stop_is_refused_by_name(axis: int) -> None:
    low, high = list(FENCE.low), list(FENCE.high)
    low[axis], high[axis] = -1.0, 1.0
    small = dataclasses.replace(FENCE, low=tuple(low), high=tuple(high))
    with pytest.raises(ValueError, match=rf"flight.fence.speed is 6 m/s.*2 m long in {'xy'[axis]}; accepted: up to"):
        Filter.of(VEHICLE, small)
    accepted = Filter.of(VEHICLE, dataclasses.replace(small, speed=3.0))
    assert stopping_distance(accepted, 3.0) <= 2.0 < stopping_distance(accepted, 6.0)


@pytest.mark.parametrize("tilt", [1.0, 1.4])
@pytest.mark.parametrize("share", [1.0, 0.8])
@pytest.mark.parametrize("vz", [-6.0, -2.0, 0.0, 1.0, 4.0, 8.0])
@pytest.mark.parametrize("name", ["vis_r", "vis_h"])
def test_the_manoeuvre_stops_within_the_room_that_it_is_said_to_need(
    name: str, vz: float, share: float, tilt: float
) -> None:
    backup, air = Backup.of(load_vehicle(name), tilt), NOTHING._replace(share=share)
    limits = MarginLimits((0.0,) * 3, (0.0,) * 3, 99.0, math.inf)
    for v in (2.0, 5.0, 8.0, 12.0):
        begun = m = state(v=v, vz=vz)
        needed = backup.margin - rooms(SCALARS, backup, limits, m, NOTHING)[NAMES.index("x high")]
        farthest = 0.0
        for k in range(500):
            known = NOTHING._replace(share=max(share, 1.0 - 0.01 * k))  # a lost fifth is noticed within 0.2 s
            given = command(SCALARS, backup, m, brake(SCALARS, backup, m, known))
            m = moved(SCALARS, backup.response, m, given, air, STEP)
            farthest = max(farthest, m.px - begun.px)
        assert farthest < needed


WEAK = dataclasses.replace(VEHICLE, rotor_thrust_max=float(VEHICLE.mass) * GRAVITY / 4 * 1.4)


@pytest.mark.parametrize(
    ("vehicle", "fence", "told"),
    [
        (VEHICLE, {"high": (6.0, 6.0, 0.7)}, "stops within 0.[67] m, and the fence is 0.5 m high; accepted: a larger"),
        (VEHICLE, {"tilt": 0.3}, "flight.fence.tilt is 0.3 rad; accepted: 0.46 or more"),
        (WEAK, {}, "thrust is 1.40 of its weight; accepted: 2.50 or more"),
    ],
)
def test_what_cannot_brake_or_has_no_room_to_is_refused_by_name(vehicle: Vehicle, fence: dict, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        Filter.of(vehicle, dataclasses.replace(FENCE, **fence))
    Filter.of(VEHICLE, dataclasses.replace(FENCE, high=(6.0, 6.0, 1.0)))


def test_many_vehicles_at_once_are_filtered_as_each_alone() -> None:
    random = np.random.default_rng(0)
    n = 40
    p, v = random.uniform([-5, -5, -2], [5, 5, 8], (n, 3)), random.uniform(-3, 3, (n, 3))
    q = np.column_stack([np.full(n, 3.0), random.normal(size=(n, 3))])
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    wanted = np.column_stack([random.uniform(2, 25, n), random.uniform(-8, 8, (n, 3)) * [1, 1, 0.4]])
    w = random.uniform(-2, 2, (n, 3))
    memory = FilterMemory()
    for k in range(-20, 0):
        memory = remember(memory, HOVER, k * DT)
    many = Odometry(0.0, p, v, q, w)
    found = filtered(FILTER, watch(FILTER, memory, many, 0.0, flying=True), many, 0.0, ForecastCommand(*wanted.T))
    assert 5 < (found.share > 0).sum() < n
    for i in range(n):
        one = Odometry(0.0, p[i], v[i], q[i], w[i])
        alone = filtered(
            FILTER, watch(FILTER, memory, one, 0.0, flying=True), one, 0.0, ForecastCommand(*wanted[i].tolist())
        )
        np.testing.assert_allclose([x[i] for x in found.command], alone.command, rtol=1e-9, atol=1e-9)
        assert found.share[i] == pytest.approx(alone.share)
        if alone.share == 0.0:
            assert tuple(alone.command) == tuple(wanted[i].tolist())


# Reachability in one dimension: towards a wall in x, height held.

SPEEDS = np.linspace(-1.0, 10.0, 111)
TILTS = np.linspace(-1.0, 1.1, 106)
"""Leaning towards the wall positive, rad."""


def least_distance(rate: float, steepest: float, gust: float, h: float = 0.01) -> np.ndarray:
    """The room that the best control needs from a speed and a tilt, under the worst gust, (speeds, tilts), m.

    Height is held, so a lean of `tilt` accelerates by g tan(tilt); it turns by at most `rate` rad/s and leans by at
    most `steepest` rad. By value iteration: the room is the larger one of none, and of the way in a step and the room
    that is needed after it.
    """
    v, tilt = np.meshgrid(SPEEDS, TILTS, indexing="ij")
    acceleration = GRAVITY * np.tan(tilt) + gust
    after = np.clip(v + h * acceleration, SPEEDS[0], SPEEDS[-1])
    way = h * (v + 0.5 * h * acceleration)
    row = (after - SPEEDS[0]) / (SPEEDS[1] - SPEEDS[0])
    i = np.minimum(row.astype(int), len(SPEEDS) - 2)
    s = row - i
    options = []
    for turn in (-rate, 0.0, rate):
        to = np.clip(tilt + h * turn, max(-steepest, TILTS[0]), min(steepest, TILTS[-1]))
        column = (to - TILTS[0]) / (TILTS[1] - TILTS[0])
        j = np.minimum(column.astype(int), len(TILTS) - 2)
        options.append((j, column - j))
    room = np.zeros_like(v)
    for _ in range(600):
        reached = [
            (1 - s) * ((1 - t) * room[i, j] + t * room[i, j + 1])
            + s * ((1 - t) * room[i + 1, j] + t * room[i + 1, j + 1])
            for j, t in options
        ]
        new = np.maximum(way + np.minimum.reduce(reached), 0.0)
        if np.abs(new - room).max() < 1e-6:
            break
        room = new
    return room


def test_the_grid_s_least_distance_is_the_known_one_where_it_is_known() -> None:
    room = least_distance(rate=100.0, steepest=1.0, gust=0.0)
    level = np.argmin(np.abs(TILTS + 1.0))
    for speed in (2.0, 5.0, 8.0):
        k = np.argmin(np.abs(SPEEDS - speed))
        assert room[k, level] == pytest.approx(speed**2 / (2 * GRAVITY * math.tan(1.0)), abs=0.05)


@pytest.mark.parametrize("name", ["vis_r", "vis_h"])
def test_what_the_filter_admits_lies_inside_of_what_can_be_kept_in_one_dimension(name: str) -> None:
    vehicle = load_vehicle(name)
    backup = Backup.of(vehicle, 1.4)
    # the best that the vehicle could do with a fifth less thrust in a gust, its rotors and rate loop without a lag
    steepest = min(math.acos(GRAVITY / backup.most), 1.0)
    exact = least_distance(float(vehicle.body_rate_max[1]), steepest, GUST)
    limits = MarginLimits((-99.0, -99.0, -99.0), (0.0, 99.0, 99.0), 99.0, math.inf)
    needed = np.array([
        [-rooms(SCALARS, backup, limits, state(v=v, tilt=t), NOTHING)[NAMES.index("x high")] for t in TILTS]
        for v in SPEEDS
    ])  # fmt: skip
    needed += backup.margin
    assert (needed >= exact).all()
    ahead = SPEEDS > 1.0  # and it gives away no more room than lags, unseen losses and margins explain
    assert np.median((needed - exact)[ahead]) < 1.0
    assert UNSEEN < 1
