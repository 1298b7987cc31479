"""`e2efly validate`."""

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.table import Table

from e2efly.commands.policies import Asked, asked_of
from e2efly.commands.rows import check_stress, report_stress
from e2efly.commands.terminal import Terminal, headed, seconds
from e2efly.config import TaskConfig
from e2efly.config.budget import check_time
from e2efly.config.storage import write_atomically, write_json
from e2efly.policy.zoo import beside
from e2efly.vehicles.vehicle import Controller

if TYPE_CHECKING:
    from e2efly.validation.candidate import Candidate
    from e2efly.validation.plant_validation import Validation

WHOLE_S = 1.0
"""Minimum duration of a whole flight with the firmware, s."""


@dataclass(frozen=True)
class Validate:
    """Fly a policy on another plant, from the starts of `eval`. The exit status is 1 if success drops too far."""

    policy: tyro.conf.Positional[Annotated[Path, tyro.conf.arg(metavar="POLICY")]]
    """A run directory, a policy.onnx, or a task. A task selects its policy in the zoo: the one for --vehicle if the zoo
    has that vehicle, otherwise of the nearest mass. `any/hover` is the policy for any vehicle."""
    plant: str = "mujoco"
    """The plant that flies: simulator (our own, with the bridge's runtime), mujoco, betaflight (the real firmware with
    our rigid-body model), airsim:HOST:PORT (a running AirSim), or your own plant, path/to/plant.py:Name."""
    episodes: int | None = None
    """Number of starts per criterion. If omitted, 200; 20 for betaflight and airsim; 10 per row of --stress."""
    flights: int = 3
    """With the firmware: number of additional whole flights, from take-off to landing. Not with --stress."""
    out: Path | None = None
    """Folder for the plots. If omitted, the folder `validation` beside the policy."""
    max_drop: float = 2.0
    """Largest allowed drop of the success rate below that of the training simulator, in percentage points. Use --least
    with --stress."""
    json: Path | None = None
    """Write the report to this file, with one row for every start. Some flights are written beside it, for `e2efly
    watch`."""
    log: Path | None = None
    """Folder for a CSV log of each flight, for `e2efly identify flight`. Not with --stress."""
    image: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Cameras of AirSim that provide the policy's images: IMAGE=plant:CAMERA, or for a mask
    IMAGE=plant:CAMERA:RED,GREEN,BLUE with its colour in AirSim's segmentation. Other images are rendered from the
    task's world. Not with --stress. See docs/airsim.md."""
    pose: Literal["truth", "gates"] = "truth"
    """Who tells the policy where it is. truth: the plant. gates: the pose source gates:, which sees the gates of the
    track by a rendered racing camera and has an IMU. See docs/eyes.md."""
    seed: int = 1_000_000
    """Seed of the starts."""
    vehicle: str | None = None
    """The vehicle that flies: a name or a .toml file. If omitted, the policy's own vehicle. The policy is not
    changed."""
    baseline: str | None = None
    """Controller that flies in place of the policy, under the policy's contract: a hover controller (pid, geometric,
    indi, mpc), or your own, path/to/file.py:Name. For hover, hover_aware, land, track and race."""
    controller: Controller = "policy"
    """The vehicle for which the flight controller is tuned. policy: the policy's own vehicle, whatever flies. plant:
    the vehicle that flies."""
    task: TaskConfig = TaskConfig()
    """Options of the policy's task, as in `train` (--task.track four_gates). They replace the values from the run or
    the contract. Not with --stress."""
    stress: bool = False
    """Fly the rows of `eval --stress` on the plant: vehicles, air and sensors that differ from the training. Rows that
    the plant cannot reproduce are listed. See docs/robustness.md."""
    rows: tuple[str, ...] = ()
    """Names of the rows of --stress. If omitted, all rows that the plant can reproduce."""
    least: float | None = None
    """Return exit status 1 if the success rate in any row of --stress is below this, such as 0.9."""


def parse(arguments: list[str]) -> Asked:
    """The options of `validate`. The defaults of `--task` come from the policy's run or contract.

    Raises:
        ValueError: for unknown names, and for a policy that does not exist.
    """
    asked = asked_of(Validate, "validate", arguments)
    if asked.task and asked.options.stress:
        raise ValueError(f"--task.{next(iter(asked.task))} is given with --stress; accepted: one of them")
    return asked


