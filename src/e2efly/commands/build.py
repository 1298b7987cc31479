"""`e2efly build`."""

import hashlib
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from e2efly.commands import train
from e2efly.commands.terminal import Terminal, console_table
from e2efly.config.names import unknown
from e2efly.config.storage import held, read_json, write_atomically, write_json
from e2efly.config.tables import read_table
from e2efly.flight.sight.samples import samples_file
from e2efly.policy import zoo
from e2efly.policy.loader import load_policy
from e2efly.runs import presets
from e2efly.runs.rundir import RunDirectory
from e2efly.tasks import TASKS
from e2efly.vehicles.family import family_names
from e2efly.vehicles.loading import load_vehicle, read_sigmas
from e2efly.vehicles.vehicle import Vehicle

PAPER = ("hover", "land", "track", "race", "land_visual", "race_clutter")
"""The six tasks of the paper."""
REPORT = "build.json"
"""File in the folder: where each policy is from, and what it does on the vehicle."""


@dataclass(frozen=True)
class Build:
    """Make the policies of a vehicle: from a list of its parts to a vehicle file, and to a policy for each task.

    Where a shipped policy was trained for a range that contains the vehicle, that policy is taken. Otherwise one is
    trained. Each is then flown on the vehicle, in the simulator of the training. A build that was stopped goes on if
    the same command is given again.
    """

    parts: tyro.conf.Positional[Annotated[Path, tyro.conf.arg(metavar="FILE")]]
    """A list of parts (`e2efly identify parts` reads the same), whose origin is the middle between the rotors; or a
    vehicle file, which is taken as it is."""
    vehicle: str = "vis_r"
    """For a list of parts, the vehicle that it resembles: a name or a .toml file. What parts do not tell keeps its
    values: thrust, motors, drag, rate loop, delay."""
    mass: tuple[float, float] | None = None
    """For a list of parts: mass of the whole vehicle and standard deviation of the scale, kg."""
    out: Path = Path("built")
    """Folder for vehicle.toml, and for each task a folder with its policy.onnx."""
    tasks: tuple[str, ...] = PAPER
    """Tasks to make policies of."""
    train: tuple[str, ...] = ()
    """Tasks of which a policy is trained in any case."""
    episodes: int = 250
    """Starts of each criterion that a policy is flown from."""
    preview: bool = False
    """Only say what would be taken and what would be trained. Nothing is written."""


@dataclass(frozen=True)
class PolicyPlan:
    """How a task gets its policy."""

    task: str
    taken: str | None
    """Name of the policy of the zoo that is taken. None: one is trained."""
    preset: str = ""
    """The preset by which it is trained."""
    differences: tuple[str, ...] = ()
    """By how much the vehicle differs from that of the taken policy."""

    def text(self, vehicle: str) -> str:
        """What is done, in words."""
        if self.taken is not None:
            return f"taken: {self.taken}"
        config = presets.starting(self.task, TASKS.find(self.task).best, self.preset, vehicle)
        begins = f", from {config.start_from}" if config.start_from else ""
        return f"trained: preset {self.preset}{begins}, {config.steps / 1e6:.1f} M steps"


def run(options: Build) -> int:
    """Make the vehicle file and the policies, and print what they do.

    Returns:
        0, or 130 when the user stopped a training.

    Raises:
        ValueError: naming the option, the part or the entry of the file, its value and what is accepted; or if the
            folder has the policies of another vehicle.
    """
    for name in (*options.tasks, *options.train):
        if name not in TASKS or TASKS[name].best not in TASKS[name].robust:
            raise ValueError(unknown("task", name, [task for task in TASKS if TASKS[task].best in TASKS[task].robust]))
    if options.episodes <= 0:
        raise ValueError(f"--episodes is {options.episodes}; accepted: more than 0")
    if not options.preview:
        with held(options.out):
            return _build(options, options.out)
    with tempfile.TemporaryDirectory() as folder:
        file = vehicle_of(options, Path(folder))
        plans = [plan(task, load_vehicle(file), file, options) for task in options.tasks]
        Terminal().print(console_table([{"task": each.task, "policy": each.text(str(file))} for each in plans]))
    return 0


def vehicle_of(o: Build, folder: Path) -> Path:
    """The vehicle file, written into a folder that has none, or the same one."""
    from e2efly.alignment.estimates import fuse, weighed
    from e2efly.alignment.parts import estimates
    from e2efly.alignment.vehicle_file import write_vehicle

    path = folder / "vehicle.toml"
    if "part" in read_table(o.parts):
        with tempfile.TemporaryDirectory() as made:
            new = Path(made) / path.name
            said = [*([weighed(o.mass)] if o.mass else []), *estimates(o.parts, centre=True)]
            write_vehicle(new, o.vehicle, load_vehicle(o.vehicle), fuse(said))
            content = new.read_bytes()
    else:
        if o.mass:
            raise ValueError(f"--mass is {' '.join(map(str, o.mass))}; accepted: with a list of parts")
        load_vehicle(o.parts)
        content = o.parts.read_bytes()
    if path.exists() and path.read_bytes() != content:
        raise ValueError(
            f"--out is {folder}, which has the policies of another vehicle ({path.name} differs from what {o.parts} "
            "gives); accepted: another folder"
        )
    write_atomically(path, content)
    load_vehicle(path)
    return path


