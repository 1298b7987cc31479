"""`e2efly hil --rehearse`."""

import math
import signal
import time
from dataclasses import MISSING, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from e2efly.commands.hil_options import Hil
from e2efly.commands.terminal import Terminal, headed
from e2efly.config.budget import check_time
from e2efly.config.storage import held, write_json
from e2efly.courses.origin import Origin
from e2efly.flight.process import raise_at_interrupt
from e2efly.flight.settings import Fence

if TYPE_CHECKING:
    from e2efly.validation.hil_lap import Lap, Spread

LAP_S = 30.0
"""Minimum duration of a flight, including the start of its processes, s."""
LATEST_S = 0.2
"""Largest `--pose-delay` and `--link-delay`, s."""
WANTED_S = 0.015
"""Wanted delay from a pose to its image in 99 of 100 cases, s. A longer delay is reported."""
LATE_S = 0.01
"""If control steps and the room are later than this in 99 of 100 cases, the machine is too slow or too busy, s."""
STALL_S = 0.05
"""The same holds if a single one is later than this, s."""
REHEARSALS, OWN = (
    ("laps", "kill", "pose_delay", "link_delay", "out"),
    ("pose", "image", "seconds", "json", "track", "watch"),
)
"""Options for rehearsals only, and options that a rehearsal sets itself."""


def check_rehearsal(o: Hil) -> None:
    """Refuse options that have no effect, and numbers out of range.

    Raises:
        ValueError: naming the option, its value and what is accepted.
    """
    usual = {f.name: f.default for f in fields(o) if f.default is not MISSING}
    for name in OWN if o.rehearse else REHEARSALS:
        if (value := getattr(o, name)) != usual[name]:
            said = "left out with" if o.rehearse else "only with"
            raise ValueError(f"--{name.replace('_', '-')} is {value}; accepted: {said} --rehearse")
    if o.laps < 1:
        raise ValueError(f"--laps is {o.laps}; accepted: 1 or more")
    for name, value in (("pose-delay", o.pose_delay), ("link-delay", o.link_delay or 0.0)):
        if not 0 <= value <= LATEST_S:
            raise ValueError(f"--{name} is {value}; accepted: 0 to {LATEST_S:g} s")
    check_time({f"--laps is {o.laps}": o.laps * LAP_S}, f"at {LAP_S:g} s each")


def rehearse(o: Hil, task: dict[str, Any], origin: Origin, fence: Fence | None) -> int:
    """Fly, print a table, and write a report and pictures.

    Args:
        o: the options.
        task: values of the task that differ from the policy's own, by dotted name.
        origin: position and turn of the world's origin in the room.
        fence: the fence of the room. None: it is far away.

    Returns:
        0, or 1 when a flight did not go as required.

    Raises:
        ValueError: naming the option, its value and what is accepted.
    """
    from e2efly.simulation.device import prepare
    from e2efly.validation import firmware_program
    from e2efly.validation.candidate import candidate
    from e2efly.validation.processes import flags
    from e2efly.validation.rehearse_hil import RehearsalPlan, draw
    from e2efly.validation.rehearse_hil import rehearse as fly
    from e2efly.validation.scene_files import SceneFile
    from e2efly.viewing.hil_plots import plot_lap, plot_times

    raise_at_interrupt()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # the flight's processes end with this one
    prepare("cpu")
    found, console = candidate(o.policy, o.vehicle, task=task), Terminal()
    for note in found.notes:
        console.print(note, style="dim")
    world = flags("task", found.task, candidate(o.policy, o.vehicle).task)
    plan = RehearsalPlan(found, origin, o.rate, o.pose_delay, o.link_delay, world, fence=fence)
    if o.scene is not None:
        plan = replace(plan, scene=SceneFile(o.scene, o.scene_unit, o.scene_up, o.scene_materials, o.beside))
    if not plan.found.policy.contract.images:
        raise ValueError(f"policy {o.policy} sees nothing; accepted: a policy with images")
    folder = o.out or Path("rehearsals") / time.strftime("%Y-%m-%d_%H-%M-%S")
    with held(folder):
        if (report := folder / "report.json").exists():
            raise ValueError(f"--out {folder} holds an earlier rehearsal; accepted: another folder")
        firmware_program.chosen()  # built now rather than in a process that is waited for
        laps = list["Lap"]()
        with console.status("") as status:
            for i in range(o.laps):
                seed = o.seed + i
                status.update(f"flight {i + 1} of {o.laps}, in real time")
                lap = fly(plan, seed, folder / f"flight-{seed}", o.kill)
                laps.append(lap)
                drawn = draw(plan, seed, folder / f"flight-{seed}" / "track.toml")
                plot_lap(lap, drawn.scenery.scene, drawn.course.origin, folder / f"flight-{seed}.png")
                write_json(report, as_json(laps))
        plot_times(laps, folder / "times.png")
    console.print(laps_table(laps))
    for line in told(laps):
        console.print(line)
    console.print(f"Report and pictures: {folder}")
    return 0 if all(lap.good for lap in laps) else 1


