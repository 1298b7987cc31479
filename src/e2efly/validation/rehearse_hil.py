"""The rehearsal of hardware in the loop: all its processes in real time, with a simulated vehicle and room.

A motion capture system, the HIL node, the bridge with its watchdog, and the real firmware in a room are separate
processes. They communicate over the loopback interface and shared memory, as they would in the lab.
"""

import json
import os
import signal
import time
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from e2efly.courses.origin import Origin
from e2efly.flight.pilot.fence import check_course
from e2efly.flight.settings import Fence
from e2efly.flight.sight.shared import place
from e2efly.policy.goal import Course
from e2efly.tasks.route import Route, course_for, route_of
from e2efly.validation.bridge_session import rehearsal_settings
from e2efly.validation.candidate import Candidate
from e2efly.validation.hil_lap import TOUCH, Heard, Lap, lap_of
from e2efly.validation.mocap_process import DELAY_S
from e2efly.validation.processes import (
    FLIGHT_S,
    START_S,
    TAKEN,
    NotReadyError,
    Program,
    Room,
    Victim,
    bridge,
    flags,
    free_port,
    take_off,
)
from e2efly.validation.rehearsal import REACH_IN_SIGHT
from e2efly.validation.scene_files import SceneFile, ground_of
from e2efly.validation.scenery import Scenery
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

SETTLE_S = 3.0
"""Duration of the bridge's hover before the policy takes over, s."""
STRIKES_S = (0.4, 1.2)
"""Range of the random time in the policy's flight at which a process is killed, s."""
PILOT_S = 0.5
"""Time that a pilot needs to notice that nobody flies, s."""
WATCHDOG_S = 15.0
"""Longest time for the watchdog of a bridge to end after the pilot has disarmed, s."""
LOOP_S = 0.033
"""Time from a pose to the rate loop's setpoint without a radio, s. 25 to 40 ms were measured."""
ENDED = ("HOVER:", "LAND:", "DONE:", "PILOT:", "INIT:", TAKEN)
"""Messages of the bridge that tell of a mode other than the policy's, or of the watchdog."""
DOCUMENTED: dict[Victim, tuple[str, str]] = {
    "mocap": ("land", "no good odometry"),
    "hil": ("hover", "policy: image"),
    "watchdog": ("", "no link to the flight controller"),
}
"""The bridge's next mode after a kill, and the beginning of its reason. Empty: any mode, and the reason may follow
later, because the bridge waits for the link, and in a small room the fence may act before. A bridge that was killed
gives none."""


@dataclass(frozen=True)
class RehearsalPlan:
    """The settings of a rehearsal."""

    found: Candidate
    """The policy."""
    origin: Origin = Origin()
    """Origin of the world in the room."""
    rate: float | None = None
    """Images per second. None: the rate of the contract."""
    pose_delay: float = DELAY_S
    """Delay of the motion capture's poses, s."""
    link_delay: float | None = None
    """Delay between the bridge and the vehicle, s. None: the part of the vehicle's latency that exceeds `LOOP_S`."""
    world: Sequence[str] = ()
    """Options of `e2efly hil` that select the world: `--task.*`."""
    options: tuple[str, ...] = ()
    """Further options of `e2efly fly`."""
    scene: SceneFile | None = None
    """The scene that is shown in place of the task's world."""
    fence: Fence | None = None
    """The fence of the room. None: it is far away."""

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle that flies."""
        return load_vehicle(self.found.vehicle)

    @property
    def radio(self) -> float:
        """Delay between the bridge and the vehicle, s."""
        if self.link_delay is not None:
            return self.link_delay
        return max(self.found.policy.contract.latency_of(self.vehicle) - LOOP_S, 0.0)

    @property
    def period(self) -> float:
        """Period of the policy's control steps, s."""
        return 1 / self.found.policy.contract.control_rate_hz


@dataclass(frozen=True)
class Drawn:
    """A world and the flight in it."""

    scenery: Scenery
    route: Route
    """The route as `e2efly fly` gets it."""
    course: Course
    """The course that the bridge makes from the route."""


