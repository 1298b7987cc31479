"""The filter: forecasts the vehicle over the delay, and changes a command no more than the backup manoeuvre needs.

A command passes, bit for bit, if after it the backup manoeuvre would still keep every limit: fence, floor, largest
speed and tilt, solids. Otherwise it is moved towards the manoeuvre's own command, by the smallest share that does. This
is a backup-controller barrier (Singletary et al., Onboard safety guarantees for racing drones, 2022; and Chen et al.,
Backup control barrier functions, 2021), with the manoeuvre's way in closed form where it can be.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from e2efly.deploy.filter.arithmetic import SCALARS, Number, clip
from e2efly.deploy.filter.backup import TIMING, Backup, axes_z, brake, command
from e2efly.deploy.filter.body import NOTHING, Actuators, Command, Motion, Residual, actuated, moved
from e2efly.deploy.filter.room import NAMES, Limits, against, near, retreat, rooms
from e2efly.deploy.filter.way import stopping
from e2efly.deploy.odometry import Odometry
from e2efly.deploy.settings import Fence
from e2efly.vehicles.vehicle import GRAVITY, Vehicle

HOLD = 0.01
"""A command is judged as if it were held for so long, s."""
HALVINGS = 3
"""How often the share of the change is halved: to an eighth."""
AIR_S, AIR_MOST = 0.4, 4.0
"""Acceleration that the forecast leaves out is averaged over so long, s, and is at most so much an axis, m/s^2."""
SHARE_S, SHARES = 0.2, (0.6, 1.3)
"""The thrust over that of the command is averaged over so long, s, and stays within these; it is seen only ..."""
SHARE_SEEN = 4.0
"""... while the command's is at least so much, m/s^2."""
LONGEST = 0.02
"""Longest step of the forecast, s."""
OLDEST = 0.5
"""Commands that were sent so long ago act no more, s."""
FELT_S = 0.03
"""Answers of the gyro that are no farther apart tell the angular acceleration, s."""


@dataclass(frozen=True)
class Filter:
    """What is filtered for. Make it with `Filter.of`."""

    backup: Backup
    limits: Limits
    latency: float
    """From the vehicle's motion to its rate loop, s."""

    @staticmethod
    def of(vehicle: Vehicle, fence: Fence, latency: float | None = None) -> "Filter":
        """Of a loaded vehicle in a fence.

        Raises:
            ValueError: naming the field, for a vehicle that cannot brake, or a fence in which it could not stop.
        """
        backup = Backup.of(vehicle, fence.tilt)
        limits = Limits.of(fence, float(vehicle.radius), backup.margin)
        filter = Filter(backup, limits, float(vehicle.latency if latency is None else latency))
        _check(filter, fence)
        return filter


def stopping_distance(filter: Filter, speed: float) -> float:
    """Room that level flight at a speed, m/s, needs before a wall, m: the delay, the manoeuvre, and the margin."""
    return speed * (filter.latency + TIMING) + stopping(filter.backup, speed) + filter.backup.margin


def stopping_height(filter: Filter, speed: float) -> float:
    """Height that level flight at a speed, m/s, needs between floor and ceiling to stop in, m, with both margins."""
    b, m = filter.backup, Motion(0.0, 0.0, 0.0, speed, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY)
    here = (0.0, 0.0, 0.0)
    left = rooms(SCALARS, b, Limits(here, here, speed, math.inf), m, NOTHING)
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
    """The largest speed below another, m/s, that stops within a size, m, in steps of 0.1; None: none does."""
    speeds = [tenth / 10 for tenth in range(1, math.ceil(10 * below))]
    return max(itertools.takewhile(lambda speed: needed(filter, speed) <= size, speeds), default=None)