def plan(task: str, vehicle: Vehicle, file: Path, o: Build) -> PolicyPlan:
    """How a task gets its policy: a shipped one that was trained for a range that contains the vehicle, one for a
    single vehicle before one for a family; otherwise by training.
    """
    trains = task in o.train or (o.out / task / "config.json").exists()  # a training that began goes on
    having = [whose for whose, tasks in zoo.contents().items() if task in tasks and not trains]
    families = family_names()
    for whose in sorted(having, key=lambda name: (name in families, name != presets.FAMILY, name != o.vehicle)):
        contract = load_policy(f"{whose}/{task}").contract
        if not contract.misfits(vehicle):
            return PolicyPlan(task, f"{whose}/{task}", differences=contract.differences(vehicle))
    uncertain = any((sigma > 0).any() for sigma in read_sigmas(file).values())
    begins = task in zoo.contents().get(presets.FAMILY, {}) and uncertain
    return PolicyPlan(task, None, presets.IDENTIFIED if begins else presets.ROBUST)


def _build(o: Build, out: Path) -> int:
    console, began = Terminal(), time.perf_counter()
    file = vehicle_of(o, out)
    vehicle = load_vehicle(file)
    said = f"mass {vehicle.mass:.3f} kg, thrust to weight {vehicle.thrust_to_weight:.2f}"
    console.print(f"Vehicle: {file} ({said}, inertia {', '.join(f'{1e3 * x:.2f}' for x in vehicle.inertia)} g m^2)")
    done: dict[str, Any] = read_json(out / REPORT)["tasks"] if (out / REPORT).exists() else {}
    rows, shown = [], ()
    for number, task in enumerate(o.tasks, 1):
        how, start = plan(task, vehicle, file, o), time.perf_counter()
        for line in () if how.differences == shown else how.differences:
            console.print(line, style="dim")
        shown = how.differences
        console.print(f"{number} of {len(o.tasks)}, {task}: {how.text(str(file))}")
        policy = out / task / "policy.onnx"
        if status := _make(how, policy, file):
            return status
        digest = hashlib.sha256(policy.read_bytes()).hexdigest()
        if done.get(task, {}).get("sha256") != digest or done[task]["episodes"] != o.episodes:
            with console.status(f"flying {task} from {o.episodes} starts"):
                flown = _flown(policy, file, o.episodes)
            seconds = time.perf_counter() - start
            done[task] = {"policy": how.taken or f"preset {how.preset}", "sha256": digest, "episodes": o.episodes}
            done[task] |= {"differences": how.differences, "seconds": seconds, "criteria": flown}
            write_json(out / REPORT, {"parts": str(o.parts), "like": o.vehicle, "tasks": done})
        rows += _rows(task, done[task])
    console.print(console_table(rows))
    console.print(f"All of this took {time.perf_counter() - began:.0f} s. Look at what a flight needs, and then fly:")
    console.print(
        f"  e2efly fly {out / o.tasks[0]} --vehicle {file} --link /dev/ttyACM0 --pose udp:9870 --check",
        soft_wrap=True, highlight=False,
    )  # fmt: skip
    return 0


def _make(how: PolicyPlan, policy: Path, file: Path) -> int:
    """Take or train a policy, unless it is there. Returns the exit status of the training."""
    run = RunDirectory(policy.parent)
    if how.taken is not None:
        found = zoo.policy_file(how.taken)
        for kept, copy in ((found, policy), (samples_file(found), samples_file(policy))):
            if kept.is_file():
                copy.parent.mkdir(parents=True, exist_ok=True)
                write_atomically(copy, kept.read_bytes())
        return 0
    if (run.path / "summary.json").exists() and run.read_json("summary.json")["finished"]:
        return 0
    if run.checkpoint.exists():
        return train.run(train.parse(["--resume", str(run.path), "--no-plots"]))
    if not (run.path / "config.json").exists():  # what was taken before
        policy.unlink(missing_ok=True)
        samples_file(policy).unlink(missing_ok=True)
    began = ["--overwrite"] if (run.path / "config.json").exists() else []
    asked = [how.task, "--preset", how.preset, "--vehicle", str(file), "--out", str(run.path), "--no-plots", *began]
    return train.run(train.parse(asked))


def _flown(policy: Path, file: Path, episodes: int) -> dict[str, Mapping[str, Any]]:
    """What a policy does on the vehicle, by criterion. The flight controller is tuned to the vehicle."""
    from e2efly.environment.episodes import summary
    from e2efly.validation.evaluation import evaluate

    flown = evaluate(policy, episodes, vehicle=str(file), controller="plant").flown
    return {name: summary(episodes) for name, episodes in flown.items()}


def _rows(task: str, about: Mapping[str, Any]) -> list[dict[str, Any]]:
    return [
        {
            "task": task if name == task else f"{task}: {name}",
            "policy": about["policy"],
            "success": f"{flown['success']:.1%}",
            "mean error": f"{100 * flown['mean_error_m']:.1f} cm",
            "top speed": f"{flown['top_speed_m_s']:.1f} m/s",
            "made in": f"{about['seconds']:.0f} s",
        }
        for name, flown in about["criteria"].items()
    ]
