"""Fly a policy with the bridge's runtime on another plant. `e2efly.validate` and `e2efly validate` do this."""

import dataclasses
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from e2efly.config import TaskConfig
from e2efly.environment.episodes import Episodes, rows, summary
from e2efly.flight.sight.sources import by_image
from e2efly.logs.csv_file import write_csv
from e2efly.policy.contract import Contract
from e2efly.policy.goal import Course
from e2efly.policy.runtime import check
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.tasks.route import fields_of
from e2efly.validation.candidate import Candidate, candidate
from e2efly.validation.evaluation import ROW, SEED, UNITS, course_rows, fly_criteria
from e2efly.validation.fleet import FleetFlight, FleetMission, fly_all
from e2efly.validation.gate_pose import GateCamera, GateFlight, track_of
from e2efly.validation.log import SAMPLE, record_of
from e2efly.validation.plant import Plant
from e2efly.validation.plant_flight import Trajectory
from e2efly.validation.plants import PLANTS, find_plant
from e2efly.validation.reality import Reality, check_realities
from e2efly.validation.starts import Starts, draw_starts
from e2efly.validation.task_verdict import Verdicts, judge
from e2efly.vehicles.vehicle import Controller, Vehicle

KEPT = 136
"""Memory of one control step of a flight on a plant, bytes. All steps of all flights are kept."""


Pose = Literal["truth", "gates"] | GateCamera
"""Who tells a policy on a plant where it is: the plant, or the gates that the usual camera sees, or another camera."""


@dataclass(frozen=True)
class Comparison:
    """Results of a policy on one criterion, in the training simulator and on the plant, from the same starts."""

    trained: Episodes
    """Results in the training simulator, as `evaluate` flies them; NumPy arrays."""
    flown: Verdicts
    """Results on the plant."""
    starts: Starts
    """The starts of both."""
    flights: list[Trajectory]
    """The flight of each start on the plant."""

    @property
    def drop(self) -> float:
        """Loss of success on the plant, percentage points."""
        return 100 * float(np.mean(self.trained.success) - np.mean(self.flown.success))

    @property
    def pose_error(self) -> tuple[float, float] | None:
        """Root mean square and largest distance of the vehicles from where they were told to be, m. None: they were
        told the truth.
        """
        told = [(f.estimate, f.position[: len(f.estimate)]) for f in self.flights if f.estimate is not None]
        if not told:
            return None
        distance = np.concatenate([np.linalg.norm(estimate - true, axis=1) for estimate, true in told])
        return float(np.sqrt(np.mean(distance**2))), float(distance.max())

    def as_json(self, plant: str, suite: TaskConfig) -> dict[str, Any]:
        """A summary for both places, and a row for every start on the plant."""
        faults = sum(bool(flight.fault) for flight in self.flights)
        courses = course_rows(suite, self.starts.drawn, len(self.starts))
        places = zip(self.trained.success, rows(self.flown), self.flights, self.starts.states, courses, strict=True)
        starts = [
            {"trained_success": bool(trained), **row, "fault": flight.fault}
            | {"start": {f.name: getattr(start, f.name).round(6).tolist() for f in dataclasses.fields(start)}}
            | course
            for trained, row, flight, start, course in places
        ]
        flown: dict[str, Any] = summary(self.flown) | {"faults": faults}
        if (error := self.pose_error) is not None:
            flown["pose_error_m"] = dict(zip(("rms", "largest"), error, strict=True))
        return {"drop": self.drop, "training": summary(self.trained), plant: flown, "starts": starts}


