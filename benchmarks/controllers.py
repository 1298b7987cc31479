"""The hover controllers: steps, circles, a wrong mass, wind and a sagging battery, in MuJoCo and the real firmware; and
in place of the zoo's policies, under stress.

    python benchmarks/controllers.py [--parts mujoco betaflight stress] [--flights 3] [--episodes 250] [--json FILE]

Flights are of VIS-R at 100 Hz, with poses that are 30 ms old and noisy, and 10 ms from the command to the rate loop.
INDI's rotor speeds are MuJoCo's, and on the rig its world's (`tests.validation.speeds`), as the SITL measures none.
Time is virtual. Parts that are not named stay as they are in the file.
"""

import dataclasses
import json
import math
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from common import RESULTS, arguments, table, write
from tests.validation.speeds import SpeedLink

from e2efly.control import Ctbr, Vec3
from e2efly.control.place import Place
from e2efly.flight.link import open_link
from e2efly.flight.pilot.flight_state import Mode
from e2efly.flight.pilot.hovering import HoverController, Seen, UnderWay, hover_controller, sent, thrust_of
from e2efly.validation import firmware_program
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.firmware_rig import POSE_NOISE
from e2efly.validation.plant import Delay, RigidState
from e2efly.validation.plant_flight import imu_of
from e2efly.validation.rig import Rig
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

NAMES = ("pid", "geometric", "indi", "mpc")
POSES, LINK, PERIOD = 0.03, 0.01, 0.01
"""Age of the poses, time from the command to the rate loop, control period, s."""
SECONDS, HEIGHT, RADIUS = 12.0, 2.0, 1.5
"""A case lasts so long, s; height of the hover and radius of the circles, m."""
STEP = np.array([1.0, 0.0, 0.5])
"""m."""
SAG = 0.15
"""Share of the thrust that is lost over a case."""
TASKS = ("hover", "land", "track", "race")
ROWS = (
    "nominal", "mass x1.25", "thrust falls by 15 %", "motor lag x2", "delay +40 ms", "wind 3 m/s", "gusts 1.5 m/s",
    "one rotor 10 % weaker", "centre of mass 5 mm off", "noise and drift of a VIO", "all at once",
)  # fmt: skip
"""Of the stress: those that separate them."""


@dataclass(frozen=True)
class Case:
    """What is flown, from rest at the origin."""

    name: str
    figures: tuple[str, ...]
    """Of `FIGURES`."""
    step: bool = False
    circle: float = 0.0
    """Speed, m/s."""
    mass: float = 1.0
    """Over the vehicle file's, from before the take-off on."""
    wind: float = 0.0
    """From the beginning of the case on, m/s."""
    sag: float = 0.0

    def place(self, at: float) -> Place:
        """Where to be, relative to the origin, at so many seconds."""
        if self.step:
            return Place(Vec3(*STEP.tolist()), yaw=0.0)
        w = self.circle / RADIUS
        c, s = RADIUS * math.cos(w * at), RADIUS * math.sin(w * at)
        return Place(
            Vec3(c - RADIUS, s, 0.0), Vec3(-s, c, 0.0) * w, Vec3(-c, -s, 0.0) * w**2, Vec3(s, -c, 0.0) * w**3, 0.0
        )


CASES = (
    Case("step of 1.1 m", ("settles", "overshoot"), step=True),
    Case("circle at 1 m/s", ("off",), circle=1.0),
    Case("circle at 3 m/s", ("off",), circle=3.0),
    Case("20 % more mass", ("most", "left"), mass=1.2),
    Case("wind of 3 m/s", ("most", "left"), wind=3.0),
    Case("thrust falls by 15 %", ("most", "left"), sag=SAG),
)
Figure = Callable[[np.ndarray, np.ndarray], float]
FIGURES: dict[str, tuple[str, Figure]] = {
    "settles": ("within 10 cm after", lambda t, off: float(np.max(t[off > 0.1], initial=0.0))),
    "overshoot": ("past it", lambda t, off: math.nan),
    "off": ("off, mean", lambda t, off: float(off[t > SECONDS / 2].mean())),
    "most": ("off, most", lambda t, off: float(off.max())),
    "left": ("off in the end", lambda t, off: float(off[t > SECONDS - 1.0].mean())),
}
"""What is told of a flight: in words, and from times, s, and distances, m."""


def figures(case: Case, times: np.ndarray, way: np.ndarray) -> dict[str, float]:
    """The figures of a flight; way (t, 3) from the origin, m."""
    wanted = np.array([[p.x, p.y, p.z] for p in (case.place(float(t)).position for t in times)])
    off = np.linalg.norm(way - wanted, axis=1)
    found = {name: FIGURES[name][1](times, off) for name in case.figures}
    if "overshoot" in found:
        found["overshoot"] = max(float(((way - STEP) @ STEP).max() / np.linalg.norm(STEP)), 0.0)
    return found