def run(asked: Asked) -> int:
    """Fly policy.onnx with the bridge's runtime on another plant. Print a table; write the report and the plots.

    Returns:
        0. 1 if the success rate drops by more than `max_drop` in any criterion, if a whole flight is not complete, or
        if a row of the stress succeeds less often than `least`.
    """
    options = asked.options
    check_stress(options.stress, options.rows, options.least)
    if options.stress:
        return _stress(options)
    from e2efly.validation.plant_validation import validate
    from e2efly.viewing.kept import flights_file, packed
    from e2efly.viewing.validation import flown_again, plot_validation

    o, console = options, Terminal()
    if o.flights < 0:
        raise ValueError(f"--flights is {o.flights}; accepted: 0 or more")
    check_time({f"--flights is {o.flights}": o.flights * WHOLE_S}, f"at {WHOLE_S:g} s each")
    with _progress(o.plant, console) as progress:
        found = validate(
            o.policy,
            o.plant,
            o.episodes,
            vehicle=o.vehicle,
            controller=o.controller,
            task=asked.task,
            seed=o.seed,
            max_drop=o.max_drop,
            log=o.log,
            image=o.image,
            progress=progress,
            baseline=o.baseline,
            pose=o.pose,
        )
    for note in found.notes():
        console.print(note, style="dim")
    console.print(_table(found))
    folder = _folder(o, found.candidate)
    pairs = flown_again(found)
    plot_validation(found, pairs, folder)
    console.print(f"Plots: {folder}")
    if o.json:
        write_atomically(flights_file(o.json), packed(pairs))
        write_json(o.json, found.as_json())
        console.print(f"Report: {o.json} (in a browser: e2efly watch {o.json})")
    if o.log:
        console.print(f"Logs: {o.log}")
    whole = _whole_flights(found, o.flights, console, o.pose)
    if not found.passed:
        console.print(
            f"{found.worst}: success drops by {found.criteria[found.worst].drop:.1f} points", style="bold red", end=", "
        )
        console.print(f"{o.max_drop:g} are allowed")
    return 0 if whole and found.passed else 1


def _stress(o: Validate) -> int:
    from e2efly.validation.plant_stress import FLIGHTS, stress

    if o.log:
        raise ValueError(f"--log is {o.log}; accepted without --stress")
    if o.image:
        raise ValueError(f"--image is {o.image[0]!r}; accepted without --stress")
    for field in dataclasses.fields(Validate):
        if field.name in ("flights", "max_drop") and getattr(o, field.name) != field.default:
            option = field.name.replace("_", "-")
            raise ValueError(f"--{option} is {getattr(o, field.name)}; accepted without --stress, which has --least")
    console = Terminal()
    flies = {"rows": o.rows, "vehicle": o.vehicle, "controller": o.controller, "seed": o.seed, "baseline": o.baseline}
    flies["pose"] = o.pose
    with _progress(o.plant, console) as progress:
        found = stress(o.policy, o.plant, FLIGHTS if o.episodes is None else o.episodes, **flies, progress=progress)
    plot = _folder(o, found.candidate) / f"{found.plant}_stress.png"
    return report_stress(found, console, o.json, plot, o.least)


@contextmanager
def _progress(plant: str, console: Console) -> Iterator[Callable[[str, int, int], None]]:
    """A progress bar for each criterion, from its first flight on: (criterion, finished flights, all flights)."""
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    bars, known = Progress(*columns, console=console, transient=True), dict[str, TaskID]()

    def progress(criterion: str, done: int, total: int) -> None:
        bars.start()
        if criterion not in known:
            known[criterion] = bars.add_task(f"{criterion} on {plant}", total=total)
        bars.update(known[criterion], completed=done)

    try:
        yield progress
    finally:
        if bars.live.is_started:
            bars.stop()


def _folder(o: Validate, flew: "Candidate") -> Path:
    """The folder for the plots."""
    return o.out or (flew.run.path if flew.run else beside(flew.file)) / "validation"


def _whole_flights(found: "Validation", count: int, console: Console, pose: str) -> bool:
    """Fly whole flights, if the plant is the firmware and the policy flies the vehicle. Returns whether all were
    complete.
    """
    from e2efly.commands.rehearsals import flights_table, fly_whole
    from e2efly.vehicles.loading import load_vehicle

    body, policy = load_vehicle(found.candidate.vehicle), found.candidate.policy
    if not found.plant.whole_flights or not count or policy.contract.refusals(body):
        return True
    flights = fly_whole(found.candidate, body, count, console, gates=pose == "gates")
    console.print(flights_table(flights))
    return all(flight.complete for flight in flights)


def _table(found: "Validation") -> Table:
    from e2efly.environment.episodes import summary

    table = headed("criterion", "flown in", "success", "95 %", "end error", "mean", "time", "drop")
    for name, v in found.criteria.items():
        for place, e, drop in (("training", v.trained, ""), (found.plant.name, v.flown, f"{v.drop:+.1f}")):
            s = summary(e)
            table.add_row(
                name,
                place,
                f"{s['success']:.1%}",
                "-".join(f"{100 * bound:.1f}" for bound in s["success_interval_95"]),
                f"{100 * s['final_error_m']:.2f} cm",
                f"{100 * s['mean_error_m']:.2f} cm",
                seconds(s["seconds_of_success"]),
                drop,
            )
    return table
