"""Fly many starts on one kind of plant, over all cores where the plant allows. Imports no JAX."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from e2efly.deploy.goals import Goal
from e2efly.deploy.policy import load_policy
from e2efly.deploy.runtime import Runtime
from e2efly.device import cores
from e2efly.validate.flight import Trajectory, fly
from e2efly.validate.plant import RigidState, plant_kind
from e2efly.vehicles import Vehicle

WORTH = 20
"""Flights below which processes of their own, which take a second to start, do not pay."""
CHUNK = 5
"""Flights that a process is handed at once."""


@dataclass(frozen=True)
class Mission:
    """What all flights share."""

    policy: Path
    """The policy.onnx."""
    plant: str
    """A name of `PLANTS`."""
    trained: Vehicle
    """The vehicle that the policy was trained on: the runtime refuses any other."""
    vehicle: Vehicle
    """The vehicle that the plant simulates; a changed one is a test, too."""
    duration: float
    """Longest flight, s."""
    latency: float
    """Seconds from observation to command."""


Flight = tuple[RigidState, Goal]
"""Where from, and where to."""


def fly_all(
    mission: Mission,
    flights: Sequence[Flight],
    done: Callable[[int], None] = lambda count: None,
    processes: int | None = None,
) -> list[Trajectory]:
    """Fly every start, in order.

    Args:
        mission: what they share.
        flights: the starts and their goals.
        done: told the number of flights that are over.
        processes: at once; left out: one a core, or none but this one where that does not pay.

    Raises:
        ValueError: for a policy or a plant that cannot be had, and for `processes` below 1.
    """
    if processes is not None and processes < 1:
        raise ValueError(f"processes is {processes}; accepted: 1 or more")
    count = processes or (cores() if len(flights) >= WORTH else 1)
    if not plant_kind(mission.plant).parallel or count == 1:
        return _collect(_fly(mission, flights), done)
    chunks = [flights[i : i + CHUNK] for i in range(0, len(flights), CHUNK)]
    context = multiprocessing.get_context("spawn")  # a fork would copy JAX's threads in an unknown state
    pool = ProcessPoolExecutor(min(count, len(chunks)), context, _ignore_interrupts)
    try:
        pending = [pool.submit(_fly_chunk, mission, chunk) for chunk in chunks]
        return _collect((trajectory for each in pending for trajectory in each.result()), done)
    finally:
        pool.shutdown(cancel_futures=True)


def _collect(flown: Iterator[Trajectory], done: Callable[[int], None]) -> list[Trajectory]:
    trajectories = []
    for trajectory in flown:
        trajectories.append(trajectory)
        done(len(trajectories))
    return trajectories


def _fly_chunk(mission: Mission, flights: Sequence[Flight]) -> list[Trajectory]:
    return list(_fly(mission, flights))


def _fly(mission: Mission, flights: Sequence[Flight]) -> Iterator[Trajectory]:
    policy, kind, vehicle = load_policy(mission.policy), plant_kind(mission.plant), mission.vehicle
    latency = max(mission.latency - kind.latency, 0.0)
    with closing(kind.make(vehicle, policy.contract)) as plant:
        for start, goal in flights:
            runtime = Runtime.of(policy, goal, mission.trained)
            yield fly(runtime, plant, start, mission.duration, latency, vehicle.feet_height)


def _ignore_interrupts() -> None:
    """Ctrl-C is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
