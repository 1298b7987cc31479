"""Hardware in the loop without hardware, in real time: laps by sight, and each process killed once in flight.

    python benchmarks/hil_rehearsal.py [--policies race_clutter] [--vehicle vis_r] [--laps 20] [--seed 0] [--speed 4 6]
        [--link-delay S] [--json FILE]
    python benchmarks/hil_rehearsal.py --room [--laps 20] ...

As `e2efly hil POLICY --rehearse`: motion capture over UDP, the HIL node, `e2efly fly` with its watchdog, and the real
firmware are processes. Let the machine be quiet. Exit status 1 when fewer than 19 of 20 laps of a policy succeed, when
99 % of the images come later than 15 ms after their pose, or when a kill ends otherwise than documented. `--speed` is
the commanded speed of race_clutter, m/s, drawn for each lap; without numbers as the task draws it. `--link-delay` is
the radio's, as the command takes it; left out: what the vehicle's latency leaves. `--room` flies in a
room of 6x6x3 m: the policy, the worlds and the fence that firmware_flights.py has there.
"""

import sys
import tempfile
from argparse import Namespace
from pathlib import Path
from typing import get_args

from common import arguments, table, write
from firmware_flights import FENCE, IN_ROOM

from e2efly.simulation.device import prepare
from e2efly.validation import firmware_program
from e2efly.validation.candidate import candidate
from e2efly.validation.hil_lap import Lap, Spread
from e2efly.validation.processes import Victim, flags
from e2efly.validation.rehearse_hil import RehearsalPlan, rehearse

WANTED, WANTED_S = 0.95, 0.015
"""Share of laps with success, and pose to image (99 %), s."""


def main() -> None:
    """Fly, print the tables, write the figures."""
    args = arguments(
        __doc__ or "", policies=["race_clutter"], vehicle="vis_r", laps=20, seed=0, speed=[4.0, 6.0], link_delay=None,
        room=False,
    )  # fmt: skip
    if args.room:
        args.policies = [IN_ROOM["race_clutter"][0]]
    prepare("cpu")
    firmware_program.chosen()
    laps, kills, rows, ends = dict[str, list[Lap]](), list[Lap](), list[dict[str, str]](), list[dict[str, str]]()
    with tempfile.TemporaryDirectory() as text:
        for name in args.policies:
            plan = _plan(name, args)
            laps[name] = [
                _fly(plan, args.seed + i, Path(text) / f"{Path(name).stem}-{i}", None) for i in range(args.laps)
            ]
            rows.append(_row(name, laps[name]))
        plan = _plan(args.policies[0], args)
        for i, kill in enumerate(get_args(Victim)):
            kills.append(_fly(plan, args.seed + i, Path(text) / f"kill-{kill}", kill))
            ends.append(_end(kills[-1]))
    print(table(rows))
    print(table(ends))
    every = {name: [lap.as_json() for lap in flown] for name, flown in laps.items()}
    killed = [lap.as_json() for lap in kills]
    write(
        "hil_room" if args.room else "hil_rehearsal",
        args.json,
        {"table": rows, "tables": [ends], "laps": every, "killed": killed},
    )
    few = any(sum(lap.success for lap in flown) < WANTED * args.laps for flown in laps.values())
    late = any(lap.pose_to_image.p99 > WANTED_S for flown in laps.values() for lap in flown)
    sys.exit(1 if few or late or any(lap.problems for lap in kills) else 0)


def _plan(name: str, args: Namespace) -> RehearsalPlan:
    own = candidate(name, args.vehicle)
    changed = {"speed": tuple(args.speed)} if args.speed and own.task.name == "race_clutter" else {}
    found = candidate(name, args.vehicle, task=changed)
    delay = None if args.link_delay is None else float(args.link_delay)
    fence = FENCE if args.room else None
    return RehearsalPlan(found, world=flags("task", found.task, own.task), link_delay=delay, fence=fence)


def _fly(plan: RehearsalPlan, seed: int, folder: Path, kill: Victim | None) -> Lap:
    lap = rehearse(plan, seed, folder, kill)
    print(plan.found.file.stem, seed, kill or "", lap.told, lap.problems or "ok", flush=True)
    return lap


def _row(name: str, laps: list[Lap]) -> dict[str, str]:
    """Of all laps of a policy that were begun: the worst lap's 99 %, and the maximum."""
    laps = [lap for lap in laps if lap.begun]
    parts = {
        "pose to image": "pose_to_image", "age of images": "image_age", "then to the sticks": "to_stick",
        "age of poses": "pose_age", "steps late": "lateness", "room behind": "behind",
    }  # fmt: skip
    return {
        "policy": name, "success": f"{sum(lap.success for lap in laps)} of {len(laps)}",
        "top speed": f"{max((lap.top_speed for lap in laps), default=0.0):.1f} m/s",
        **{told: _ms([getattr(lap, part) for lap in laps]) for told, part in parts.items()},
    }  # fmt: skip


def _ms(spreads: list[Spread]) -> str:
    known = [x for x in spreads if x.p99 == x.p99]  # a lap that was not flown has none
    middle, worst = (max((getattr(x, name) for x in known), default=0.0) for name in ("median", "p99"))
    return f"{1e3 * middle:.1f} / {1e3 * worst:.1f} ms"


def _end(lap: Lap) -> dict[str, str]:
    after = [change for change in lap.changes if change.time > lap.window[0]]
    said = f"{after[0].mode}: {'; '.join(after[0].reasons)}" if after else "the watchdog lands it"
    return {
        "killed": str(lap.kill), "what happens": said, "after": f"{1e3 * lap.reaction:.0f} ms" if after else "",
        "touches the ground": f"{lap.touch_speed:.1f} m/s, sinking at {lap.touch_sink:.1f} m/s",
        "problems": "; ".join(lap.problems) or "none",
    }  # fmt: skip


if __name__ == "__main__":
    main()