def in_mujoco(name: str, case: Case, vehicle: Vehicle, seed: int) -> dict[str, float]:
    """One case on the plant; the flight begins in a hover."""
    from e2efly.validation.plants.mujoco import MujocoPlant

    controller, noise = hover_controller(name, vehicle, POSES + LINK), np.random.default_rng(seed)
    plant = MujocoPlant(vehicle, "ctbr")
    plant.meet(dataclasses.replace(vehicle, mass=vehicle.mass * case.mass))
    origin = np.array([0.0, 0.0, HEIGHT])
    plant.reset(RigidState(origin, np.zeros(3), np.eye(4)[0], np.zeros(3)))
    delay, memory, under_way = Delay.of(LINK, np.array([GRAVITY, 0, 0, 0])), controller.begin(), UnderWay()
    settle, states, speeds, last = 3.0 if case.mass == 1 else 0.0, [plant.state], [plant.rotor_speed], None
    times, way = [], []
    for k in range(round((settle + SECONDS) / PERIOD)):
        at = k * PERIOD - settle
        seen = _seen(vehicle, states, speeds, noise)
        under_way = under_way if last is None else sent(under_way, last, PERIOD, vehicle, POSES + LINK)
        place = case.place(at) if at >= 0 else Place(Vec3(0.0, 0.0, 0.0), yaw=0.0)
        memory, last = controller.step(memory, seen, under_way, _raised(place), PERIOD)
        command = np.array([last.thrust, last.rate.x, last.rate.y, last.rate.z], np.float64)
        delay, parts = delay.send(command, k * PERIOD).until(k * PERIOD, (k + 1) * PERIOD)
        share = 1 - case.sag * min(max(at, 0.0) / SECONDS, 1.0)
        plant.disturb(np.array([case.wind if at >= 0 else 0.0, 0.0, 0.0]), np.full(4, share))
        for held, seconds in parts:
            plant.step(held, seconds)
        states.append(plant.state)
        speeds.append(plant.rotor_speed)
        if at >= 0:
            times.append(at + PERIOD)
            way.append(states[-1].position - origin)
    return figures(case, np.array(times), np.array(way))


def _raised(place: Place) -> Place:
    return dataclasses.replace(place, position=place.position + Vec3(0.0, 0.0, HEIGHT))


def _seen(vehicle: Vehicle, states: list[RigidState], speeds: list[np.ndarray], noise: np.random.Generator) -> Seen:
    """What a pose of `POSES` ago tells, as noisy as the rig's; the inertial sensors and the rotors a link later."""
    from e2efly.control import Quat

    old, now = max(len(states) - 1 - round(POSES / PERIOD), 0), max(len(states) - 1 - round(LINK / PERIOD), 0)
    pose, (p, v, w, q) = states[old], POSE_NOISE
    attitude = pose.quaternion + q / 2 * noise.normal(size=4)
    imu = imu_of(states[max(now - 1, 0)], states[now], PERIOD)
    position, velocity, rate = (
        Vec3(*(x + sigma * noise.normal(size=3)).tolist())
        for x, sigma in ((pose.position, p), (pose.velocity, v), (pose.body_rate, w))
    )
    return Seen(
        position, velocity, Quat(*(attitude / np.linalg.norm(attitude)).tolist()), rate,
        force=Vec3(*imu.accelerometer.tolist()), age=POSES, thrust=thrust_of(vehicle, speeds[now].tolist()),
    )  # fmt: skip


@dataclass
class Along:
    """A hover controller that is led along a case, from the moment that it begins on."""

    controller: HoverController
    clock: Callable[[], float]
    case: Case | None = None
    begun: float = 0.0
    origin: Vec3 = Vec3(0.0, 0.0, 0.0)

    @property
    def needs(self) -> tuple[str, ...]:
        """As the controller's."""
        return self.controller.needs

    def begin(self) -> Any:
        """As the controller's."""
        return self.controller.begin()

    def step(
        self, memory: Any, seen: Seen, under_way: UnderWay, place: Place, dt: float, *, held: bool = False
    ) -> tuple[Any, Ctbr]:
        """As the controller's, to where the case is now."""
        if self.case is not None:
            led = self.case.place(self.clock() - self.begun)
            place = dataclasses.replace(led, position=led.position + self.origin, yaw=place.yaw)
        return self.controller.step(memory, seen, under_way, place, dt, held=held)