def as_json(laps: "list[Lap]") -> dict[str, Any]:
    """The report."""
    good, begun = sum(lap.success for lap in laps), sum(lap.begun for lap in laps)
    not_begun = len(laps) - begun
    return {"flights": begun, "not_begun": not_begun, "success": good, "laps": [lap.as_json() for lap in laps]}


def laps_table(laps: "list[Lap]") -> Table:
    """A row for every flight."""
    table = headed("world", "", "policy", "top speed", "pose to image", "image age", "steps late", "room behind")
    for lap in laps:
        mark = Text("ok", "green") if lap.good else Text("no", "bold red")
        spreads = lap.pose_to_image, lap.image_age, lap.lateness, lap.behind
        table.add_row(str(lap.seed), mark, Text(lap.told), f"{lap.top_speed:.1f} m/s", *map(_ms, spreads))
    return table


def told(laps: "list[Lap]") -> list[str]:
    """The remarks under the table."""
    lines = ["Times: 99 % of them are shorter, ms. Medians and maxima are in the report."]
    if any(lap.kill is None for lap in laps):
        whole = [lap for lap in laps if lap.kill is None and lap.begun]
        lines.append(f"{sum(lap.success for lap in whole)} of {len(whole)} flights with success.")
    if missing := sum(not lap.begun for lap in laps):
        lines.append(f"{missing} of {len(laps)} flights were not begun, and count as none.")
    for lap in laps:
        if lap.kill is not None:
            lines.append(f"world {lap.seed}, {lap.kill} killed: {_ended(lap)}")
        lines += [f"world {lap.seed}: {problem}" for problem in lap.problems]
    slow = [lap for lap in laps if _busy(lap)]
    late = [lap for lap in laps if lap.pose_to_image.p99 > WANTED_S]
    if slow:
        lines.append(
            f"The machine was too slow or too busy in {len(slow)} of {len(laps)} flights: control steps or the room "
            f"were late by more than {1e3 * LATE_S:g} ms (p99), or once by more than {1e3 * STALL_S:g} ms. What went "
            "wrong there says little of the policy."
        )
    elif late:
        share = f"{len(late)} of {len(laps)} flights"
        lines.append(f"Images came later than {1e3 * WANTED_S:g} ms after their pose (p99) in {share}.")
    return lines


def _ended(lap: "Lap") -> str:
    """What happened after a kill."""
    after = [f"{c.mode.upper()} ({'; '.join(c.reasons)})" for c in lap.changes if c.time > lap.window[0]]
    first = f"after {1e3 * lap.reaction:.0f} ms " if math.isfinite(lap.reaction) else ""
    return (
        f"{first}{', then '.join(after[:4]) or 'no word of the bridge'}; "
        f"touched the ground at {lap.touch_speed:.1f} m/s, sinking at {lap.touch_sink:.1f} m/s"
    )


def _ms(spread: "Spread") -> str:
    return "none" if math.isnan(spread.p99) else f"{1e3 * spread.p99:.1f}"


def _busy(lap: "Lap") -> bool:
    """Whether the machine was too slow or too busy for a flight."""
    both = lap.lateness, lap.behind
    return max(x.p99 for x in both) > LATE_S or max(x.largest for x in both) > STALL_S