def draw(plan: RehearsalPlan, seed: int, track: Path) -> Drawn:
    """The world of a seed, as `e2efly hil` draws it, and the course in it.

    Gates that the task draws are written to `track`, a .toml file.

    Raises:
        ValueError: for a policy without images, for a scene in which the course cannot begin, for a task whose options
            cannot describe the course that was drawn, and for a course that the fence does not hold.
    """
    found, contract = plan.found, plan.found.policy.contract
    scenery = Scenery.draw(found.environment(next(iter(found.task.criteria().values()))), seed)
    if scenery is None:
        raise ValueError(f"policy {found.file} sees nothing; accepted: a policy with images")
    if plan.scene is not None:
        scenery = plan.scene.put(scenery)
        ground_of(scenery, f"scene {plan.scene.name}", float(plan.vehicle.radius))
    route = replace(
        route_of(contract).drawn(scenery.course, track),
        origin=plan.origin.position,
        origin_yaw=plan.origin.yaw,
        outside=bool(found.outside),
    )
    course = course_for(contract, plan.vehicle, route)
    start = np.zeros(1)
    own, wanted = (np.asarray(c.goal.goal(c.memory, start)) for c in (course, scenery.course))
    if not np.allclose(own, wanted, atol=1e-3):
        said = f"goal of task {contract.task!r} was drawn at {wanted[0].tolist()} m"
        raise ValueError(f"{said}, but options of `e2efly fly` lead to {own[0].tolist()}; accepted: a task with both")
    if plan.fence is not None:
        check_course(plan.fence, course)
    return Drawn(scenery, route, course)


def rehearse(plan: RehearsalPlan, seed: int, folder: Path, kill: Victim | None = None) -> Lap:
    """Fly one flight, from take-off to landing, in separate processes.

    One of them may be killed while the policy flies. The seed is that of the world, of the poses' noise, of the place
    where the vehicle stands, and of the time of a kill.

    Returns:
        The results of the flight. If a program fails, its last words are in the problems. If one is not ready in its
        time, the flight has not begun.

    Raises:
        ValueError: as for `draw`; or if the folder contains an earlier flight.
    """
    if (folder / "flight.mcap").exists():
        raise ValueError(f"folder {folder} holds an earlier flight; accepted: another one")
    folder.mkdir(parents=True, exist_ok=True)
    drawn = draw(plan, seed, folder / "track.toml")
    heard = Heard()
    try:
        with ExitStack() as stack:
            _Flight(plan, drawn, seed, folder, heard, stack).fly(kill)
    except NotReadyError as error:
        return Lap(seed, kill, begun=False, told="not begun", problems=(str(error),))
    except (RuntimeError, OSError) as error:
        heard.problems.append(str(error))
    radius = float(plan.vehicle.radius)
    lap = lap_of(heard, drawn.course, drawn.scenery, plan.period, radius, folder, seed, kill)
    return replace(lap, problems=(*lap.problems, *unlike(lap)))


def unlike(lap: Lap) -> list[str]:
    """Everything in a flight's records that is not as documented."""
    found = []
    if lap.touch_sink > TOUCH:
        found.append(f"touched the ground sinking at {lap.touch_sink:.1f} m/s")
    if lap.kill is None or lap.kill not in DOCUMENTED:
        return found
    wanted, reason = DOCUMENTED[lap.kill]
    after = [change for change in lap.changes if change.time > lap.window[0]]
    if not after:
        return [*found, f"after the kill the bridge changed no mode; documented: {wanted or 'any'}, {reason}"]
    told = [text for change in (after[:1] if wanted else after) for text in change.reasons]
    if wanted not in ("", after[0].mode) or not any(text.startswith(reason) for text in told):
        said = f"{after[0].mode} ({'; '.join(after[0].reasons)})"
        found.append(f"after the kill came {said}; documented: {wanted or 'any mode'} ({reason})")
    return found