def in_firmware(rig: Rig, name: str, case: Case, vehicle: Vehicle) -> dict[str, float]:
    """One case by the bridge, after a take-off; the flight lands."""
    rig.carry(vehicle)
    rig.state, rig.wind, rig.thrust_shares = rig.world.at_rest(), np.zeros(3), np.ones(4)
    along = Along(hover_controller(name, vehicle, POSES + LINK), rig.now)
    settings = dataclasses.replace(rehearsal_settings(HEIGHT), follow_distance=50.0)
    link = open_link(rig.sitl.msp)
    link = SpeedLink(link, rig) if name == "indi" else link
    session = Session(rig, settings, hover=along, autopilot=rig.autopilot(settings, along, link=link))
    try:
        rig.carry(dataclasses.replace(vehicle, mass=vehicle.mass * case.mass))
        settle = 3.0 if case.mass == 1 else 0.0
        if not session.take_off(settle):
            raise RuntimeError(f"{name}, {case.name}: no hover: {session.bridge.flight.reasons}")
        target = session.bridge.flight.target
        assert target is not None
        origin = np.array(target.position)
        along.begun, along.origin, along.case = rig.now(), Vec3(*target.position), case
        rig.wind = np.array([case.wind, 0.0, 0.0])
        times, way = [], []
        while (at := rig.now() - along.begun) < SECONDS:
            rig.thrust_shares = np.full(4, 1 - case.sag * at / SECONDS)
            session.step()
            times.append(rig.now() - along.begun)
            way.append(session.flown.position[-1] - origin)
        if session.bridge.flight.mode is not Mode.HOVER:
            raise RuntimeError(f"{name}, {case.name}: {session.bridge.flight.mode}: {session.bridge.flight.reasons}")
        along.case, rig.wind, rig.thrust_shares = None, np.zeros(3), np.ones(4)
        if not session.land():
            raise RuntimeError(f"{name}, {case.name}: not landed: {session.bridge.flight.reasons}")
    finally:
        session.close()
    return figures(case, np.array(times), np.array(way))


def flights(plant: str, count: int) -> list[dict[str, Any]]:
    """Every controller through every case on a plant: rows of figures, the means of so many flights."""
    vehicle, found = load_vehicle("vis_r"), {}
    for seed in range(count):
        if plant == "mujoco":
            each = {(name, case.name): in_mujoco(name, case, vehicle, seed) for name in NAMES for case in CASES}
        else:
            with tempfile.TemporaryDirectory() as folder:
                rig = Rig(firmware_program.chosen(), Path(folder), vehicle, latency=POSES, seed=seed)
                with rig:
                    rig.sleep(0.5)
                    each = {
                        (name, case.name): in_firmware(rig, name, case, vehicle) for name in NAMES for case in CASES
                    }
        for key, values in each.items():
            found.setdefault(key, []).append(values)
        print(f"{plant}: round {seed + 1} of {count} flown", flush=True)
    rows = []
    for case in CASES:
        for figure in case.figures:
            means = {name: float(np.mean([f[figure] for f in found[name, case.name]])) for name in NAMES}
            shown = {n: f"{x:.2f} s" if figure == "settles" else f"{100 * x:.1f} cm" for n, x in means.items()}
            rows.append({"where": plant, "flown": case.name, "": FIGURES[figure][0], **shown})
    return rows


def under_stress(task: str, episodes: int) -> list[dict[str, Any]]:
    """Percent of success of the zoo's policy and of each controller in its place, by row of the stress."""
    from e2efly.validation.stress import stress

    found = {}
    for name in (None, *NAMES):
        began = time.perf_counter()
        found[name or "policy"] = stress(task, episodes, rows=ROWS, baseline=name)
        print(f"{task} by {name or 'the policy'}: {time.perf_counter() - began:.0f} s", flush=True)
    rows = [
        {"task": task, "row": row} | {who: f"{100 * report.success[row]:.1f}" for who, report in found.items()}
        for row in found["policy"].flown
    ]
    nominal = {who: np.mean([e.mean_error.mean() for e in r.flown["nominal"].values()]) for who, r in found.items()}
    if task != "race":
        rows.append({"task": task, "row": "mean error, nominal"} | {w: f"{100 * x:.1f} cm" for w, x in nominal.items()})
    return rows


def main() -> None:
    """Fly, print the tables, write the figures."""
    args = arguments(__doc__ or "", parts=["mujoco", "betaflight", "stress"], flights=3, episodes=250)
    path = args.json or RESULTS / "controllers.json"
    earlier = json.loads(path.read_text()) if path.exists() else {"table": [], "tables": []}
    flown = {plant: [row for row in earlier["table"] if row["where"] == plant] for plant in ("mujoco", "betaflight")}
    for plant in flown:
        if plant in args.parts:
            flown[plant] = flights(plant, args.flights)
            print(table(flown[plant]))
    tables = earlier["tables"]
    if "stress" in args.parts:
        tables = []
        for task in TASKS:
            tables.append(under_stress(task, args.episodes))
            print(table(tables[-1]), flush=True)
    write("controllers", args.json, {"table": [row for rows in flown.values() for row in rows], "tables": tables})


if __name__ == "__main__":
    main()
