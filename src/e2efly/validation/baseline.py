"""A hover controller in place of a policy, with the observations, commands and vehicle of the policy's contract.

It allows a policy and a controller that was not trained to be judged alike. Imports no JAX.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.control import Ctbr, Quat, Vec3
from e2efly.control.place import ZERO
from e2efly.flight.pilot.hovering import HoverController, Seen, UnderWay, hover_controller, sent
from e2efly.policy.contract import Contract
from e2efly.policy.goal import Goal
from e2efly.policy.loader import Policy
from e2efly.policy.observation import ATTITUDE, BODY_RATE, VELOCITY
from e2efly.tasks.registry import TASKS
from e2efly.tasks.route import goal_of
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle


@dataclass(frozen=True)
class BaselineMemory:
    """The state that one call of a baseline passes to the next."""

    controller: Any
    """State of the controller."""
    under_way: UnderWay
    """Commands that were sent and do not act yet."""
    last: Ctbr
    """The last command."""
    velocity: Vec3
    """Velocity, world, m/s."""


@dataclass(frozen=True)
class Baseline:
    """Acts like a policy. Make it with `Baseline.of`."""

    contract: Contract
    """Contract of the policy that it replaces."""
    goal: type[Goal]
    """Goal class of the task. It gives the place to be at from the observation."""
    controller: HoverController
    """The controller that flies."""
    vehicle: Vehicle
    """The vehicle for which it is made."""

    @staticmethod
    def of(contract: Contract, name: str, vehicle: Vehicle) -> "Baseline":
        """A hover controller that flies the task of a contract in place of its policy, by its name or its reference.

        Raises:
            ValueError: for an unknown name, with all names; or for a task or a command mode that it cannot fly.
        """
        goal = goal_of(TASKS.find(contract.task)).showing([field.name for field in contract.observation])
        if not _aims(goal):
            able = ", ".join(name for name, task in TASKS.items() if _aims(goal_of(task)))
            raise ValueError(
                f"--baseline is {name!r}, and task {contract.task!r} of the policy shows it no place to fly to; "
                f"accepted: a policy of {able}, or of a task whose goal has `aim`"
            )
        if contract.action.mode != "ctbr":
            mode = contract.action.mode
            raise ValueError(f"--baseline is {name!r}, and the policy commands {mode!r}; accepted: one by 'ctbr'")
        shown = [field.name for field in contract.observation]
        if lacking := [field.name for field in (ATTITUDE, VELOCITY, BODY_RATE) if field.name not in shown]:
            raise ValueError(
                f"--baseline is {name!r}, and the policy is shown no {', '.join(lacking)}; accepted: one that is shown "
                "attitude, velocity and body rate"
            )
        latency, period = contract.latency_of(vehicle), 1 / contract.control_rate_hz
        return Baseline(contract, goal, hover_controller(name, vehicle, latency, period), vehicle)

    def act(
        self, observation: np.ndarray, images: Sequence[np.ndarray] = (), memory: BaselineMemory | None = None
    ) -> tuple[np.ndarray, BaselineMemory]:
        """The actions for observations, and the memory for the next call.

        The heading is free if the task's goal gives none. The measured acceleration is the change of the observed
        velocity. The thrust of the rotors is the commanded thrust after the lag of the motors.

        Args:
            observation: (o,) or (n, o), as `contract.observation` says.
            images: not used.
            memory: the memory from the last call. None: the flight begins here, in hover.

        Returns:
            The action, float32 (4,) or (n, 4) in [-1, 1]; the memory for the next call.
        """
        x, slices, dt = np.asarray(observation, np.float64), self.contract.slices, 1 / self.contract.control_rate_hz
        attitude, velocity = Quat.of(x[..., slices[ATTITUDE.name]]), Vec3.of(x[..., slices[VELOCITY.name]])
        latency, force, under_way = self.contract.latency_of(self.vehicle), None, UnderWay()
        known = self.controller.begin() if memory is None else memory.controller
        if memory is not None:
            under_way = sent(memory.under_way, memory.last, dt, self.vehicle, latency)
            force = attitude.unrotate((velocity - memory.velocity) * (1 / dt) + Vec3(0.0, 0.0, GRAVITY))
        seen = Seen(ZERO, velocity, attitude, Vec3.of(x[..., slices[BODY_RATE.name]]), force=force)
        place = self.goal.aim({field.name: x[..., slices[field.name]] for field, _ in self.goal.observation})
        known, wanted = self.controller.step(known, seen, under_way, place, dt)
        command = np.stack(np.broadcast_arrays(wanted.thrust, wanted.rate.x, wanted.rate.y, wanted.rate.z), axis=-1)
        command = np.clip(command, self.contract.action.low, self.contract.action.high)
        given = Ctbr(command[..., 0], Vec3.of(command[..., 1:]))
        return self.contract.action.asking(command), BaselineMemory(known, under_way, given, velocity)


def _aims(goal: type[Goal]) -> bool:
    """Whether a task's goal gives a place at which a controller is to be."""
    return getattr(goal, "aim", Goal.aim).__func__ is not Goal.aim.__func__  # type: ignore[attr-defined]


def acting(policy: Policy, baseline: str | None, vehicle: Vehicle) -> Policy | Baseline:
    """The policy, or the hover controller of this name or reference that flies in its place. None: the policy flies.

    Raises:
        ValueError: as for `Baseline.of`.
    """
    return policy if baseline is None else Baseline.of(policy.contract, baseline, vehicle)
