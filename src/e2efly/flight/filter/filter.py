"""The filter: forecasts the vehicle over the delay, and changes a command only as much as the backup manoeuvre needs.

A command passes unchanged, bit for bit, if the backup manoeuvre after it would still keep every limit: fence, floor,
largest speed and tilt, solids. Otherwise it is moved towards the manoeuvre's own command by the smallest share that
keeps them. This is a backup-controller barrier (Singletary et al., Onboard safety guarantees for racing drones, 2022;
and Chen et al., Backup control barrier functions, 2021). The manoeuvre's path is in closed form where possible.
"""

import itertools
import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from typing import Any

from e2efly.flight.filter.arithmetic import SCALARS, Number, clip
from e2efly.flight.filter.backup import TIMING, Backup, axes_z
from e2efly.flight.filter.backup_path import stopping
from e2efly.flight.filter.forecast import (
    NOTHING,
    Actuators,
    ForecastCommand,
    ForecastMotion,
    GyroReading,
    Residual,
    Response,
    Stretch,
    actuated,
    advanced,
    measured,
)
from e2efly.flight.filter.judgement import judged
from e2efly.flight.filter.margins import NAMES, MarginLimits, halves, near, rooms
from e2efly.flight.filter.native import SOLIDS, Native
from e2efly.flight.pose.neighbours import OtherVehicle
from e2efly.flight.settings import Fence
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

AIR_S, AIR_MOST = 0.4, 4.0
"""The acceleration that the forecast does not explain is averaged over the first value, s, and is at most the second
value per axis, m/s^2."""
SHARE_S, SHARES = 0.2, (0.6, 1.3)
"""The ratio of actual to commanded thrust is averaged over this time, s, and stays within these limits. It is only
measured ..."""
SHARE_SEEN = 4.0
"""... while the commanded thrust is at least this, m/s^2."""
LONGEST = 0.02
"""The longest step of the forecast, s."""
OLDEST = 0.5
"""Commands that were sent longer ago than this no longer act, s."""
FELT_S = 0.03
"""The largest time between two gyro replies from which the angular acceleration is computed, s."""


@dataclass(frozen=True)
class Filter:
    """The vehicle, the limits and the latency for which commands are filtered. Create it with `Filter.of`."""

    backup: Backup
    limits: MarginLimits
    latency: float
    """The time from the vehicle's motion to its rate loop, s."""
    native: Native | None = field(default=None, compare=False)
    """The formulas as machine code, for floats. None: Python computes them."""

    @staticmethod
    def of(vehicle: Vehicle, fence: Fence, latency: float | None = None) -> "Filter":
        """The filter for a loaded vehicle in a fence.

        Raises:
            ValueError: naming the field, for a vehicle that cannot brake or a fence in which it could not stop.
        """
        backup = Backup.of(vehicle, fence.tilt)
        limits = MarginLimits.of(fence, float(vehicle.radius), backup.margin)
        filter = Filter(backup, limits, float(vehicle.latency if latency is None else latency))
        _check(filter, fence)
        return filter


def compiled(filter: Filter) -> Filter:
    """The same filter with its formulas as machine code.

    Raises:
        OSError: without a C compiler, or if it fails.
    """
    return replace(filter, native=Native(filter.backup, filter.limits))


def fastest(filter: Filter) -> tuple[Filter, str | None]:
    """The filter as machine code where that can be made. Otherwise as it is, and why."""
    try:
        return compiled(filter), None
    except OSError as error:
        return filter, str(error)


def stopping_distance(filter: Filter, speed: float) -> float:
    """The distance to a wall, m, that level flight at a speed, m/s, needs to stop: for the delay, the manoeuvre and the
    margin.
    """
    return speed * (filter.latency + TIMING) + stopping(filter.backup, speed) + filter.backup.margin


def stopping_height(filter: Filter, speed: float) -> float:
    """The height between floor and ceiling, m, that level flight at a speed, m/s, needs to stop, with both margins."""
    b, m = (
        filter.backup,
        ForecastMotion(0.0, 0.0, 0.0, speed, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY),
    )
    here = (0.0, 0.0, 0.0)
    left = rooms(SCALARS, b, MarginLimits(here, here, speed, math.inf), m, NOTHING)
    return 2 * b.margin - left[NAMES.index("floor")] - left[NAMES.index("ceiling")]


def _check(filter: Filter, fence: Fence) -> None:
    sizes = [high - low for low, high in zip(fence.low, fence.high, strict=True)]
    for size, needed, what in (
        (sizes[0], stopping_distance, "long in x"),
        (sizes[1], stopping_distance, "long in y"),
        (sizes[2], stopping_height, "high"),
    ):
        if size < (least := needed(filter, fence.speed)):
            fastest = _fastest(filter, needed, size, fence.speed)
            accepted = "a larger fence" if fastest is None else f"up to {fastest:.1f} m/s, or a larger fence"
            raise ValueError(
                f"guard 'filter': flight.fence.speed is {fence.speed:g} m/s, from which the vehicle stops within "
                f"{least:.1f} m, and the fence is {size:g} m {what}; accepted: {accepted}"
            )