@dataclass(frozen=True)
class Memory:
    """What the filter remembers from step to step."""

    sent: tuple[tuple[float, Command], ...] = ()
    """When each command was sent, s, and the command, which holds until the next; oldest first."""
    actuators: Actuators | None = None
    """What the commands that act in the newest odometry have made of the rotors; None: none was sent."""
    stamp: float = -math.inf
    """Of the newest odometry, s."""
    velocity: tuple[Number, Number, Number] | None = None
    """Its velocity, world, m/s."""
    since: float = 0.0
    """When it came, s."""
    air: Residual = NOTHING
    """What the forecast does not explain."""
    felt: tuple[tuple[float, tuple[float, float, float]], ...] = ()
    """When the flight controller's gyro was asked, s, and the body rate that it felt, rad/s; oldest first."""


@dataclass(frozen=True)
class Filtered:
    """What became of a command."""

    command: Command
    share: Number
    """Of the change towards the manoeuvre's command; 0: it passed as it was."""
    room: Number
    """The least that the manoeuvre would have left after the command as it came, m; NaN after what is not finite."""
    limit: Any
    """The index of that limit in `room.NAMES`; beyond them: in `solids`."""
    solids: tuple[str, ...] = ()
    """Names of the solids that were near."""

    @property
    def name(self) -> str:
        """Of that limit, of one vehicle alone."""
        return (*NAMES, *self.solids)[self.limit]


def remember(memory: Memory, sent: Command, now: float) -> Memory:
    """The memory after a command was sent; the same one once more changes nothing."""
    kept = memory.sent
    if kept and isinstance(sent.thrust, float) and kept[-1][1] == sent:
        return memory
    while len(kept) > 1 and kept[1][0] < now - OLDEST:
        kept = kept[1:]
    return replace(memory, sent=(*kept, (now, sent)))


def feel(memory: Memory, rate: tuple[float, float, float], asked: float) -> Memory:
    """The memory after an answer of the gyro, rad/s, that was asked for with the command of `asked` s."""
    kept = tuple(one for one in memory.felt if asked - OLDEST < one[0] < asked)
    return replace(memory, felt=(*kept, (asked, rate)))


