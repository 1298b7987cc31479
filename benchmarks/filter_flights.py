"""Flights of many vehicles at once against the filter of `fly --guard filter`: the physics, the air, the adversaries.

The body is the simulator's own: drag, mixer, rotors, rate loop. The filter knows the vehicle's file and the delay; it
is not told of the wind, nor of the thrust that is lost in flight, nor of the noise of the poses.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.flight.filter.backup import Backup
from e2efly.flight.filter.filter import Filter, Filtered, FilterMemory, filtered, remember, stopping_distance, watch
from e2efly.flight.filter.forecast import ForecastCommand
from e2efly.flight.filter.margins import NAMES, MarginLimits
from e2efly.flight.pilot.hover import controlled, rates_of
from e2efly.flight.settings import Fence
from e2efly.policy.loader import load_policy
from e2efly.policy.odometry import Odometry
from e2efly.policy.runtime import Imu, Runtime, act, begin
from e2efly.simulation.physics import State
from e2efly.simulation.physics.step import Physics, step
from e2efly.tasks.route import course_for
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

RATE = 100.0
"""Control steps a second, Hz."""
NOISE = (0.0005, 0.01, 0.02, 0.001)
"""Of position, m; velocity, m/s; body rate, rad/s; attitude, rad: a motion capture system's, standard deviations."""
WIND, GUST_S = 3.0, 2.0
"""Largest speed of the air, m/s, and the mean time between its gusts, s."""
LOSS = 0.2
"""Share of the thrust that is lost, from the begin or from a moment of the flight on."""
KINDS = ("rush", "wander", "random", "dive", "climb", "swing", "last step", "spin")
"""What flies: at a wall as fast as it goes; by random velocities; by random thrusts and rates; at the floor; at the
ceiling; with the largest rates to and fro; at a wall, and with the largest rate and thrust towards it once the filter
acts; at a wall while turning about the vertical."""


@dataclass
class Seen:
    """What a study has found, one entry a flight."""

    kind: np.ndarray
    """Index in `KINDS`."""
    gap: np.ndarray
    """Least distance to the fence, m; negative outside."""
    over_speed: np.ndarray
    """Largest speed less the fence's, m/s."""
    over_tilt: np.ndarray
    """Largest tilt less the fence's, rad."""
    changed: np.ndarray
    """Share of the steps in which the filter changed the command."""
    top_speed: np.ndarray
    """m/s."""
    limits: np.ndarray
    """(n, limits) share of the steps in which each limit was the reason."""
    trace: list[dict[str, Any]] = field(default_factory=list)
    """Of the flights that are asked for."""

    @property
    def breach(self) -> np.ndarray:
        """Whether a flight left the fence, or was faster or steeper than it allows."""
        return (self.gap < 0) | (self.over_speed > 0) | (self.over_tilt > 0)


SWAPPED = ("hover", "land", "track", "gap", "race")
"""Policies of the zoo that fly their own course, wherever the fence is."""
Policy = Callable[[int, Odometry, np.ndarray], np.ndarray]
"""(step, what is seen, whether the filter acted in the last step) -> (n, 4) thrust over mass and body rates."""


def pointed(o: Odometry, force: np.ndarray, rate_max: np.ndarray, gain: float = 10.0) -> np.ndarray:
    """Thrust and rates that point the thrust along a force over mass (n, 3), world, m/s^2."""
    w, x, y, z = o.quaternion.T
    bz = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], 1)
    bx = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], 1)
    by = np.cross(bz, bx)
    size = np.linalg.norm(force, axis=1)
    to = force / size[:, None]
    axis, cosine = np.cross(bz, to), (bz * to).sum(1)
    sine = np.linalg.norm(axis, axis=1) + 1e-9
    turn = axis * (gain * np.arctan2(sine, cosine) / sine)[:, None]
    rates = np.stack([(turn * bx).sum(1), (turn * by).sum(1), 0 * size], 1)
    return np.column_stack([size * np.maximum(cosine, 0), np.clip(rates, -rate_max, rate_max)])


@dataclass(frozen=True)
class Fences:
    """The fences of a study, one a flight."""

    low: np.ndarray
    """(n, 3) m."""
    high: np.ndarray
    speed: np.ndarray
    """(n,) m/s."""
    tilt: float
    """rad."""

    def limits(self, radius: float, margin: float) -> MarginLimits:
        """As the filter takes them."""
        one = MarginLimits.of(Fence(low=(0.0,) * 3, high=(0.0,) * 3, speed=0.0, tilt=self.tilt), radius, margin)
        low = tuple(self.low[:, i] + one.low[i] for i in range(3))
        high = tuple(self.high[:, i] + one.high[i] for i in range(3))
        return MarginLimits(low, high, self.speed + one.speed, one.tilt)  # type: ignore[arg-type]

    def gap(self, position: np.ndarray) -> np.ndarray:
        """Distance to the nearest wall, m; negative outside."""
        return np.minimum(position - self.low, self.high - position).min(1)


