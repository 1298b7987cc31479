"""Fly a policy on a plant, and record it. Imports no JAX."""

import dataclasses
import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from e2efly.control.vectors import Quat, Vec3
from e2efly.policy.goal import Body
from e2efly.policy.odometry import Odometry
from e2efly.policy.others import Others, nobody
from e2efly.policy.runtime import Imu, Runtime, act, begin, judged
from e2efly.validation.law_step import LawMemory, LawStep, air_of, arrived, observed
from e2efly.validation.plant import Delay, Plant, RigidState
from e2efly.validation.reality import Air
from e2efly.validation.stress_laws import LATEST
from e2efly.vehicles.gravity import GRAVITY


@dataclass(frozen=True)
class FlightSample:
    """A moment of a flight, for a log."""

    time: float
    """Since the start, s."""
    state: RigidState
    """The vehicle."""
    rotor_speed: np.ndarray
    """(N,) rad/s. NaN, (4,), if the plant does not give rotor speeds."""

    @staticmethod
    def of(plant: Plant, time: float) -> "FlightSample":
        """The sample of a plant now."""
        speed = np.asarray(getattr(plant, "rotor_speed", np.full(4, np.nan)), np.float64)
        return FlightSample(time, RigidState.of(plant.state), speed.copy())


@dataclass(frozen=True)
class Trajectory:
    """A flight: `t` control steps, float64. Step k leads from row k of the states to row k + 1."""

    time: np.ndarray
    """(t+1,) since the start, s."""
    position: np.ndarray
    """(t+1, 3) world, m."""
    velocity: np.ndarray
    """(t+1, 3) world, m/s."""
    quaternion: np.ndarray
    """(t+1, 4) wxyz, body to world."""
    body_rate: np.ndarray
    """(t+1, 3) body, rad/s."""
    observation: np.ndarray
    """(t, o) the policy's observations."""
    action: np.ndarray
    """(t, 4) the policy's actions, in [-1, 1]."""
    command: np.ndarray
    """(t, 4) the actions in the units of the command mode. Each acts a latency later."""
    goal: np.ndarray
    """(t, 3) the position to be at, world, m."""
    success: bool = False
    """The task's verdict, from the runtime."""
    failure: str = ""
    """Why the task failed in flight. Empty: it did not fail."""
    fault: str = ""
    """Why the flight ended early, if the policy or the plant could not go on."""
    samples: tuple[FlightSample, ...] = ()
    """Moments between control steps, if they were requested."""
    estimate: np.ndarray | None = None
    """(t, 3) where the vehicle was told to be in each control step, world, m. None: it was told the truth."""


class FlownPose(Protocol):
    """Where a vehicle on a plant believes to be."""

    @property
    def interval(self) -> float:
        """Longest time between two of its steps, s."""
        ...

    def step(self, after: RigidState, now: float) -> None:
        """Sense the motion from the last step to the state `after`, at `now`, s since the start."""
        ...

    def odometry(self, now: float) -> Odometry:
        """What the vehicle is told of its motion."""
        ...


Flying = Generator[RigidState | None, Sequence[RigidState] | None, Trajectory]
"""A flight, step by step. It gives its state at the beginning of each control step and is sent those of all others;
then it gives None for each command that it holds, and time passes.
"""


def together(flights: Sequence[Flying]) -> list[Trajectory]:
    """Fly several vehicles of a world in lockstep.

    They see each other. Where their plants are of one physics (`Plant.company`), they also push each other. It ends
    when all have ended. One that has ended is seen where it was.
    """
    now, ended = [next(flight) for flight in flights], dict[int, Trajectory]()
    while len(ended) < len(flights):
        flying_on = [i for i in range(len(flights)) if i not in ended]
        given: dict[int, Any] = {i: [state for j, state in enumerate(now) if j != i] for i in flying_on}
        while flying_on:
            for i in tuple(flying_on):
                try:
                    reached = flights[i].send(given.pop(i, None))
                except StopIteration as end:
                    ended[i], reached = end.value, now[i]
                if reached is not None:
                    now[i] = reached
                    flying_on.remove(i)
    return [ended[i] for i in range(len(flights))]


