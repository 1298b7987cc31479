"""Whole flights through the real firmware, as `e2efly validate --plant betaflight` shows them."""

import dataclasses
import math
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from e2efly.deploy.goal_options import GoalOptions, goal_for
from e2efly.deploy.policy import Policy
from e2efly.validate import firmware
from e2efly.validate.rehearsal import Rehearsal, rehearse
from e2efly.vehicles import Vehicle

LAPS = 3
"""Of a race."""


def fly_whole(policy: Policy, vehicle: Vehicle, count: int, console: Console, seed: int = 0) -> list[Rehearsal]:
    """Take off, hover, hand over to the policy, land: so many times, from another place each.

    Raises:
        OSError: when the firmware cannot be built or started.
    """
    race = policy.contract.task == "race"
    options = dataclasses.replace(GoalOptions(), laps=LAPS) if race else GoalOptions()
    goal = goal_for(policy.contract, options, vehicle)
    built, flights = firmware.chosen(), []
    with console.status("whole flights through the firmware") as status:
        for i in range(count):
            status.update(f"whole flight {i + 1} of {count} through the firmware")
            flights.append(rehearse(built, policy, goal, vehicle, seed=seed + i))
    return flights


def flights_table(flights: list[Rehearsal]) -> Table:
    """A row for every flight."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in ("whole flight", "complete", "hover error", "policy", "top speed", "modes"):
        table.add_column(heading)
    for i, flight in enumerate(flights):
        mark = Text("yes", "green") if flight.complete else Text("no", "bold red")
        modes = " ".join(flight.modes) if flight.complete else "; ".join(flight.reasons)
        table.add_row(
            str(i + 1), mark, f"{100 * flight.hover_error:.1f} cm", _told(flight), f"{flight.top_speed:.1f} m/s", modes
        )
    return table


def flight_row(flight: Rehearsal) -> dict[str, Any]:
    """A flight as JSON: all of it but its track; what there is none of is null."""
    row = {f.name: getattr(flight, f.name) for f in dataclasses.fields(flight) if f.name != "flown"}
    return {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in row.items()}


def _told(flight: Rehearsal) -> str:
    if flight.gates:
        return f"{flight.laps:g} laps, {flight.lap_time:.2f} s each"
    if not math.isnan(flight.touch[0]):
        return f"touched {100 * flight.touch[0]:.1f} cm off at {flight.touch[1]:.2f} m/s"
    return "none" if math.isnan(flight.policy_error) else f"{100 * flight.policy_error:.1f} cm off"
