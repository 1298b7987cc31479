"""The filter of `fly --guard filter`: does it keep every limit, and what does it cost?

    python benchmarks/filter.py [--flights 10000] [--zoo 20] [--firmware 0] [--json FILE]

1. Flights of adversaries, of random commands and of policies of other courses, each in a fence of its own, with 90 ms
   of delay, gusts of 3 m/s and a fifth of the thrust less, which the filter is not told; then as many in which that
   fifth is lost at once, at a moment of the flight.
2. The zoo's own flights: in what share of the steps would the filter change their commands?
3. Time of a call.
4. Room: in what share of the fence may the vehicle fly at a speed, in any level direction?
5. With `--firmware N`: flights at walls through the real firmware.

Parts that are not flown anew stay as they are in the file.
"""

import dataclasses
import json
import time
from typing import Any

import numpy as np
from common import RESULTS, arguments, table, write
from filter_firmware import through_firmware
from filter_flights import KINDS, Seen, adversaries, drawn_fences, fly, swapped

from e2efly.control import Quat
from e2efly.flight.filter.filter import Filter, FilterMemory, compiled, filtered, remember, stopping_distance, watch
from e2efly.flight.filter.forecast import ForecastCommand
from e2efly.flight.pilot.fence import fence_problem
from e2efly.flight.pilot.hover import controlled, rates_of
from e2efly.flight.settings import Fence
from e2efly.policy.odometry import Odometry
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.validation.plant_validation import validate
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle

VEHICLE, LATENCY, FASTEST = "vis_r", 0.09, 10.0
SECONDS, BATCH = 8.0, 1000
FIRST_SEED = 30_000
"""Of the flights: margins and gains of the filter were set on those of smaller seeds."""
SHARE_SWAPPED = 0.05
"""Of the flights: those of the zoo's policies, which are slower to fly."""
ZOO = ("hover", "hover_aware", "land", "track", "gap", "race")
BESIDE = (1.0, 3.0, 4.0)
"""The zoo's flights have fences so far around all of them, m ..."""
SPARE = (1.0, 0.4)
"""... and so much more speed and tilt than they reach, m/s and rad."""


def campaign(flights: int, *, sudden: bool) -> list[dict[str, Any]]:
    """Part 1: a row for each kind of policy, with a fifth less thrust or, sudden, with a fifth lost in flight."""
    vehicle = load_vehicle(VEHICLE)
    filter = Filter.of(vehicle, Fence((-30.0,) * 3, (30.0,) * 3, speed=FASTEST), LATENCY)
    found: dict[str, list[Seen]] = {name: [] for name in (*KINDS, "another course")}
    some = round(SHARE_SWAPPED * flights)
    seed, left = FIRST_SEED, flights - some
    while left > 0:
        n = min(left, BATCH)
        kind = np.arange(n) % len(KINDS)
        fences = drawn_fences(n, filter, np.random.default_rng([seed, 1]), FASTEST)
        policy = adversaries(kind, vehicle, fences.speed, seed)
        seen = fly(vehicle, fences, policy, kind, seconds=SECONDS, latency=LATENCY, sudden=sudden, seed=seed)
        print(f"{n} flights, {seen.breach.sum()} breaches", flush=True)
        for i in np.flatnonzero(seen.breach):
            told = (seen.gap[i], seen.over_speed[i], seen.over_tilt[i], seen.top_speed[i])
            print(f"  seed {seed}, flight {i}, {KINDS[kind[i]]}: " + ", ".join(f"{x:.2f}" for x in told), flush=True)
        for i, name in enumerate(KINDS):
            found[name].append(picked(seen, kind == i))
        left, seed = left - n, seed + 1
    if some:
        fences = drawn_fences(some, filter, np.random.default_rng([seed, 1]), FASTEST)
        policy = swapped(some, vehicle)
        none = np.zeros(some, int)
        found["another course"].append(
            fly(vehicle, fences, policy, none, seconds=SECONDS, latency=LATENCY, sudden=sudden, seed=seed)
        )
    thrust = "lost in flight" if sudden else "missing"
    return [{"a fifth of the thrust": thrust, **row_of(name, seen)} for name, seen in found.items() if seen]


