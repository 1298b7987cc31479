"""What is judged: the file of a policy, with the task and the environment in which it flies."""

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from e2efly.config import CameraConfig, EnvConfig, ImuConfig, RewardConfig, TaskConfig
from e2efly.config.changes import changed, differing
from e2efly.environment import Env
from e2efly.policy.images import NONE, Image
from e2efly.policy.loader import Policy, load_policy
from e2efly.policy.runtime import Acting
from e2efly.policy.zoo import policy_file
from e2efly.runs import presets
from e2efly.runs.rundir import RunDirectory, run_of
from e2efly.tasks.route import UNDECLARED
from e2efly.validation.baseline import Baseline
from e2efly.vehicles.family import family_names, load_family
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from e2efly.vehicles.vehicle import Controller, Flown, Vehicle

FIXED = (
    "vehicle",
    "command_mode",
    "command_range",
    "control_rate",
    "past_actions",
    "position_range",
    "imu.observed",
    "cameras",
)
"""Options of the environment that the contract fixes."""
FIXED_OF_CAMERAS = ("sees", "of", "width", "height", "projection", "encoding", "reach")
"""The same for a camera: what the numbers of its images mean, and how many there are."""


@dataclass(frozen=True)
class Candidate:
    """A policy's file with the task and the environment that it is judged in."""

    file: Path
    """The policy.onnx."""
    policy: Policy | Baseline
    """The loaded policy, or the hover controller that flies in its place."""
    task: TaskConfig
    """The task of its run or its contract."""
    env: EnvConfig
    """The environment of its run or its contract, with the vehicle that the policy was trained on."""
    run: RunDirectory | None
    """The run of the policy, if the file lies in one."""
    vehicle: str
    """The vehicle that flies: a name or a .toml file."""
    controller: Controller = "policy"
    """The vehicle for which the flight controller is tuned."""
    changes: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)
    """Where the task, the environment or the vehicle differ from the run or the contract, by dotted name (`env.wind`,
    `task.track`): both values."""
    baseline: str | None = None
    """Name of the hover controller that flies in place of the policy; None: the policy flies."""

    def as_json(self) -> dict[str, Any]:
        """What a report says of what flew."""
        return {
            "policy": str(self.file),
            "task": self.policy.contract.task,
            "baseline": self.baseline,
            "vehicle": self.vehicle,
            "controller": self.controller,
        }

    @property
    def changed(self) -> dict[str, Any]:
        """The new values of `changes`, by dotted name."""
        return {name: value for name, (_, value) in self.changes.items()}

    @property
    def draws(self) -> bool:
        """Whether every episode flies a different vehicle of the family that the policy was trained on."""
        return load_family(self.vehicle) is not None

    @cached_property
    def flown(self) -> Flown:
        """The vehicle that flies, and the one that its flight controller assumes. Both are equal for a family's policy.

        Raises:
            ValueError: for a vehicle or a controller that does not exist, or that does not belong to the policy's
                family. Also if every episode flies a different vehicle.
        """
        vehicle = load_vehicle(self.vehicle)
        if load_family(self.env.vehicle) is None:
            return Flown.of(load_vehicle(self.env.vehicle), vehicle, self.controller)
        if reasons := self.policy.contract.refusals(vehicle):
            raise ValueError("\n".join(reasons))
        tuned = dataclasses.replace(vehicle, control_rate=self.policy.contract.control_rate_hz)
        return Flown(tuned, tuned)

    @property
    def known(self) -> Vehicle:
        """The vehicle that the policy was trained on. For a family's policy, the vehicle that flies."""
        return load_vehicle(self.env.vehicle) if self.policy.contract.vehicle_ranges is None else self.flown.body

    @property
    def latency(self) -> float:
        """Latency from observation to command with which one vehicle flies, s."""
        return self.policy.contract.latency_of(self.flown.body)

    @property
    def at_home(self) -> "Candidate":
        """The same on the vehicle that the policy was trained on. For a family's policy, on the vehicle that flies."""
        if load_family(self.env.vehicle) is not None:
            return self
        return dataclasses.replace(self, vehicle=self.env.vehicle, controller="policy")

    @cached_property
    def outside(self) -> list[str]:
        """The quantities in which the courses that are flown lie outside of the training's, in words."""
        suites = (suite.domain() or () for suite in self.task.criteria().values())
        return list(dict.fromkeys(text for courses in suites for text in self.policy.contract.outside(courses)))

    @property
    def vehicles(self) -> str:
        """The name of what flies in every episode (`Env.vehicles`)."""
        return self.environment(next(iter(self.task.criteria().values()))).vehicles

    @property
    def notes(self) -> list[str]:
        """The differences from the run or the contract, in words."""
        contract, notes = self.policy.contract, []
        if self.baseline is not None:
            notes.append(f"What flies is the hover controller {self.baseline}, in place of the policy.")
        if contract.vehicle_ranges is not None:
            every = f"Every episode flies another vehicle of {contract.vehicle}"
            one = f"What flies is {self.vehicle}, by a policy of {contract.vehicle}"
            notes.append(f"{every if self.draws else one}; the flight controller is tuned to it.")
        elif load_vehicle(self.vehicle).hash != contract.vehicle_hash:
            told = "is tuned to it" if self.controller == "plant" else f"believes in the {contract.vehicle}"
            notes.append(
                f"What flies is {self.vehicle}, by the policy of a {contract.vehicle}; the flight controller {told}."
            )
            body = load_vehicle(self.vehicle)
            notes += [f"Outside of the training: {text}." for text in contract.misfits(body)]
            notes += [] if contract.misfits(body) else [f"{text}." for text in contract.differences(body)]
        if self.changes:
            changes = (f"{name} {value} (not {own})" for name, (own, value) in self.changes.items())
            notes.append(f"Flown under {', '.join(changes)}.")
        if contract.courses is None:
            notes.append(UNDECLARED)
        return [*notes, *(f"Outside of the training: {text}." for text in self.outside)]

    def environment(self, suite: TaskConfig) -> Env:
        """The environment of a criterion. Its reward is not used.

        Raises:
            ValueError: when the policy expects a different observation or different images.
        """
        env = Env.of(suite, RewardConfig({"prog2": 1.0}), self.env, flown=None if self.draws else self.flown)
        env = env.showing([field.name for field in self.policy.contract.observation])
        check_observation(self.policy, env)
        return env