@dataclass(frozen=True)
class Validation:
    """Results of a policy on a plant, compared with the training simulator."""

    candidate: Candidate
    """The policy that flew."""
    plant: type[Plant]
    """The plant on which it flew."""
    seed: int
    """Seed of the starts."""
    max_drop: float
    """Largest accepted loss of success on the plant, percentage points."""
    criteria: dict[str, Comparison]
    """Results by the name of the criterion."""
    differences: tuple[str, ...] = ()
    """Differences between the plant's vehicle and the policy's, as the plant reports them."""

    @property
    def worst(self) -> str:
        """The criterion with the largest loss of success."""
        return max(self.criteria, key=lambda name: self.criteria[name].drop)

    @property
    def passed(self) -> bool:
        """Whether the loss of success is at most `max_drop` in every criterion."""
        return self.criteria[self.worst].drop <= self.max_drop + 1e-9

    def notes(self) -> list[str]:
        """Features that the training simulator has and the plant does not, and the reverse."""
        policy, env, notes = self.candidate.policy.contract, self.candidate.env, []
        random = {
            "randomised vehicles": bool(env.randomize),
            "wind": env.wind > 0,
            "noise": env.noise != type(env.noise)(),
            "late observations": policy.observation_latency_range_s[1] > 0,
        }
        if any(random.values()):
            there = ", ".join(name for name, has in random.items() if has)
            notes.append(f"Trained with {there}: there in `training`, not on the plant.")
        low, high = policy.latency_range_s
        if low < high:
            flies = self.candidate.latency
            notes.append(f"Trained with a latency of {low:g} to {high:g} s; the plant flies with {flies:g} s.")
        if (own := self.plant.latency) > self.candidate.latency:
            notes.append(f"The plant itself takes {own:g} s from command to rate loop, longer than that.")
        for name, each in self.criteria.items():
            if (error := each.pose_error) is not None:
                notes.append(
                    f"{name}: the gates told where the vehicle was to {100 * error[0]:.1f} cm RMS, "
                    f"{100 * error[1]:.0f} cm at worst."
                )
        return [*notes, *self.differences, *self.candidate.notes]

    def as_json(self) -> dict[str, Any]:
        """The report that `e2efly validate --json` writes."""
        plant, suites = self.plant.name, self.candidate.task.criteria()
        drop = "points of success: percent of the training simulator less percent of the plant"
        return {
            **self.candidate.as_json(),
            "changed": self.candidate.changed,
            "plant": plant,
            "latency_s": self.candidate.latency,
            "seed": self.seed,
            "max_drop": self.max_drop,
            "differences": list(self.differences),
            "units": UNITS | {"drop": drop},
            "criteria": {name: each.as_json(plant, suites[name]) for name, each in self.criteria.items()},
        }