def adversaries(kind: np.ndarray, vehicle: Vehicle, top: np.ndarray, seed: int) -> Policy:
    """All kinds of `KINDS`, a flight each."""
    n, random = len(kind), np.random.default_rng([seed, 7])
    rate_max, most = np.asarray(vehicle.body_rate_max), 4 * vehicle.thrust_range[1] / vehicle.mass
    heading = random.uniform(-np.pi, np.pi, n)
    to = np.stack([np.cos(heading), np.sin(heading), random.uniform(-0.3, 0.3, n)], 1)
    velocity, held = np.zeros((n, 3)), np.zeros((n, 4))
    left, steep = np.zeros(n), random.uniform(0.6, 1.35, n)
    period, doomed = random.uniform(0.1, 0.8, n), np.full(n, False)

    def policy(k: int, o: Odometry, acted: np.ndarray) -> np.ndarray:
        nonlocal left, velocity, held, doomed
        left = left - 1 / RATE
        new = left <= 0
        left = np.where(new, np.where(kind == 2, random.uniform(0.03, 0.6, n), random.uniform(0.3, 2.5, n)), left)
        d = random.normal(size=(n, 3))
        d *= (top * random.uniform(0.3, 1.2, n) / np.linalg.norm(d, axis=1))[:, None]
        velocity = np.where(new[:, None], d, velocity)
        rates = random.uniform(-1, 1, (n, 3)) * rate_max
        held = np.where(new[:, None], np.column_stack([random.uniform(0, most, n), rates]), held)
        up = np.array([0.0, 0.0, GRAVITY])
        fast = np.linalg.norm(o.velocity[:, :2], axis=1) > top
        side = GRAVITY * np.tan(np.where(fast, 0.0, steep))
        rush = pointed(o, to * [1, 1, 0] * side[:, None] + up + (to * [0, 0, 3] - o.velocity * [0, 0, 2]), rate_max)
        wander = pointed(o, np.maximum(4 * (velocity - o.velocity) + up, [-99, -99, 0.2]), rate_max)
        dive = pointed(o, 0.3 * up + to * [4, 4, 0], rate_max)
        dive[:, 0] = np.where(steep > 1.0, 0.0, dive[:, 0])
        climb = pointed(o, 99 * up + to * [30, 30, 0], rate_max)
        climb[:, 0] = most
        wave = np.sign(np.sin(2 * np.pi * k / RATE / period))
        swing = np.column_stack([np.full(n, most * 0.6), wave * rate_max[0], -wave * rate_max[1], 0 * wave])
        doomed = doomed | acted
        w, x, y, z = o.quaternion.T
        bx = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], 1)
        forward = np.sign((bx * to).sum(1))
        last = np.column_stack([np.full(n, most), 0 * w, forward * rate_max[1], 0 * w])
        last = np.where(doomed[:, None], last, rush)
        spin = rush.copy()
        spin[:, 3] = rate_max[2]
        stack = np.stack([rush, wander, held, dive, climb, swing, last, spin])
        return stack[kind, np.arange(n)]

    return policy


def swapped(n: int, vehicle: Vehicle) -> Policy:
    """The zoo's policies of `SWAPPED`, in turn: each flies its own course, which knows nothing of the fence."""
    runtimes = []
    for i in range(n):
        acts = load_policy(SWAPPED[i % len(SWAPPED)])
        runtimes.append(Runtime.of(acts, course_for(acts.contract, vehicle), vehicle, imu=True))
    states: list[Any] = [None] * n
    held = np.tile([GRAVITY, 0.0, 0.0, 0.0], (n, 1))
    imu = Imu(np.zeros(3), np.array([0.0, 0.0, GRAVITY]))

    def policy(k: int, o: Odometry, acted: np.ndarray) -> np.ndarray:
        del acted
        for i, runtime in enumerate(runtimes):
            one = Odometry(o.time, o.position[i], o.velocity[i], o.quaternion[i], o.body_rate[i])
            states[i] = begin(runtime, one, o.time) if states[i] is None else states[i]
            if k % round(RATE * runtime.period) == 0:
                states[i], decision = act(runtime, states[i], one, o.time, imu)
                wanted = controlled(vehicle, decision.mode, one, decision.command)
                held[i] = [wanted.thrust, *rates_of(wanted)]
        return held.copy()

    return policy