def picked(seen: Seen, mine: np.ndarray) -> Seen:
    """Some of the flights."""
    names = [f.name for f in dataclasses.fields(Seen) if f.name != "trace"]
    return Seen(**{name: getattr(seen, name)[mine] for name in names})


def row_of(name: str, parts: list[Seen]) -> dict[str, Any]:
    """A line of the table."""

    def all_(field: str) -> np.ndarray:
        return np.concatenate([getattr(part, field) for part in parts])

    return {
        "what flies": name,
        "flights": len(all_("gap")),
        "breaches": int(all_("breach").sum()),
        "nearest to the fence, m": f"{all_('gap').min():.2f}",
        "speed left, m/s": f"{-all_('over_speed').max():.2f}",
        "tilt left, rad": f"{-all_('over_tilt').max():.2f}",
        "fastest, m/s": f"{all_('top_speed').max():.1f}",
        "steps changed": f"{all_('changed').mean():.0%}",
    }


def zoo(episodes: int) -> list[dict[str, Any]]:
    """Part 2: a row for each task."""
    rows, vehicle = [], load_vehicle(VEHICLE)
    for task in ZOO:
        found = validate(task, "simulator", episodes, max_drop=100.0)
        flights = [flight for each in found.criteria.values() for flight in each.flights if len(flight.command)]
        mode, latency = found.candidate.policy.contract.action.mode, found.candidate.latency
        places = np.concatenate([flight.position for flight in flights])
        speed = max(float(np.linalg.norm(flight.velocity, axis=1).max()) for flight in flights)
        tilt = max(float(Quat.of(flight.quaternion).tilt().max()) for flight in flights)
        row = {
            "task": task, "flights": len(flights), "steps": sum(len(flight.command) for flight in flights),
            "top speed": f"{speed:.1f} m/s", "largest tilt": f"{tilt:.2f} rad",
        }  # fmt: skip
        for beside in BESIDE:
            low, high = (places.min(0) - beside).tolist(), (places.max(0) + beside).tolist()
            fence = Fence(low, high, max(speed + SPARE[0], 6.0), max(tilt + SPARE[1], 1.4))
            filter = Filter.of(vehicle, fence, latency)
            changed = sum(judged(filter, flight, mode, task == "land") for flight in flights)
            row[f"changed, fence {beside:g} m around"] = f"{changed / row['steps']:.2%}"
        rows.append(row)
        print(rows[-1], flush=True)
    return rows


def judged(filter: Filter, flight: Any, mode: str, lands: bool) -> int:
    """The steps of a flight in which the filter would change the command."""
    vehicle, memory, changed = load_vehicle(VEHICLE), FilterMemory(), 0
    for k in range(-20, 0):
        memory = remember(memory, ForecastCommand(GRAVITY, 0.0, 0.0, 0.0), k * 0.01)
    for k, command in enumerate(flight.command):
        now = float(flight.time[k])
        o = Odometry(now, flight.position[k], flight.velocity[k], flight.quaternion[k], flight.body_rate[k])
        memory = watch(filter, memory, o, now, flying=True)
        asked = controlled(vehicle, mode, o, command)
        wanted = ForecastCommand(float(asked.thrust), *rates_of(asked))
        changed += filtered(filter, memory, o, now, wanted, floor=not lands).share > 0
        memory = remember(memory, wanted, now)
    return changed


def timed(calls: int = 20000) -> list[dict[str, Any]]:
    """Part 3: seconds of the processor for a call of `watch`, `filtered` and `remember`."""
    filter = Filter.of(load_vehicle(VEHICLE), Fence((-5.0, -5.0, 0.2), (5.0, 5.0, 6.0), speed=6.0), LATENCY)
    formulas = {"compiled": compiled(filter), "in Python": filter}
    return [{"formulas": name, **row} for name, of in formulas.items() for row in timed_calls(of, calls)]