class _Flight:
    """The processes of one flight, and the pilot."""

    def __init__(
        self, plan: RehearsalPlan, drawn: Drawn, seed: int, folder: Path, heard: Heard, stack: ExitStack
    ) -> None:
        self.plan, self.drawn, self.folder, self.heard = plan, drawn, folder, heard
        self.random = np.random.default_rng([seed, 2])
        contract, cores = plan.found.policy.contract, sorted(os.sched_getaffinity(0))
        ports = [free_port(), free_port()]
        names = [f"rehearsal_{os.getpid()}_{i}" for i in range(len(contract.images))]
        stack.callback(_forget, names)
        pairs = zip(contract.images, names, strict=True)
        images = [word for image, name in pairs for word in ("--image", f"{image.name}=shm:{name}")]
        to = ["--to", *map(str, ports), "--seed", str(seed), "--delay", f"{plan.pose_delay:.6g}"]
        self.mocap = Program("motion capture", ["-m", "e2efly.validation.mocap_process", *to])
        stack.enter_context(self.mocap)
        inlet = json.loads(self.mocap.ready('"from"'))["from"]
        node = ["--pose", f"udp:{ports[0]}", "--seed", str(seed), "--json", str(folder / "node.json")]
        node += ["--track", str(folder / "track.toml"), *images]
        node += ["--origin", *(f"{x:.9g}" for x in plan.origin.position), "--origin-yaw", f"{plan.origin.yaw:.9g}"]
        node += [] if plan.rate is None else ["--rate", f"{plan.rate:g}"]
        flies = ["--vehicle", plan.found.vehicle]
        # rendering takes only one core, because the firmware and the bridge need the others
        policy = str(plan.found.file)
        world = [*plan.world, *([] if plan.scene is None else plan.scene.options)]
        self.node = Program("the HIL node", ["-m", "e2efly", "hil", policy, *node, *flies, *world], cores[-1])
        stack.enter_context(self.node)
        self.node.ready("Fly it with", 2 * START_S)
        stands = ["--at", *(f"{x:.6g}" for x in self._stand()), "--exact", "--record", str(folder / "truth.csv")]
        self.room = Room(plan.found.vehicle, seed, stands, cores[0], inlet)
        stack.enter_context(self.room)
        link = None if plan.radio == 0.0 else self._radio(stack)
        height = float(self._first()[2] - plan.vehicle.feet_height)  # of the hover, above where the vehicle stood, m
        settings = rehearsal_settings(height, REACH_IN_SIGHT, plan.fence)
        options = [*flags("flight", settings), *images, "--envelope.speed", "8"]
        options += [*flags("goal", drawn.route), *flies, *plan.options]
        log = folder / "flight.mcap"
        self.flies = bridge(Path(policy), self.room, log, options, link, f"udp:{ports[1]}", urgent=True)
        stack.enter_context(self.flies)

    def _radio(self, stack: ExitStack) -> str:
        """Start the radio. Returns the address to which the bridge connects."""
        to = ["--to", self.room.link.rpartition(":")[2], "--delay", f"{self.plan.radio:.6g}"]
        self.radio = Program("the radio", ["-m", "e2efly.validation.link_process", *to])
        stack.enter_context(self.radio)
        return json.loads(self.radio.ready('"link"'))["link"]

    def _first(self) -> np.ndarray:
        return self.drawn.course.origin.points(self.drawn.course.start)

    def _stand(self) -> tuple[float, float, float]:
        """The place where the vehicle is put down: x, y, m, and heading, rad."""
        course, (x, y) = self.drawn.course, self._first()[:2] + self.random.uniform(-0.2, 0.2, 2)
        yaw = self.random.uniform(-0.05, 0.05) + course.origin.yaw + (course.heading or 0.0)
        return float(x), float(y), float(yaw)

    def fly(self, kill: Victim | None) -> None:
        """Let the pilot fly, and kill one process if one is to be killed."""
        room, flies, heard = self.room, self.flies, self.heard
        take_off(room, flies)
        time.sleep(SETTLE_S)
        room.set(mission="policy")
        flies.wait_for("POLICY:", 5.0)
        heard.began = time.monotonic()
        watchdog = _child(flies.process.pid)
        if kill is None:
            longest = route_of(self.plan.found.policy.contract).longest_s
            ended = flies.heard(ENDED, longest)
            heard.ended = time.monotonic()
            if not ended:
                heard.problems.append(f"the policy was still at it after {longest:g} s")
            self._land()
        else:
            time.sleep(float(self.random.uniform(*STRIKES_S)))
            if flies.heard(ENDED, 0.001):
                heard.problems.append(f"the policy's flight was over before the kill: {flies.said[-1]}")
            self._strike(kill, watchdog)
        self._end(kill, watchdog)

    def _strike(self, kill: Victim, watchdog: int | None) -> None:
        room, flies, heard = self.room, self.flies, self.heard
        heard.struck = heard.ended = time.monotonic()
        if kill == "watchdog":
            if watchdog is None:
                raise RuntimeError("the bridge has no watchdog process")
            os.kill(watchdog, signal.SIGKILL)
        else:
            {"mocap": self.mocap, "hil": self.node, "bridge": flies}[kill].process.kill()
        if kill == "bridge":
            if not room.down(FLIGHT_S):
                heard.problems.append("it did not land, or the throttle was not closed")
        elif kill == "watchdog":
            time.sleep(PILOT_S)
            if not room.land_by_hand(FLIGHT_S):
                heard.problems.append("the pilot could not land it")
        else:
            if not flies.heard(ENDED, 5.0):
                heard.problems.append("the bridge went on")
            self._land()

    def _land(self) -> None:
        """Hover for a moment, unless the vehicle already lands. Then the pilot requests the landing."""
        room, flies = self.room, self.flies
        if "HOVER:" in flies.said[-1] and not self.drawn.course.goal.lands:
            room.set(mission="hover")
            time.sleep(1.5)
        room.set(mission="land")
        if "DONE:" not in flies.said[-1] and TAKEN not in flies.said[-1]:
            flies.heard(("DONE:", TAKEN), FLIGHT_S)
        if TAKEN in flies.said[-1]:
            self.heard.problems.append(flies.said[-1].strip())
            room.down(FLIGHT_S)
        elif "DONE:" not in flies.said[-1]:
            self.heard.problems.append(f"it did not land{flies.end_told()}")

    def _end(self, kill: Victim | None, watchdog: int | None) -> None:
        room, heard = self.room, self.heard
        if not room.until(3.0, lambda state: state["standing"]):  # it may bounce
            heard.problems.append("it is not on the ground")
        heard.touches = room.set(armed=False)["touches"]
        time.sleep(0.5)
        if kill != "bridge" and (status := self.flies.end(5.0)) != 0 and kill != "watchdog":
            heard.problems.append(f"the bridge ended with status {status}{self.flies.end_told()}")
        if kill != "hil" and (status := self.node.end(15.0)) != 0:
            heard.problems.append(f"the HIL node ended with status {status}{self.node.end_told()}")
        if kill != "mocap" and (status := self.mocap.leave()) != 0:
            heard.problems.append(f"motion capture ended with status {status}{self.mocap.end_told()}")
        if watchdog is not None and not _gone(watchdog, WATCHDOG_S):
            heard.problems.append("the watchdog did not end")
            with suppress(OSError):
                os.kill(watchdog, signal.SIGKILL)


def _child(process: int) -> int | None:
    """The process that a bridge has started: its watchdog."""
    for task in Path(f"/proc/{process}/task").glob("*/children"):
        if found := task.read_text().split():
            return int(found[0])
    return None


def _gone(process: int, seconds: float) -> bool:
    """Whether a process ends within `seconds`. A process whose parent has not read its exit status counts as ended."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return True
        if state == "Z":
            return True
        time.sleep(0.05)
    return False


def _forget(names: Sequence[str]) -> None:
    """Remove the rehearsal's images from the machine's memory."""
    for name in names:
        file = place(name)
        for left in [file, *file.parent.glob(f"{file.name}.*")]:
            left.unlink(missing_ok=True)