def watch(filter: Filter, memory: Memory, odometry: Odometry, now: float, *, flying: bool) -> Memory:
    """The memory after the newest odometry, which may be the one of before.

    Args:
        filter: the filter.
        memory: so far.
        odometry: position, velocity (*n, 3), quaternion (*n, 4), body rate (*n, 3).
        now: s.
        flying: whether nothing but the air carries the vehicle.
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
    for c, h in _between(memory.sent, memory.since - filter.latency, now - filter.latency):
        after = actuated(xp, filter.backup.response, after, c, h)
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
    """What is not explained after a change of velocity in dt s: along the thrust by its share, across it by the air."""
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


def forecast(filter: Filter, memory: Memory, odometry: Odometry, now: float) -> Motion:
    """The state at which a command acts that is sent now."""
    xp, (px, py, pz) = _apart(odometry.position)
    _, (vx, vy, vz) = _apart(odometry.velocity)
    _, (qw, qx, qy, qz) = _apart(odometry.quaternion)
    _, (wx, wy, wz) = _apart(odometry.body_rate)
    a = memory.actuators
    ax, ay, f = (0.0, 0.0, GRAVITY) if a is None else (a.ax, a.ay, a.f)
    m = Motion(px, py, pz, vx, vy, vz, qw, qx, qy, qz, wx, wy, wz, ax, ay, f)
    begin, before = memory.since - filter.latency, None
    felt = [one for one in memory.felt if begin < one[0] <= now]
    for at, rate in (*felt, (now, None)):
        for c, h in _between(memory.sent, begin, at):
            m = moved(xp, filter.backup.response, m, c, memory.air, h)
        if rate is not None:
            m, begin, before = _turning(m, rate, at, before), at, (at, rate)
    return m


def _turning(m: Motion, rate: tuple[float, float, float], at: float, before: tuple[float, Any] | None) -> Motion:
    """The state with the body rate that was felt, and the angular acceleration since the answer before."""
    ax, ay = m.ax, m.ay
    if before is not None and 0.0 < at - before[0] < FELT_S:
        ax, ay = ((rate[i] - before[1][i]) / (at - before[0]) for i in range(2))
    return m._replace(wx=rate[0], wy=rate[1], wz=rate[2], ax=ax, ay=ay)


def filtered(
    filter: Filter, memory: Memory, odometry: Odometry, now: float, wanted: Command, *, floor: bool = True
) -> Filtered:
    """The command that keeps all limits, as near to the wanted one as it goes.

    Args:
        filter: the filter.
        memory: after `watch`.
        odometry: the newest.
        now: s.
        wanted: thrust over mass and body rates, floats or (n,) each, within the vehicle's limits.
        floor: whether the lowest height of the fence counts.
    """
    xp = _apart(odometry.position)[0]
    b, r, air = filter.backup, filter.backup.response, memory.air
    m = forecast(filter, memory, odometry, now)
    solids = near(filter.limits, m, _reach(m)) if filter.limits.solids else ()

    def left(c: Command) -> tuple[Number, ...]:
        after = moved(xp, r, m, c, air, HOLD)
        return rooms(xp, b, filter.limits, after, air, solids, floor, m)

    found = left(wanted)
    names = tuple(plane.name for plane in solids)
    if xp is SCALARS and min(found) >= 0.0:
        return Filtered(wanted, 0.0, *_worst(xp, found), names)
    back = retreat(xp, filter.limits, m, floor)
    own = command(xp, b, m, brake(xp, b, m, against(xp, m, air), back))
    short, limit = _worst(xp, found)
    share = _least(xp, lambda s: _worst(xp, left(_between_two(wanted, own, s)))[0], 0.0 * short)
    passes = short >= 0.0
    share = xp.where(passes, 0.0, share)
    given = Command(*(
        xp.where(passes, a, xp.where(share >= 1.0, c, a + share * (c - a))) for a, c in zip(wanted, own, strict=True)
    ))  # fmt: skip
    return Filtered(given, share, short, limit, names)


def _worst(xp: Any, rooms: tuple[Number, ...]) -> tuple[Number, Any]:
    """The least room, and the index of its limit."""
    if xp is SCALARS:
        least = min(rooms)
        return least, rooms.index(least)
    stacked = xp.stack(rooms)
    return stacked.min(axis=0), stacked.argmin(axis=0)


def _least(xp: Any, spare: Any, zero: Number) -> Number:
    """The least share, of eighths, by which a command must be changed so that enough is left; 1 where none does."""
    low, high = zero, zero + 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        good = spare(middle) >= 0.0
        low, high = xp.where(good, low, middle), xp.where(good, middle, high)
    return high


def _between_two(a: Command, b: Command, share: Number) -> Command:
    return Command(*(x + share * (y - x) for x, y in zip(a, b, strict=True)))


def _between(sent: tuple[tuple[float, Command], ...], begin: float, end: float) -> list[tuple[Command, float]]:
    """The commands that held from `begin` to `end`, s, and for how long; before the first one held the first."""
    parts: list[tuple[Command, float]] = []
    for i, (at, c) in enumerate(sent):
        start = begin if i == 0 else max(at, begin)
        stop = min(sent[i + 1][0], end) if i + 1 < len(sent) else end
        if (whole := stop - start) > 1e-6:
            count = max(math.ceil(whole / LONGEST - 1e-6), 1)
            parts += [(c, round(whole / count, 5))] * count
    return parts


def _reach(m: Motion) -> float:
    """Solids farther away than this matter to no manoeuvre, m."""
    speed = math.sqrt(m.vx**2 + m.vy**2 + m.vz**2)
    return 2.0 + speed + 0.2 * speed**2


def _apart(rows: Any) -> tuple[Any, tuple[Number, ...]]:
    """What computes, and the components: floats of an array (k,), arrays (n,) of one (n, k)."""
    if rows.ndim == 1:
        return SCALARS, tuple(rows.tolist())
    import numpy as np

    return np, tuple(rows[:, i] for i in range(rows.shape[1]))
