"""Whole flights through the real firmware, as `e2efly validate --plant betaflight` shows them."""

import dataclasses
import math
import tempfile
from pathlib import Path

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from e2efly.commands.terminal import headed
from e2efly.flight.settings import Fence
from e2efly.tasks.route import Route, route_of
from e2efly.validation import firmware_program
from e2efly.validation.candidate import Candidate
from e2efly.validation.gate_pose import GateCamera
from e2efly.validation.rehearsal import Rehearsal, rehearse
from e2efly.validation.scenery import Scenery
from e2efly.vehicles.vehicle import Vehicle


def fly_whole(
    found: Candidate,
    vehicle: Vehicle,
    count: int,
    console: Console,
    seed: int = 0,
    *,
    route: Route | None = None,
    fence: Fence | None = None,
    gates: bool = False,
) -> list[Rehearsal]:
    """Take off, hover, hand over to the policy, and land: the given number of flights, each from another place.

    A policy with cameras flies in another world each time. The worlds come from the training environment of the first
    criterion, and so do the courses. Other policies fly the course of the route, or else the usual one. With `gates`
    there is no motion capture: the vehicle finds its place by the gates of the course.

    Raises:
        ValueError: for a course that the fence does not hold.
        OSError: when the firmware cannot be built or started.
    """
    kind = route_of(found.policy.contract)
    suite = next(iter(found.task.criteria().values()))
    env = found.environment(suite) if found.policy.contract.images else None
    built, flights = firmware_program.chosen(), []
    with console.status("whole flights through the firmware") as status, tempfile.TemporaryDirectory() as folder:
        for i in range(count):
            status.update(f"whole flight {i + 1} of {count} through the firmware")
            scenery = None if env is None else Scenery.draw(env, seed + i)
            if scenery is not None:
                route = dataclasses.replace(kind.drawn(scenery.course, Path(folder) / "track.toml"), outside=True)
            flights.append(rehearse(
                built, found.policy, vehicle, seed=seed + i, scenery=scenery, route=route, fence=fence,
                gates=GateCamera() if gates else None,
            ))  # fmt: skip
    return flights


def flights_table(flights: list[Rehearsal]) -> RenderableType:
    """One row for every flight. Below them, the modes of each incomplete flight, with the reason why each mode began.

    The table fits 80 columns. The modes of a complete flight are always the same and are only in its JSON.
    """
    table = headed("whole flight", "complete", "hover error", "policy", "top speed")
    for i, flight in enumerate(flights, 1):
        mark = Text("yes", "green") if flight.complete else Text("no", "bold red")
        error = "none" if math.isnan(flight.hover_error) else f"{100 * flight.hover_error:.1f} cm"
        table.add_row(str(i), mark, error, Text(flight.told), f"{flight.top_speed:.1f} m/s")
    return Group(table, *(_modes(i, flight) for i, flight in enumerate(flights, 1) if not flight.complete))


def _modes(number: int, flight: Rehearsal) -> RenderableType:
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 1, 0, 2))
    for mode, reason in zip(flight.modes, flight.reasons, strict=True):
        table.add_row(mode, Text(reason))
    return Group(Text(f"\nflight {number} was not complete; its modes, and why each began:"), table)