def flying(
    runtime: Runtime,
    plant: Plant,
    start: RigidState,
    duration: float,
    latency: float,
    air: Air | None = None,
    sample: float | None = None,
    images: Callable[[int, Sequence[RigidState], Sequence[RigidState]], Sequence[np.ndarray]] | None = None,
    law: LawStep | None = None,
    pose: "FlownPose | None" = None,
) -> Flying:
    """Fly from one start until the time is over, or the task is done or has failed.

    `together` drives it. Among others it goes on when its task is done, as it is in their way.

    Args:
        runtime: policy, contract and course.
        plant: the plant to fly.
        start: the state at the start.
        duration: longest flight, s, in whole control periods.
        latency: time from observation to command, s.
        air: wind, thrust and errors of the policy's state in each step. None: still air, full thrust, no errors.
        sample: longest time between two samples, s. None: no samples are kept.
        images: the cameras' images, by control step, the states until then and the others now (`PlantWatch.images`).
        law: the control steps of the flight under a law of the stress.
        pose: tells the policy where it is. None: it is told the truth.

    Returns:
        The flight. A policy that refuses its observation, or a plant that fails, ends it with a `fault`.

    Raises:
        ValueError: for a start, duration or latency that cannot be flown.
    """
    contract = runtime.policy.contract
    period = 1 / contract.control_rate_hz
    steps = math.ceil(duration / period - 1e-6) if math.isfinite(duration) else 0
    if steps < 1:
        raise ValueError(f"duration is {duration} s; accepted: one control period or more, {period:.4g} s")
    disturbed = air is not None and air.disturbs
    delay = Delay.of(latency, contract.action.command(np.array(contract.hover_action)))
    plant.reset(start)
    states, decisions, fault = [plant.state], [], ""
    moved = law is not None and law.disturbs
    felt = None if law is None else LawMemory.of(states[0], np.array(contract.hover_action), period, LATEST)
    samples, estimates = [] if sample is None else [FlightSample.of(plant, 0.0)], list[np.ndarray]()
    memory = begin(runtime, states[0].odometry(0.0), 0.0)
    for k in range(steps):
        now, then = k * period, (k + 1) * period
        rest = yield states[-1]
        try:
            truth = states[-1].odometry(now)
            measured = imu_of(states[max(k - 1, 0)], states[k], period)
            told = truth if pose is None else pose.odometry(now)
            seen = (None if pose is None else told) if air is None else air.seen(k, told)
            if law is not None and felt is not None:
                seen, felt = observed(law.at(k), felt, told if seen is None else seen, period)
                measured = dataclasses.replace(measured, gyroscope=measured.gyroscope + law.error[k, 9:12])
            shown = () if images is None else images(k, states, rest or ())
            others = nearest(states[-1], rest, runtime.course.goal.neighbours) if rest else None
            memory, decision = act(runtime, memory, truth, now, measured, seen=seen, images=shown, others=others)
            if memory.failure or (memory.done and not rest):
                break
            command = decision.command
            if law is not None and felt is not None:
                arrives, felt = arrived(law.at(k), felt, decision.action)
                command = contract.action.command(arrives)
                delay = dataclasses.replace(delay, latency=latency + float(law.later[k]))
                if moved:
                    plant.disturb(*air_of(law.at(k), states[-1]))
            delay, parts = delay.send(command, now).until(now, then)
            if disturbed and air is not None:
                plant.disturb(air.wind[k], air.rotor_share[k])
            at = now
            for acting, seconds in parts:
                longest = min(seconds if sample is None else sample, seconds if pose is None else pose.interval)
                count = max(math.ceil(seconds / longest - 1e-6), 1)
                for _ in range(count):
                    plant.step(acting, seconds / count)
                    yield None
                    at += seconds / count
                    if sample is not None:
                        samples.append(FlightSample.of(plant, at))
                    if pose is not None:
                        pose.step(RigidState.of(plant.state), at)
            reached = RigidState.of(plant.state)
        except (ValueError, OSError) as error:
            fault = f"after {now:.2f} s: {error}"
            break
        decisions.append(decision)
        states.append(reached)
        estimates.append(told.position)
    plant.leave()
    if not (memory.done or memory.failure):
        memory = judged(runtime, memory, states[-1].odometry(period * len(decisions)), period * len(decisions))
    return Trajectory(
        period * np.arange(len(states)),
        *(np.array([getattr(s, name) for s in states]) for name in ("position", "velocity", "quaternion", "body_rate")),
        *(_rows(decisions, name, size) for name, size in
          (("observation", contract.observation_size), ("action", 4), ("command", 4), ("position", 3))),
        success=memory.outcome is not None and bool(memory.outcome.success[0]),
        failure=memory.failure,
        fault=fault,
        samples=tuple(samples),
        estimate=None if pose is None else np.array(estimates).reshape(-1, 3),
    )  # fmt: skip


def nearest(own: RigidState, rest: Sequence[RigidState], count: int) -> Others | None:
    """The nearest others as a policy observes them, filled up with `nobody`. None for a policy that observes none."""
    if not count:
        return None
    near = sorted(rest, key=lambda other: float(np.linalg.norm(other.position - own.position)))[:count]
    absent = nobody(own.position[None], count - len(near))
    there = ([getattr(other, name) for other in near] for name in ("position", "velocity"))
    position, velocity = (np.array(x).reshape(1, -1, 3) for x in there)
    return Others(
        np.concatenate([position, absent.position], axis=1), np.concatenate([velocity, absent.velocity], axis=1)
    )


def imu_of(before: Body, after: Body, dt: float) -> Imu:
    """The measurement of a perfect IMU, as in training (`e2efly.simulation.sensors.imu`).

    It is the body rate, and the mean specific force of the last `dt` s in the present body axes. A vehicle that has
    just been placed does not accelerate.
    """
    pull = Vec3.of((after.velocity - before.velocity) / dt + np.array([0.0, 0.0, GRAVITY]))
    force = Quat.of(after.quaternion).unrotate(pull)
    return Imu(after.body_rate, np.array([force.x, force.y, force.z]))


def _rows(decisions: list, name: str, size: int) -> np.ndarray:
    return np.array([getattr(d, name) for d in decisions], np.float64).reshape(len(decisions), size)