def _fastest(filter: Filter, needed: Callable[[Filter, float], float], size: float, below: float) -> float | None:
    """The largest speed below `below`, m/s, from which the vehicle stops within a size, m, in steps of 0.1. None: no
    speed does.
    """
    speeds = [tenth / 10 for tenth in range(1, math.ceil(10 * below))]
    return max(itertools.takewhile(lambda speed: needed(filter, speed) <= size, speeds), default=None)


@dataclass(frozen=True)
class FilterMemory:
    """What the filter remembers from step to step."""

    sent: tuple[tuple[float, ForecastCommand], ...] = ()
    """When each command was sent, s, and the command, which holds until the next one. Oldest first."""
    actuators: Actuators | None = None
    """The state of the rotors at the newest odometry, from the commands that act by then. None: no command was sent."""
    stamp: float = -math.inf
    """Time of the newest odometry, s."""
    velocity: tuple[Number, Number, Number] | None = None
    """Its velocity, world, m/s."""
    since: float = 0.0
    """When it arrived, s."""
    air: Residual = NOTHING
    """What the forecast does not explain."""
    felt: tuple[tuple[float, tuple[float, float, float]], ...] = ()
    """When each reading of the flight controller's gyro was requested, s, and its body rate, rad/s. Oldest first."""


@dataclass(frozen=True)
class Filtered:
    """The result of filtering a command."""

    command: ForecastCommand
    share: Number
    """Share of the change towards the manoeuvre's command. 0: the command passed unchanged."""
    room: Number
    """The smallest room that the manoeuvre would have left after the wanted command, m. NaN if a number is not
    finite."""
    limit: Any
    """The index of that limit in `room.NAMES`. Indices beyond it refer to `solids`."""
    solids: tuple[str, ...] = ()
    """Names of the nearby solids."""

    @property
    def name(self) -> str:
        """Name of that limit. Only for a single vehicle."""
        return (*NAMES, *self.solids)[self.limit]


def remember(memory: FilterMemory, sent: ForecastCommand, now: float) -> FilterMemory:
    """The memory after a command was sent. Sending the same command again changes nothing."""
    kept = memory.sent
    if kept and isinstance(sent.thrust, float) and kept[-1][1] == sent:
        return memory
    while len(kept) > 1 and kept[1][0] < now - OLDEST:
        kept = kept[1:]
    return replace(memory, sent=(*kept, (now, sent)))


def feel(memory: FilterMemory, rate: tuple[float, float, float], asked: float) -> FilterMemory:
    """The memory after a gyro reading, rad/s, that was requested at the control step of `asked` s."""
    kept = tuple(one for one in memory.felt if asked - OLDEST < one[0] < asked)
    return replace(memory, felt=(*kept, (asked, rate)))


def watch(filter: Filter, memory: FilterMemory, odometry: Odometry, now: float, *, flying: bool) -> FilterMemory:
    """The memory after the newest odometry, which may be the same as before. The odometry has position and velocity
    (*n, 3), quaternion (*n, 4) and body rate (*n, 3). `now` is in s. While `flying`, only the air carries the vehicle.
    """
    if odometry.time == memory.stamp or not memory.sent:
        return memory
    v = odometry.velocity
    xp, velocity = _apart(v)
    before = memory.actuators
    if before is None:
        zero = 0.0 * velocity[0]
        before = Actuators(zero, zero, zero, zero, zero, zero + GRAVITY)
    after = before
    r = filter.backup.response
    for command, step, _ in _between(r, memory.sent, memory.since - filter.latency, now - filter.latency):
        after = actuated(xp, r, after, command, step)
    air = memory.air
    dt = odometry.time - memory.stamp
    if not flying:
        air = NOTHING
    elif memory.velocity is not None and 0.0 < dt < 0.1:
        axis = axes_z(*_apart(odometry.quaternion)[1])
        air = _felt(xp, air, memory.velocity, velocity, axis, 0.5 * (before.f + after.f), dt)
    return replace(memory, actuators=after, stamp=odometry.time, velocity=velocity, since=now, air=air)


def _felt(
    xp: Any,
    air: Residual,
    v0: tuple[Number, ...],
    v1: tuple[Number, ...],
    axis: tuple[Number, ...],
    f: Number,
    dt: float,
) -> Residual:
    """The unexplained part of a change of velocity in dt s: along the thrust as its share, across the thrust as the
    air's push.
    """
    bx, by, bz = axis
    thrust = air.share * f
    ex = (v1[0] - v0[0]) / dt - thrust * bx - air.x
    ey = (v1[1] - v0[1]) / dt - thrust * by - air.y
    ez = (v1[2] - v0[2]) / dt - thrust * bz - air.z + GRAVITY
    along = ex * bx + ey * by + ez * bz
    k, seen = min(dt / AIR_S, 1.0), f > SHARE_SEEN
    change = xp.where(seen, min(dt / SHARE_S, 1.0) * along / xp.maximum(f, SHARE_SEEN), 0.0)
    return Residual(
        clip(xp, air.x + k * (ex - along * bx), -AIR_MOST, AIR_MOST),
        clip(xp, air.y + k * (ey - along * by), -AIR_MOST, AIR_MOST),
        clip(xp, air.z + k * (ez - along * bz), -AIR_MOST, AIR_MOST),
        clip(xp, air.share + change, *SHARES),
    )


