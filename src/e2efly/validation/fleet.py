"""Fly many starts on one kind of plant, over all cores where the plant allows. Imports no JAX."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from e2efly.policy.goal import Course
from e2efly.policy.loader import Policy, load_policy
from e2efly.policy.runtime import Runtime
from e2efly.simulation.device import compute_at_once, cores, prepare
from e2efly.tasks import TASKS
from e2efly.validation.baseline import Baseline, acting
from e2efly.validation.plant import Plant, RigidState
from e2efly.validation.plant_flight import Flying, Trajectory, flying, together
from e2efly.validation.plants import find_plant
from e2efly.validation.reality import Reality, check_realities
from e2efly.vehicles.vehicle import Vehicle

if TYPE_CHECKING:
    from e2efly.validation.gate_pose import GateFlight
    from e2efly.validation.plant_sight import Sight

WORTH = 20
"""Number of flights below which separate processes are not worth the second that they take to start."""
CHUNK = 5
"""Number of flights that a process gets at once."""


@dataclass(frozen=True)
class FleetMission:
    """What all flights share."""

    policy: Path
    """The policy.onnx."""
    plant: str
    """Name or reference of a plant."""
    trained: Vehicle
    """The vehicle that the policy was trained on. The runtime refuses any other."""
    believed: Vehicle
    """The vehicle to which the plant's flight controller is tuned."""
    duration: float
    """Longest flight, s."""
    cameras: Mapping[str, str] = field(default_factory=dict)
    """By an image of the contract, the plant's own camera that provides it. The other images are rendered."""
    sample: float | None = None
    """Longest time between two samples of a log, s. None: no samples are kept."""
    baseline: str | None = None
    """The hover controller that flies in place of the policy. None: the policy flies."""
    agents: int = 1
    """Number of vehicles in a world: flights that are next to each other are flown in lockstep."""

    def acting(self) -> Policy | Baseline:
        """The policy or the baseline that flies.

        Raises:
            ValueError: for a policy or a baseline that cannot be loaded.
        """
        return acting(load_policy(self.policy), self.baseline, self.trained)

    def kind(self) -> type[Plant]:
        """The class of the plant.

        Raises:
            ValueError: for a plant that cannot be loaded.
        """
        kind = find_plant(self.plant)
        return kind.seeing(self.cameras) if self.cameras else kind


@dataclass(frozen=True)
class FleetFlight:
    """One flight of a mission."""

    start: RigidState
    """The state at the start."""
    course: Course
    """The course to fly."""
    reality: Reality
    """The conditions of the flight."""
    sight: "Sight | None" = None
    """The cameras and their world, for a policy that sees."""
    gates: "GateFlight | None" = None
    """How the vehicle sees the gates that tell it where it is. None: it is told the truth."""


def fly_all(
    mission: FleetMission,
    flights: Sequence[FleetFlight],
    done: Callable[[int], None] = lambda count: None,
    processes: int | None = None,
) -> list[Trajectory]:
    """Fly every start, in order. `done` is called with the number of finished flights.

    Without a number of processes, there is one per core, or only this process if more are not worth it.

    Raises:
        ValueError: for a policy or a plant that cannot be loaded, for a plant that cannot fly the realities, and for
            `processes` below 1.
    """
    if processes is not None and processes < 1:
        raise ValueError(f"processes is {processes}; accepted: 1 or more")
    check_realities(find_plant(mission.plant), mission.believed, [flight.reality for flight in flights])
    count = processes or (cores() if len(flights) >= WORTH else 1)
    if not find_plant(mission.plant).parallel or count == 1:
        return _collect(_fly(mission, flights), done)
    size = CHUNK * mission.agents
    chunks = [flights[i : i + size] for i in range(0, len(flights), size)]
    context = multiprocessing.get_context("spawn")  # a fork would copy JAX's threads in an undefined state
    contract = load_policy(mission.policy).contract
    told = contract.task, bool(contract.images) or any(flight.gates is not None for flight in flights)
    pool = ProcessPoolExecutor(min(count, len(chunks)), context, _prepare, told)
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


def _fly_chunk(mission: FleetMission, flights: Sequence[FleetFlight]) -> list[Trajectory]:
    return list(_fly(mission, flights))


def _fly(mission: FleetMission, flights: Sequence[FleetFlight]) -> Iterator[Trajectory]:
    policy, kind, agents = mission.acting(), mission.kind(), mission.agents
    with ExitStack() as stack:
        plants = kind.company(mission.believed, policy.contract, agents)
        for plant in plants:
            stack.enter_context(closing(plant))
        met = [(mission.believed.hash, False)] * agents
        for first in range(0, len(flights), agents):
            world = flights[first : first + agents]
            for i, flight in enumerate(world):
                reality = flight.reality
                if met[i] != (meets := (reality.body.hash, reality.plain_mixer)):
                    plants[i].meet(reality.body, reality.plain_mixer)
                    met[i] = meets
            yield from together(
                [_flying(mission, policy, plant, flight) for plant, flight in zip(plants, world, strict=True)]
            )


def _flying(mission: FleetMission, policy: Policy | Baseline, plant: Plant, flight: FleetFlight) -> Flying:
    names = [image.name for image in policy.contract.images]
    reality, sight = flight.reality, flight.sight
    runtime = Runtime.of(
        policy, flight.course, mission.trained, imu=True, images=sight is not None, others=mission.agents > 1,
        rotors=True,
    )  # fmt: skip
    latency = max(reality.latency - plant.latency, 0.0)
    images = None
    if sight is not None:
        own = {i: name for i, name in enumerate(names) if name in mission.cameras}
        if own:
            plant.expose({name: sight.shutter(i) for i, name in own.items()})
        images = sight.begin({i: partial(plant.shown, name) for i, name in own.items()}).images
    air, law, sample = reality.air, reality.law, mission.sample
    pose = None if flight.gates is None else flight.gates.begin(flight.course, flight.start)
    return flying(runtime, plant, flight.start, mission.duration, latency, air, sample, images, law, pose)


def _prepare(task: str, sees: bool) -> None:
    """Import the task, whose file may be the user's own, and the renderer. Leave Ctrl-C to the parent process."""
    TASKS.find(task)
    if sees:
        compute_at_once()
        prepare("cpu")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
