"""Fly a policy on a plant, and record it. Imports no JAX."""

import math
from dataclasses import dataclass

import numpy as np

from e2efly.deploy.goals import GatesGoal
from e2efly.deploy.runtime import Runtime, RuntimeState, act, begin
from e2efly.validate.plant import Delay, Plant, RigidState


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
    """(t, o) what the policy saw."""
    action: np.ndarray
    """(t, 4) what it answered, in [-1, 1]."""
    command: np.ndarray
    """(t, 4) the same in the units of the command mode; it acts a latency later."""
    fault: str = ""
    """Why the flight broke off before its time, where the policy or the plant refused to go on."""


def fly(
    runtime: Runtime,
    plant: Plant,
    start: RigidState,
    duration: float,
    latency: float,
    floor: float = -math.inf,
) -> Trajectory:
    """Fly one start until the time is out, the race is over, or the feet are on the ground.

    Args:
        runtime: policy, contract and goal.
        plant: what to fly.
        start: where from.
        duration: seconds of the flight, in whole control periods.
        latency: seconds from observation to command.
        floor: height of the centre of mass over the world's origin at which the feet are on the ground, m.

    Returns:
        The flight. A policy that refuses its observation, or a plant that fails, ends it with a `fault`.

    Raises:
        ValueError: for a start, duration or latency that is not to be flown.
    """
    contract = runtime.policy.contract
    period = 1 / contract.control_rate_hz
    steps = math.ceil(duration / period - 1e-6) if math.isfinite(duration) else 0
    if steps < 1:
        raise ValueError(f"duration is {duration} s; accepted: one control period or more, {period:.4g} s")
    delay = Delay.of(latency, runtime.policy.command(np.array(contract.hover_action)))
    plant.reset(start)
    states, decisions, fault = [plant.state], [], ""
    memory = begin(runtime, states[0].odometry(0.0), 0.0)
    for k in range(steps):
        now, then = k * period, (k + 1) * period
        try:
            memory, decision = act(runtime, memory, states[-1].odometry(now), now)
            delay, parts = delay.send(decision.command, now).until(now, then)
            for command, seconds in parts:
                plant.step(command, seconds)
            reached = RigidState.of(plant.state)
        except (ValueError, OSError) as error:
            fault = f"after {now:.2f} s: {error}"
            break
        decisions.append(decision)
        states.append(reached)
        if reached.position[2] <= floor or _raced(runtime, memory):
            break
    return Trajectory(
        period * np.arange(len(states)),
        *(np.array([getattr(s, name) for s in states]) for name in ("position", "velocity", "quaternion", "body_rate")),
        *(_rows(decisions, name, size) for name, size in
          (("observation", contract.observation_size), ("action", 4), ("command", 4))),
        fault=fault,
    )  # fmt: skip


def _raced(runtime: Runtime, memory: RuntimeState) -> bool:
    """Whether a race is over; other goals are to be kept until the time is out."""
    goal = runtime.goal
    return isinstance(goal, GatesGoal) and (goal.done(memory.goal) or bool(goal.failed(memory.goal)))


def _rows(decisions: list, name: str, size: int) -> np.ndarray:
    return np.array([getattr(d, name) for d in decisions], np.float64).reshape(len(decisions), size)