def timed_calls(filter: Filter, calls: int) -> list[dict[str, Any]]:
    """The same for a filter."""
    random, memory = np.random.default_rng(0), FilterMemory()
    for k in range(-20, 0):
        memory = remember(memory, ForecastCommand(GRAVITY, 0.0, 0.0, 0.0), k * 0.01)
    spent = {"passed": [], "changed": []}
    for k in range(calls):
        p, v = random.uniform([-4.5, -4.5, 0.5], [4.5, 4.5, 5.5]), random.uniform(-3, 3, 3)
        q = np.array([3.0, *random.normal(size=3)])
        now = k * 0.01
        o = Odometry(now, p, v, q / np.linalg.norm(q), random.uniform(-2, 2, 3))
        wanted = ForecastCommand(random.uniform(3, 20), *random.uniform(-5, 5, 3).tolist())
        began = time.thread_time_ns()
        memory = watch(filter, memory, o, now, flying=False)
        found = filtered(filter, memory, o, now, wanted)
        memory = remember(memory, found.command, now)
        spent["changed" if found.share else "passed"].append((time.thread_time_ns() - began) * 1e-6)
    both = spent["passed"] + spent["changed"]
    told = {name: times for name, times in {**spent, "all": both}.items() if times}
    return [
        {
            "commands": name, "calls": len(times), "p50, ms": f"{np.median(times):.2f}",
            "p99, ms": f"{np.quantile(times, 0.99):.2f}",
        }
        for name, times in told.items()
    ]  # fmt: skip


def room() -> list[dict[str, Any]]:
    """Part 4: shares of the default fence, by drawing places and directions."""
    rows, fence, random = [], Fence(), np.random.default_rng(0)
    low, high = np.array(fence.low), np.array(fence.high)
    for name in ("vis_r", "vis_h"):
        vehicle = load_vehicle(name)
        filter = Filter.of(vehicle, fence)
        memory = FilterMemory()
        for k in range(-20, 0):
            memory = remember(memory, ForecastCommand(GRAVITY, 0.0, 0.0, 0.0), k * 0.01)
        for speed in (1.0, 2.0, 4.0):
            counts = np.zeros(2)
            places, angles = random.uniform(low, high, (2000, 3)), np.linspace(0, 2 * np.pi, 16, endpoint=False)
            for p in places:
                free = np.array([True, True])
                for angle in angles:
                    v = speed * np.array([np.cos(angle), np.sin(angle), 0.0])
                    o = Odometry(0.0, p, v, np.array([1.0, 0, 0, 0]), np.zeros(3))
                    known = watch(filter, memory, o, 0.0, flying=True)
                    passes = filtered(filter, known, o, 0.0, ForecastCommand(GRAVITY, 0.0, 0.0, 0.0)).share == 0
                    free &= [fence_problem(fence, o) is None, passes]
                    if not free.any():
                        break
                counts += free
            switch, kept = counts / len(places)
            rows.append({
                "vehicle": name, "speed": f"{speed:g} m/s", "stops within": f"{stopping_distance(filter, speed):.2f} m",
                "switch": f"{switch:.1%}", "filter": f"{kept:.1%}", "times": f"{kept / switch:.1f}",
            })  # fmt: skip
            print(rows[-1], flush=True)
    return rows


def main() -> None:
    """Fly, print the tables, write the figures."""
    args = arguments(__doc__ or "", flights=10000, zoo=20, firmware=0)
    compute_at_once()
    prepare("cpu")
    path = args.json or RESULTS / "filter.json"
    content = json.loads(path.read_text()) if path.exists() else {}
    content = {key: value for key, value in content.items() if key not in ("machine", "date")}
    content["time"] = timed()
    content["room"] = room()
    if args.flights:
        content["table"] = [row for sudden in (False, True) for row in campaign(args.flights, sudden=sudden)]
    if args.zoo:
        content["zoo"] = zoo(args.zoo)
    if args.firmware:
        content["firmware"] = [through_firmware(args.firmware)]
    content["tables"] = [content[part] for part in ("zoo", "room", "time", "firmware") if part in content]
    for rows in (content.get("table", []), *content["tables"]):
        print(table(rows), end="\n\n")
    write("filter", args.json, content)


if __name__ == "__main__":
    main()