def candidate(
    policy: str | os.PathLike[str],
    vehicle: str | None = None,
    controller: Controller = "policy",
    env: Mapping[str, Any] | None = None,
    task: Mapping[str, Any] | None = None,
    baseline: str | None = None,
) -> Candidate:
    """Find a policy, and the task and environment in which it is judged. The arguments are those of `evaluate`.

    Raises:
        ValueError: when there is no such policy, for changes that the contract does not allow, and when the vehicle
            that it was trained on cannot be found.
    """
    file = policy_file(policy, vehicle)
    loaded, run = load_policy(file), run_of(file)
    if run is None:
        learned, own = config_from_contract(loaded, vehicle)
    else:
        config = run.config(names_vehicle=vehicle is not None)
        learned, own = config.task, config.env
    learned = learned.showing([shown.name for shown in loaded.contract.observation])
    trained = _trained_on(loaded)
    if vehicle is None and (known := _hash(own.vehicle)) != trained:
        raise ValueError(
            f"vehicle_hash is {trained} in {file}, but vehicle {own.vehicle} is {known}; accepted: "
            "the vehicle that the policy was trained on, or --vehicle"
        )
    own = pinned(own, loaded) if env or loaded.contract.vehicle_ranges else own
    flies, flown = with_changes(own, env or {}), changed(learned, task or {}, "task")
    changes = differing(own, flies, "env") | differing(learned, flown, "task")
    found = Candidate(file, loaded, flown, flies, run, vehicle or own.vehicle, controller, changes)
    if not found.draws or loaded.contract.vehicle_ranges is None:
        _ = found.flown  # a name that there is not is refused here
    elif _hash(found.vehicle) != trained:
        raise ValueError(
            f"--vehicle is {found.vehicle}, ranges that are not the policy's; accepted: {own.vehicle}, or one vehicle "
            "within its ranges"
        )
    return found if baseline is None else _flown_by(found, baseline)


def _flown_by(found: Candidate, baseline: str) -> Candidate:
    """The same, with a hover controller in place of the policy."""
    if found.draws:
        raise ValueError(
            f"--baseline is {baseline!r}, and every episode flies another vehicle of {found.vehicle}; accepted: one "
            "vehicle, by --vehicle"
        )
    policy = Baseline.of(found.policy.contract, baseline, found.known)
    return dataclasses.replace(found, policy=policy, baseline=baseline)


def _hash(vehicle: str) -> str:
    family = load_family(vehicle)
    return load_vehicle(vehicle).hash if family is None else family.hash


def _trained_on(policy: Policy) -> str | None:
    """The hash of the vehicle or the family that a policy was trained on."""
    c = policy.contract
    return c.vehicle_hash if c.vehicle_ranges is None else c.vehicle_ranges.hash