def forecast(filter: Filter, memory: FilterMemory, odometry: Odometry, now: float) -> ForecastMotion:
    """The state at which a command that is sent now begins to act."""
    xp, (px, py, pz) = _apart(odometry.position)
    _, (vx, vy, vz) = _apart(odometry.velocity)
    _, (qw, qx, qy, qz) = _apart(odometry.quaternion)
    _, (wx, wy, wz) = _apart(odometry.body_rate)
    a = memory.actuators
    ax, ay, f = (0.0, 0.0, GRAVITY) if a is None else (a.ax, a.ay, a.f)
    m = ForecastMotion(px, py, pz, vx, vy, vz, qw, qx, qy, qz, wx, wy, wz, ax, ay, f)
    first, stretches = _stretches(filter, memory, now)
    m = measured(xp, m, first)
    if filter.native is not None and xp is SCALARS:
        return filter.native.forecast(m, memory.air, stretches)
    for stretch in stretches:
        m = advanced(xp, filter.backup.response, m, memory.air, stretch)
    return m


def _stretches(filter: Filter, memory: FilterMemory, now: float) -> tuple[GyroReading | None, list[Stretch]]:
    """What acts from the odometry until a command of now begins to: the commands on their way, and the gyro's readings,
    each at the end of a stretch. The first one returned was read at the odometry's own time. None: none was.
    """
    r, begin, before, found = filter.backup.response, memory.since - filter.latency, None, list[Stretch]()
    first: GyroReading | None = None
    for at, rate in memory.felt:
        if begin < at <= now:
            found += _between(r, memory.sent, begin, at)
            reading = _reading(rate, at, before)
            if found:
                found[-1] = found[-1]._replace(reading=reading)
            else:
                first = reading
            begin, before = at, (at, rate)
    return first, found + _between(r, memory.sent, begin, now)


def _reading(rate: tuple[float, float, float], at: float, before: tuple[float, Any] | None) -> GyroReading:
    """A gyro reading, with the angular acceleration since the previous one."""
    if before is None or not 0.0 < at - before[0] < FELT_S:
        return GyroReading(*rate, 0.0, 0.0, 0.0)
    ax, ay = ((rate[i] - before[1][i]) / (at - before[0]) for i in range(2))
    return GyroReading(*rate, 1.0, ax, ay)


def filtered(
    filter: Filter, memory: FilterMemory, odometry: Odometry, now: float, wanted: ForecastCommand, *,
    floor: bool = True, others: Sequence[OtherVehicle] = (),
) -> Filtered:  # fmt: skip
    """The command nearest to the wanted one that keeps all limits. `memory` is that after `watch`. `now` is in s.
    `wanted` has floats or (n,) each, within the vehicle's limits. `floor` tells whether the lowest height of the fence
    counts. `others`: the other vehicles now; only for a single vehicle.
    """
    xp = _apart(odometry.position)[0]
    m = forecast(filter, memory, odometry, now)
    solids = near(filter.limits, m, _reach(m)) if filter.limits.solids else ()
    if others:
        solids += halves(filter.limits, m, others, filter.latency, _reach(m))
    if filter.native is not None and xp is SCALARS and len(solids) <= SOLIDS:
        found = filter.native.judge(m, memory.air, wanted, solids, floor)
    else:
        found = judged(xp, filter.backup, filter.limits, m, memory.air, wanted, solids, floor)
    return Filtered(*found, tuple(plane.name for plane in solids))


def _between(r: Response, sent: tuple[tuple[float, ForecastCommand], ...], begin: float, end: float) -> list[Stretch]:
    """The commands that held from `begin` to `end`, s, each for a time. Before the first command, the first one
    counts.
    """
    parts: list[Stretch] = []
    first = max(bisect_right(sent, begin, key=itemgetter(0)) - 1, 0)
    past = max(bisect_left(sent, end, key=itemgetter(0)), min(len(sent), 1))
    for i in range(first, past):
        start = begin if i == first else sent[i][0]
        stop = min(sent[i + 1][0], end) if i + 1 < len(sent) else end
        if (whole := stop - start) > 1e-6:
            count = max(math.ceil(whole / LONGEST - 1e-6), 1)
            parts += [Stretch(sent[i][1], r.step(round(whole / count, 5)))] * count
    return parts


def _reach(m: ForecastMotion) -> float:
    """Solids farther away than this do not matter for any manoeuvre, m."""
    speed = math.sqrt(m.vx**2 + m.vy**2 + m.vz**2)
    return 2.0 + speed + 0.2 * speed**2


def _apart(rows: Any) -> tuple[Any, tuple[Number, ...]]:
    """The functions to compute with, and the components: floats for an array (k,), arrays (n,) for an array (n, k)."""
    if rows.ndim == 1:
        return SCALARS, tuple(rows.tolist())
    import numpy as np

    return np, tuple(rows[:, i] for i in range(rows.shape[1]))