def fly(
    vehicle: Vehicle,
    fences: Fences,
    policy: Policy,
    kind: np.ndarray,
    *,
    seconds: float,
    latency: float,
    believed: float | None = None,
    sudden: bool = True,
    seed: int = 0,
    filters: bool = True,
    watched: tuple[int, ...] = (),
) -> Seen:
    """Fly all at once, each from rest at a place of its own.

    Args:
        vehicle: that flies.
        fences: one a flight.
        policy: what flies.
        kind: of each flight, for the report.
        seconds: of each flight.
        latency: from motion to rate loop, s.
        believed: what the filter takes it for, s; None: the same.
        sudden: whether the thrust is lost at once in flight, and not before it.
        seed: of starts, air, noise.
        filters: whether the filter acts.
        watched: flights whose steps are kept.
    """
    n, random = len(kind), np.random.default_rng(seed)
    backup = Backup.of(vehicle, fences.tilt)
    filter = Filter(backup, fences.limits(float(vehicle.radius), backup.margin), believed or latency)
    physics = Physics.of(vehicle, "ctbr", control_rate=RATE)
    room = np.minimum(1.0, (fences.high - fences.low) * 0.3)
    position = random.uniform(fences.low + room, fences.high - room)
    state = State(
        *(jnp.asarray(x, jnp.float32) for x in (
            position, np.zeros((n, 3)), np.tile([1.0, 0, 0, 0], (n, 1)), np.zeros((n, 3)),
            np.full((n, 4), vehicle.hover_rotor_speed),
        ))
    )  # fmt: skip
    advance = jax.jit(lambda s, c, w, r: step(physics, physics.nominal, s, c, wind=w, rotor_share=r))
    hover = np.tile([GRAVITY, 0.0, 0.0, 0.0], (n, 1))
    late = round(latency * RATE)
    sent, memory = deque([hover] * late), FilterMemory()
    for i in range(20):
        memory = remember(memory, _command(hover), (i - 20) / RATE)
    wind, lost_at = np.zeros((n, 3)), random.uniform(0, seconds / 2, n) if sudden else np.full(n, -1.0)
    gap, over_speed, over_tilt, top_speed = np.full(n, np.inf), np.full(n, -np.inf), np.full(n, -np.inf), np.zeros(n)
    changed, limits, acted = np.zeros(n), np.zeros((n, len(NAMES))), np.full(n, False)
    trace: list[dict[str, Any]] = []
    steps = round(seconds * RATE)
    for k in range(steps):
        now = k / RATE
        p, v, q, w = (
            np.asarray(x, np.float64) for x in (state.position, state.velocity, state.quaternion, state.body_rate)
        )
        gap, speed = np.minimum(gap, fences.gap(p)), np.linalg.norm(v, axis=1)
        tilt = np.arccos(np.clip(1 - 2 * (q[:, 1] ** 2 + q[:, 2] ** 2), -1, 1))
        over_speed, top_speed = np.maximum(over_speed, speed - fences.speed), np.maximum(top_speed, speed)
        over_tilt = np.maximum(over_tilt, tilt - fences.tilt)
        noisy = [x + s * random.normal(size=x.shape) for x, s in zip((p, v, w), NOISE[:3], strict=True)]
        q = q + NOISE[3] / 2 * random.normal(size=q.shape)
        o = Odometry(now, noisy[0], noisy[1], q / np.linalg.norm(q, axis=1, keepdims=True), noisy[2])
        wanted = policy(k, o, acted)
        given, f = wanted, None
        if filters:
            memory = watch(filter, memory, o, now, flying=True)
            f = filtered(filter, memory, o, now, _command(wanted))
            given = np.stack(f.command, 1)
            acted = f.share > 0
            changed += acted
            limits[np.arange(n), f.limit] += acted
            memory = remember(memory, f.command, now)
        for i in watched:
            trace.append(_line(i, k, memory, wanted, given, f, p, v, tilt))
        sent.append(given)
        gust = random.uniform(size=n) < 1 / (GUST_S * RATE)
        fresh = random.normal(size=(n, 3))
        fresh *= (WIND * random.uniform(size=n) ** 0.3 / np.linalg.norm(fresh, axis=1))[:, None]
        wind = np.where(gust[:, None], fresh, wind)
        share = np.tile(np.where(now > lost_at, 1 - LOSS, 1.0)[:, None], (1, 4))
        state = advance(state, *(jnp.asarray(x, jnp.float32) for x in (sent.popleft(), wind, share)))
    return Seen(kind, gap, over_speed, over_tilt, changed / steps, top_speed, limits / steps, trace)


def _command(rows: np.ndarray) -> ForecastCommand:
    return ForecastCommand(*rows.T)


def _line(i: int, k: int, memory: FilterMemory, wanted: np.ndarray, given: np.ndarray, f: Filtered | None,
          p: np.ndarray, v: np.ndarray, tilt: np.ndarray) -> dict[str, Any]:  # fmt: skip
    told = {} if f is None else {"room": f.room[i], "limit": NAMES[f.limit[i]], "share": f.share[i]}
    told["air"] = [np.broadcast_to(x, len(p))[i] for x in memory.air]
    return {
        "flight": i,
        "step": k,
        "p": p[i],
        "v": v[i],
        "tilt": tilt[i],
        "wanted": wanted[i],
        "given": given[i],
        **told,
    }


def drawn_fences(n: int, filter: Filter, random: np.random.Generator, fastest: float) -> Fences:
    """Fences in which a vehicle can stop from their largest speed, 3 to `fastest` m/s."""
    speed = random.uniform(3.0, fastest, n)
    least = np.array([stopping_distance(filter, s) for s in speed])
    size = np.stack([random.uniform(least, 30.0), random.uniform(least, 30.0), random.uniform(2.5, 12.0, n)], 1)
    low = np.stack([-size[:, 0] / 2, -size[:, 1] / 2, np.full(n, 0.2)], 1)
    return Fences(low, low + size, speed, 1.4)