def with_changes(own: EnvConfig, changes: Mapping[str, Any]) -> EnvConfig:
    """A policy's environment with changes, by dotted name, that leave its observation, images and commands alone.

    Raises:
        ValueError: naming the field, its value and what is accepted.
    """
    flies = changed(own, changes, "env")
    for name, (fixed, value) in differing(own, flies).items():
        if name in FIXED or (name.startswith("cameras.") and name.split(".", 2)[-1] in FIXED_OF_CAMERAS):
            way = "what flies is --vehicle" if name == "vehicle" else "train another policy to change it"
            raise ValueError(f"env.{name} is {value!r}; accepted: {fixed!r}, which the policy's contract fixes; {way}")
    if "latency_spread" in changes and "action_latency" not in changes:
        flies = dataclasses.replace(flies, action_latency=None)  # it lies about the vehicle's own
    return flies


def pinned(env: EnvConfig, policy: Acting) -> EnvConfig:
    """The same environment, which keeps rate, commands and past actions whatever else of it changes."""
    c = policy.contract
    return dataclasses.replace(
        env, control_rate=c.control_rate_hz, command_range=c.action.command_range, past_actions=c.past_actions
    )


def check_observation(policy: Acting, env: Any) -> None:
    """Refuse a policy whose observation or images differ from those of the environment.

    Raises:
        ValueError: naming the field or the image, and what each side has.
    """
    wanted = [(f.name, f.size, f.frame, f.unit) for f in policy.contract.observation]
    offered = [(f.name, f.size, f.frame, f.unit) for f in env.fields]
    if wanted != offered:
        odd = [f for f in wanted if f not in offered] + [f for f in offered if f not in wanted]
        raise ValueError(
            f"observation: the policy wants {wanted}, the environment gives {offered}; they differ in {odd}"
        )
    seen = [(i.sees, i.of, i.height, i.width) for i in policy.contract.images]
    shown = [(c.sees, c.of if c.sees == "mask" else NONE, c.height, c.width) for c in env.cameras]
    if seen != shown:
        raise ValueError(f"images: the policy wants {seen}, the cameras of the environment give {shown}")


def config_from_contract(policy: Policy, vehicle: str | None = None) -> tuple[TaskConfig, EnvConfig]:
    """Task and environment from the contract of a policy.onnx without a run. The task, and the loads that hang
    from its vehicles, have the options of its preset.

    `vehicle` is the vehicle that is to fly. It may be the file of the vehicle that the policy was trained on.

    Raises:
        ValueError: when the vehicle that it was trained on cannot be found.
    """
    c, trained = policy.contract, _trained_on(policy)
    name = c.vehicle
    if vehicle is not None and _hash(vehicle) == trained:
        name = vehicle
    findable = name == vehicle or name in (*vehicle_names(), *family_names())
    known = _hash(name) if findable else "no vehicle that comes with the package"
    if known != trained:
        raise ValueError(
            f"vehicle_hash is {trained} in the contract, but vehicle {c.vehicle!r} is {known}: it was trained "
            "on other parameters; accepted: the file of that vehicle with --vehicle FILE.toml, or its run's folder"
        )
    latency = c.latency_range_s[0], c.latency_range_s[1]
    preset = presets.preset(c.task, "ppo")
    one = c.vehicle_ranges is not None and name != vehicle and vehicle is not None
    config = EnvConfig(
        vehicle=name,
        command_mode=c.action.mode,
        control_rate=c.control_rate_hz,
        action_latency=None if one else latency,  # one vehicle of a family has its own
        observation_latency=(c.observation_latency_range_s[0], c.observation_latency_range_s[1]),
        command_range=c.action.command_range,
        past_actions=c.past_actions,
        payload=preset.env.payload,
        imu=ImuConfig(observed=c.sees_imu),
        cameras=tuple(_camera(image) for image in c.images),
    )
    return preset.task, config


def _camera(image: Image) -> CameraConfig:
    known: dict[str, Any] = {"sees": image.sees, "projection": image.projection}
    known |= {"of": image.of} if image.of != NONE else {}
    known |= {"encoding": image.encoding} if image.encoding != NONE else {}
    return CameraConfig(
        width=image.width,
        height=image.height,
        fov=(image.fov_rad[0], image.fov_rad[1]),
        position=(image.position_m[0], image.position_m[1], image.position_m[2]),
        pitch=image.pitch_rad,
        reach=(image.reach_m[0], image.reach_m[1]),
        rate=image.rate_hz,
        latency=(image.latency_range_s[0], image.latency_range_s[1]),
        **known,
    )