def validate(
    policy: str | os.PathLike[str],
    plant: str | type[Plant] = "mujoco",
    episodes: int | None = None,
    *,
    vehicle: str | None = None,
    controller: Controller = "policy",
    task: Mapping[str, Any] | None = None,
    seed: int = SEED,
    max_drop: float = 2.0,
    log: str | os.PathLike[str] | None = None,
    image: Sequence[str] = (),
    progress: Callable[[str, int, int], None] = lambda criterion, done, total: None,
    baseline: str | None = None,
    pose: Pose = "truth",
) -> Validation:
    """Fly a policy with the bridge's runtime on another plant, from the starts of `evaluate`.

    Many flights share the cores in several processes, so a script must call this under `if __name__ == "__main__":`.

    Args:
        policy: a run directory, a policy.onnx, or the name of a task, which means the policy of the zoo for that task.
        plant: its name, with its address where it has one (`airsim:HOST:PORT`), its reference `path/to/file.py:Name` or
            `module:Name`, or a registered class.
        episodes: starts of each criterion. If left out: the plant's `episodes`.
        vehicle: the vehicle that the plant flies, a name or a .toml file. If left out: the policy's own vehicle.
        controller: `policy`: the plant's flight controller stays tuned to the policy's own vehicle, whatever vehicle
            flies. `plant`: it is tuned to the vehicle that flies. Neither changes the policy.
        task: options of its task by dotted name, which replace those of the policy's run or contract: {"track":
            "four_gates"}.
        seed: seed of the starts.
        max_drop: largest accepted loss of success on the plant, percentage points.
        log: folder for a CSV log of each flight, CRITERION_NUMBER.csv, which `e2efly identify flight` reads. None: no
            logs are written.
        image: IMAGE=plant:CAMERA for each image of the contract that the plant's own camera provides. For a mask it is
            IMAGE=plant:CAMERA:RED,GREEN,BLUE with the colour of its class in the plant's segmentation. The other images
            are rendered from the task's world.
        progress: called as progress(criterion, number of finished flights, number of all flights).
        baseline: the hover controller that flies in place of the policy; see `e2efly.evaluate`.
        pose: `truth`: the policy is told where it is. `gates`: the pose source `gates:` tells it, from rendered images
            of a racing camera and from an IMU; a `GateCamera` says of which. The training simulator, with which it is
            compared, tells the truth.

    Raises:
        ValueError: naming the option or the field, its value and what is accepted.
        OSError: when the plant cannot be started, or the folder cannot be written to.
    """
    name = plant_name(plant)
    kind = find_plant(name)
    episodes = kind.episodes if episodes is None else episodes
    if episodes <= 0:
        raise ValueError(f"--episodes is {episodes}; accepted: more than 0")
    if not (math.isfinite(max_drop) and max_drop >= 0):
        raise ValueError(f"--max-drop is {max_drop}; accepted: 0 or more points of success")
    compute_at_once()
    prepare("cpu")  # the plants compute on the CPU, one vehicle at a time
    found, kind, own = flyable(policy, plant, vehicle, controller, task, baseline)
    cameras = plant_cameras(image, found.policy.contract)
    kind = kind.seeing(cameras) if cameras else kind
    reality = Reality(found.flown.body, found.latency)
    check_realities(kind, found.flown.believed, [reality])
    differences = tuple(kind.differences(found.flown.believed, found.policy.contract))
    suites = found.task.criteria()
    longest = max(float(suite.episode_s) for suite in suites.values())
    kept = ROW + KEPT * int(longest * found.policy.contract.control_rate_hz)
    kept += 0 if log is None else 4 * KEPT * int(longest / SAMPLE)
    agents = max(found.environment(suite).agents for suite in suites.values())
    if agents > 1 and not kind.parallel:
        able = ", ".join(repr(name) for name, plant in PLANTS.items() if plant.parallel)
        raise ValueError(
            f"--plant is {kind.name!r} and task.agents {agents}; accepted: {able}, several of which can run at once"
        )
    episodes = -(-episodes // agents) * agents  # whole worlds
    trained, _, _ = fly_criteria(found.at_home, episodes, seed, kept)
    criteria = {}
    for criterion, suite in suites.items():
        env = found.environment(suite)
        starts = draw_starts(env, episodes, seed)
        sample = None if log is None else SAMPLE
        mission = FleetMission(
            found.file, name, own, found.flown.believed, float(suite.episode_s), cameras, sample, baseline, agents
        )
        parts = starts.states, starts.courses, starts.sights(env, seed), gate_flights(pose, starts.courses, seed)
        asked = [
            FleetFlight(start, course, reality, sight, gates)
            for start, course, sight, gates in zip(*parts, strict=True)
        ]
        flights = fly_all(mission, asked, lambda done: progress(criterion, done, episodes))  # noqa: B023
        if log is not None:
            _write_logs(Path(log), criterion, flights, found.policy.contract.action.mode)
        verdicts = judge(env, starts, flights, suite.settling_s)
        criteria[criterion] = Comparison(trained[criterion], verdicts, starts, flights)
    return Validation(found, kind, seed, max_drop, criteria, differences)


def gate_flights(pose: Pose, courses: Sequence[Course], seed: int) -> list[GateFlight | None]:
    """The camera of each flight that is told where it is by gates.

    Raises:
        ValueError: for a course without gates that stand still.
    """
    if pose == "truth":
        return [None] * len(courses)
    for course in courses:
        track_of(course)
    setup = pose if isinstance(pose, GateCamera) else GateCamera()
    return [GateFlight(setup, seed + i) for i in range(len(courses))]


def _write_logs(folder: Path, criterion: str, flights: list[Trajectory], mode: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for number, flight in enumerate(flights):
        path = folder / f"{criterion}_{number:04d}.csv"
        write_csv(record_of(path, flight, mode), path)


def plant_cameras(texts: Sequence[str], contract: Contract) -> dict[str, str]:
    """The plant's camera for each image, from texts IMAGE=plant:CAMERA.

    Raises:
        ValueError: naming the text and what is accepted: for an unknown image, an image given twice, or another source.
    """
    chosen = by_image(texts, contract)
    for name, uri in chosen.items():
        if not uri.startswith("plant:"):
            raise ValueError(f"--image {name} is {uri!r}; accepted: {name}=plant:CAMERA, a camera of the plant's own")
    return {name: uri.removeprefix("plant:") for name, uri in chosen.items()}


def plant_name(plant: str | type[Plant]) -> str:
    """The name or reference with which other processes find a plant.

    Raises:
        ValueError: for a class that is not registered.
    """
    return plant if isinstance(plant, str) else PLANTS.reference(plant)


def flyable(
    policy: str | os.PathLike[str],
    plant: str | type[Plant],
    vehicle: str | None,
    controller: Controller,
    task: Mapping[str, Any] | None = None,
    baseline: str | None = None,
) -> tuple[Candidate, type[Plant], Vehicle]:
    """A policy that the runtime can fly, the plant, and the vehicle that the policy was trained on.

    For a policy of a family, the vehicle is the one that it flies.

    Raises:
        ValueError: naming what does not fit.
    """
    kind, found = find_plant(plant_name(plant)), candidate(policy, vehicle, controller, task=task, baseline=baseline)
    contract = found.policy.contract
    if found.draws:
        raise ValueError(
            f"--vehicle is {vehicle or 'left out'}; accepted: one vehicle within the ranges of {contract.vehicle!r}, "
            "as a plant has one flight controller"
        )
    own = found.known
    if reasons := check(contract, own, fields_of(contract), imu=True, images=True, rotors=True):
        raise ValueError("\n".join(reasons))
    return found, kind, own
