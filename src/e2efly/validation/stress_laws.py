"""Rows of the stress from laws that no training draws from: another family of each effect.

A law is a pure function of its setting. It returns those entries of `LawStep` that it changes, with the shapes (t, n,
...) of t control steps of n flights, or shapes that broadcast to them. The order of the control steps is that of the
flight, so a law may change within a flight. Every number is drawn with NumPy before the flight, for the training
simulator and for plants alike. Imports no JAX.

Speeds of the air scale with the square root of the vehicle's size (Froude), and lengths with its size, about the VIS-R.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.validation.law_step import BODY, LawStep
from e2efly.vehicles.vehicle import Vehicle, rotor_arms

ARM = 0.075
"""Distance of the rotors of the VIS-R from its centre of mass, m."""
LATEST = 0.04
"""Largest time that a law adds to the latency, and largest age of a velocity, s."""
UNFILTERED = 1e-6
"""Time constant of a filter that is not there, s."""
MAST_WIND = 6.0
"""Mean wind at a height of 20 ft, of a vehicle as large as the VIS-R, m/s."""
Entries = dict[str, Any]


@dataclass(frozen=True)
class LawSetting:
    """What a law is drawn for."""

    vehicle: Vehicle
    """The vehicle that flies, one, as loaded."""
    rng: np.random.Generator
    n: int
    """Number of flights."""
    steps: int
    """Control steps of the longest flight."""
    period: float
    """Control period, s."""

    @property
    def time(self) -> np.ndarray:
        """(t, 1) since the start, s."""
        return np.arange(self.steps)[:, None] * self.period

    @property
    def progress(self) -> np.ndarray:
        """(t, 1) share of the longest flight that is over, in [0, 1)."""
        return np.arange(self.steps)[:, None] / self.steps

    @property
    def size(self) -> float:
        """Size of the vehicle, relative to the VIS-R."""
        return float(np.mean(np.linalg.norm(rotor_arms(self.vehicle), axis=1))) / ARM

    def normal(self, *shape: int) -> np.ndarray:
        """(t, n, *shape) standard normal numbers."""
        return self.rng.standard_normal((self.steps, self.n, *shape))

    def walk(self, *shape: int) -> np.ndarray:
        """(t, n, *shape) random walks from zero, with a standard deviation of 1 after 1 s."""
        return np.cumsum(self.normal(*shape), axis=0) * math.sqrt(self.period)

    def errors(self, **parts: Any) -> np.ndarray:
        """(t, n, 12) `LawStep.error` of the parts position, velocity, attitude (an angle) and body_rate."""
        error = np.zeros((self.steps, self.n, 12))
        for name, value in parts.items():
            at = ("position", "velocity", "attitude", "body_rate").index(name)
            error[..., 3 * at : 3 * at + 3] = value / 2 if name == "attitude" else value
        return error

    def level(self) -> np.ndarray:
        """(n, 3) random horizontal directions, unit vectors."""
        angle = self.rng.uniform(-math.pi, math.pi, self.n)
        return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)

    def once(self) -> np.ndarray:
        """(t, n) 0 before a random moment in the first half of the longest flight, 1 after it."""
        return 1.0 * (self.progress >= self.rng.uniform(0.1, 0.5, self.n))

    def one_rotor(self) -> np.ndarray:
        """(n, r) 1 for a random rotor, 0 for the others."""
        return np.eye(self.vehicle.rotor_count)[self.rng.integers(0, self.vehicle.rotor_count, self.n)]


def bursts(s: LawSetting, share: float, mean: float) -> np.ndarray:
    """(t, n) 0 or 1, of the chain of two states of Gilbert (1960): 1 for a given share of the time, in bursts of a mean
    length in s. The lengths of the bursts are geometrically distributed. A flight begins with 0.
    """
    ends = s.period / mean
    begins = ends * share / (1 - share)
    bad, rows = np.zeros(s.n, bool), []
    for change in s.rng.uniform(size=(s.steps, s.n)):
        rows.append(bad)
        bad = np.where(bad, change >= ends, change < begins)
    return 1.0 * np.array(rows)


def dryden(s: LawSetting, mean: float) -> np.ndarray:
    """(t, n, 3) turbulence along the mean wind, across it and upwards, m/s, by the forms of Dryden at the lowest height
    of MIL-F-8785C's low-altitude model (10 ft), for a mean wind at 20 ft, m/s, which carries it past the vehicle.

    Lengths scale with the size of the vehicle. The filters are sampled exactly: the state of each is a linear process
    with a known covariance.
    """
    feet = 0.3048 * s.size
    base = 0.177 + 0.000823 * 10
    along, up = 10 / base**1.2 * feet, 10 * feet
    sigma = 0.1 * mean
    speed = max(mean, 1e-6)
    fast = _first_order(s, along / speed) * sigma / base**0.4
    side = _second_order(s, along / speed) * sigma / base**0.4
    return np.stack([fast, side, _second_order(s, up / speed) * sigma], axis=-1)


def _first_order(s: LawSetting, time: float) -> np.ndarray:
    """(t, n) of variance 1 and the spectrum of 1 / (1 + T s)."""
    kept, noise = math.exp(-s.period / time), s.normal()
    for k in range(1, s.steps):
        noise[k] = kept * noise[k - 1] + math.sqrt(1 - kept**2) * noise[k]
    return noise


def _second_order(s: LawSetting, time: float) -> np.ndarray:
    """(t, n) of variance 1 and the spectrum of (1 + sqrt(3) T s) / (1 + T s)^2.

    With two states x' = -x/T + w, y' = (x - y)/T of the white noise w, the output is sqrt(3) x + (1 - sqrt(3)) y.
    """
    h = s.period / time
    move = math.exp(-h) * np.array([[1.0, 0.0], [h, 1.0]])
    settled = np.array([[0.5, 0.25], [0.25, 0.25]])  # of w with the spectral density T
    fresh, root = np.linalg.cholesky(settled - move @ settled @ move.T), np.linalg.cholesky(settled)
    noise = s.normal(2)
    state = noise[0] @ root.T
    out = np.array([math.sqrt(3.0), 1 - math.sqrt(3.0)])
    rows = [state @ out]
    for k in range(1, s.steps):
        state = state @ move.T + noise[k] @ fresh.T
        rows.append(state @ out)
    return np.array(rows) / math.sqrt(out @ settled @ out)


def late_velocity(s: LawSetting) -> Entries:
    """A pure delay of the velocity, as of an estimator that waits for its filter."""
    return {"velocity_age": LATEST}


def velocity_of_differences(s: LawSetting) -> Entries:
    """The velocity is the difference of poses with an error of 1 mm."""
    return {"derived": 1.0, "error": s.errors(position=0.001 * s.normal(3))}


def magnet_drift(s: LawSetting, degrees: float) -> Entries:
    """The heading walks at random. It is at most this far off, and once in the flight it is."""
    walk = s.walk()
    return {"heading": math.radians(degrees) * walk / np.maximum(np.abs(walk).max(axis=0), 1e-9)}


def magnet_beside_wires(s: LawSetting) -> Entries:
    """The current of the motors turns the compass: 4 degrees for each weight of thrust above the vehicle's own."""
    return {"heading_by_load": math.radians(4) * s.rng.choice([-1.0, 1.0], s.n)}


def long_metre(s: LawSetting) -> Entries:
    """A motion capture with a wand of the wrong length."""
    return {"stretch": 0.01 * s.rng.choice([-1.0, 1.0], s.n)}


def heavy_tails(s: LawSetting) -> Entries:
    """Student's t with 3 degrees of freedom: its standard deviation is sqrt(3) times these numbers."""
    t = s.rng.standard_t(3, (s.steps, s.n, 12))
    sizes = {"position": 0.004, "velocity": 0.03, "attitude": 0.004, "body_rate": 0.02}
    parts = {name: size * t[..., 3 * i : 3 * i + 3] for i, (name, size) in enumerate(sizes.items())}
    return {"error": s.errors(**parts)}


def outliers(s: LawSetting) -> Entries:
    """One position of fifty is 20 cm off, in a random direction."""
    way = s.normal(3)
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    return {"error": s.errors(position=0.2 * way * (s.rng.uniform(size=(s.steps, s.n, 1)) < 0.02))}


def bent_propeller(s: LawSetting) -> Entries:
    """The gyroscope shakes at the speed of one rotor in hover, with 0.5 rad/s about the roll and pitch axes. The policy
    sees the alias at its control rate.
    """
    turns = s.vehicle.hover_rotor_speed / (2 * math.pi) * s.rng.uniform(0.97, 1.03, s.n)
    phase = 2 * math.pi * (turns * s.time + s.rng.uniform(size=s.n))
    return {"error": s.errors(body_rate=0.5 * np.stack([np.sin(phase), np.cos(phase), 0 * phase], axis=-1))}


def soft_mount(s: LawSetting) -> Entries:
    """The markers swing about on their mount, at 7 Hz: 2 degrees of roll and pitch, 1 cm across."""
    phase = 2 * math.pi * (7 * s.time + s.rng.uniform(size=s.n))
    swing = np.stack([np.sin(phase), np.cos(phase), 0 * phase], axis=-1)
    return {"error": s.errors(attitude=math.radians(2) * swing, position=0.01 * swing)}


def multipath(s: LawSetting) -> Entries:
    """Radio positions that swing by 3 cm along a random axis, seven times in 10 s."""
    swing = np.sin(2 * math.pi * (0.7 * s.time + s.rng.uniform(size=s.n)))
    return {"error": s.errors(position=0.03 * swing[..., None] * np.eye(3)[s.rng.integers(0, 3, s.n)])}


def gyro_bias_walk(s: LawSetting) -> Entries:
    """The bias of the gyroscope walks by 0.02 rad/s per axis in the first second."""
    return {"error": s.errors(body_rate=0.02 * s.walk(3))}


def coarse_poses(s: LawSetting) -> Entries:
    """Messages with few bits."""
    return {"grain": np.array([0.01, 0.05, 1 / 128, 0.05])}


def held_poses(s: LawSetting) -> Entries:
    """The source of the poses stalls for 0.1 s in the mean, a tenth of the time."""
    return {"held": bursts(s, 0.1, 0.1)}


def jammed_radio(s: LawSetting) -> Entries:
    """Commands are lost for 0.1 s in the mean, a twentieth of the time."""
    return {"lost": bursts(s, 0.05, 0.1)}


def coarse_commands(s: LawSetting) -> Entries:
    """256 levels of each command."""
    return {"command_grain": 2 / 255}


def loose_sticks(s: LawSetting) -> Entries:
    """The link passes on a change of a command only beyond a play of 1 % of half its range."""
    return {"play": 0.01}


def sawtooth_delay(s: LawSetting) -> Entries:
    """Two clocks that run apart: the delay grows evenly by 40 ms in 2 s, and falls back at once."""
    return {"later": LATEST * ((s.time / 2 + s.rng.uniform(size=s.n)) % 1)}


def wandering_delay(s: LawSetting) -> Entries:
    """The delay walks at random by 20 ms in the first second, reflected at 0 and 40 ms."""
    walk = s.rng.uniform(0, LATEST, s.n) + 0.02 * s.walk()
    return {"later": LATEST - np.abs(walk % (2 * LATEST) - LATEST)}


def storm(s: LawSetting) -> Entries:
    """A mean wind that falls towards the ground, with turbulence."""
    mean, along = MAST_WIND * math.sqrt(s.size), s.level()
    across = np.stack([-along[:, 1], along[:, 0], 0 * along[:, 0]], axis=1)
    u, v, w = np.moveaxis(dryden(s, mean)[..., None], 2, 0)
    return {"wind": (mean + u) * along + v * across + w * np.array([0.0, 0.0, 1.0]), "shear": 1.0}


def gust_front(s: LawSetting) -> Entries:
    """Still air until a random moment; then a wind of 5 m/s within 1 s, as 1 - cosine (MIL-F-8785C, discrete gust)."""
    since = np.clip(s.time - s.rng.uniform(0.1, 0.5, s.n) * s.steps * s.period, 0, 1)
    return {"wind": (2.5 * math.sqrt(s.size) * (1 - np.cos(math.pi * since)))[..., None] * s.level()}


def whirl(s: LawSetting) -> Entries:
    """A wind of 3 m/s that turns once around in 3 s."""
    angle = 2 * math.pi * (s.time / 3 * s.rng.choice([-1.0, 1.0], s.n) + s.rng.uniform(size=s.n))
    speed = 3.0 * math.sqrt(s.size)
    return {"wind": speed * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)}


def inflow(s: LawSetting) -> Entries:
    """The thrust falls by 2 % for each m/s of climb, and rises in a descent."""
    return {"inflow": 0.02}


def ground_effect(s: LawSetting) -> Entries:
    """The four rotors feel the ground as one of twice the radius of the arms does."""
    return {"cushion": 2 * ARM * s.size}


def battery_collapses(s: LawSetting) -> Entries:
    """A cell fails: all thrust falls by 15 % at once."""
    return {"share": (1 - 0.15 * s.once())[..., None]}


def brown_outs(s: LawSetting) -> Entries:
    """A loose contact: dips of all thrust by 25 % for 0.1 s in the mean, a tenth of the time."""
    return {"share": (1 - 0.25 * bursts(s, 0.1, 0.1))[..., None]}


def chipped_propeller(s: LawSetting) -> Entries:
    """One rotor loses 10 % of its thrust at once."""
    return {"share": 1 - 0.1 * s.once()[..., None] * s.one_rotor()}


def lost_steps(s: LawSetting) -> Entries:
    """The motor of one rotor loses its step for 0.07 s in the mean, a fiftieth of the time: half of its thrust."""
    return {"share": 1 - 0.5 * bursts(s, 0.02, 0.07)[..., None] * s.one_rotor()}


def rough_bearing(s: LawSetting) -> Entries:
    """The thrust of one rotor swings by 10 %, three times in 2 s."""
    swing = np.sin(2 * math.pi * (1.5 * s.time + s.rng.uniform(size=s.n)))
    return {"share": 1 + 0.1 * swing[..., None] * s.one_rotor()}


def hot_motors(s: LawSetting) -> Entries:
    """The largest thrust falls to 80 %, as the motors warm up with a time constant of 3 s."""
    return {"ceiling": 0.8 + 0.2 * np.exp(-s.time / 3)}


def worn_motors(s: LawSetting) -> Entries:
    """The largest thrust of a vehicle is 1 - x of what it was, by a power law: P(x > y) = (y / 0.02)^-1.5, at most 0.3
    (Pareto).
    """
    return {"ceiling": 1 - np.minimum(0.02 * s.rng.uniform(size=s.n) ** (-1 / 1.5), 0.3)}


def bent_thrust_curve(s: LawSetting) -> Entries:
    """Another thrust curve with the same thrust in hover and at rest: 12 % less at full speed, more below hover."""
    (k2, k1, k0), hover = s.vehicle.thrust_map, s.vehicle.hover_rotor_speed
    full = s.vehicle.full_rotor_speed
    bend = 0.12 * s.vehicle.thrust_range[1] / (full * (full - hover))
    return {"thrust_map": np.array([k2 - bend, k1 + bend * hover, k0])}


def slow_braking(s: LawSetting) -> Entries:
    """Rotors slow down half as fast as they speed up."""
    return {"motor_time_constant_down": 2 * s.vehicle.motor_time_constant}


def filtered_gyro(s: LawSetting) -> Entries:
    """The rate loop reads the body rates through a low-pass of 10 ms, for noise that it would not bear."""
    return {"gyro_time_constant": 0.01}


def loose_battery(s: LawSetting) -> Entries:
    """The centre of mass moves by 4 mm at once, in a random direction."""
    return {"shift": 0.004 * s.size * s.once()[..., None] * s.level()[:, :2]}


def payload_falls(s: LawSetting) -> Entries:
    """15 % of the mass is lost at once."""
    return {"mass": 1 - 0.15 * s.once()}


@dataclass(frozen=True)
class StressLaw:
    """A row of the stress that no training draws from."""

    name: str
    entries: Callable[[LawSetting], Entries]
    alters: frozenset[str] = frozenset()
    """What a plant must change for it. Empty: it acts between plant and policy."""


def _rows(alters: str, **laws: Callable[[LawSetting], Entries]) -> list[StressLaw]:
    return [StressLaw(name, law, frozenset(alters.split(", ")) - {""}) for name, law in laws.items()]


LAWS: dict[str, StressLaw] = {
    law.name: law
    for law in (
        *_rows("", **{
            "velocity 40 ms late": late_velocity,
            "velocity from differences": velocity_of_differences,
            "heading drifts by 5 degrees": lambda s: magnet_drift(s, 5),
            "heading drifts by 10 degrees": lambda s: magnet_drift(s, 10),
            "compass beside wires": magnet_beside_wires,
            "metre 1 % wrong": long_metre,
            "noise with heavy tails": heavy_tails,
            "positions with outliers": outliers,
            "bent propeller": bent_propeller,
            "mount that swings": soft_mount,
            "positions with multipath": multipath,
            "gyroscope's bias walks": gyro_bias_walk,
            "coarse poses": coarse_poses,
            "poses held in bursts": held_poses,
            "commands lost in bursts": jammed_radio,
            "commands in 256 levels": coarse_commands,
            "play of the commands": loose_sticks,
            "delay in a sawtooth": sawtooth_delay,
            "delay walks": wandering_delay,
        }),
        *_rows("wind", **{
            "wind with shear and turbulence": storm,
            "gust front": gust_front,
            "wind that turns": whirl,
        }),
        *_rows("rotor_share", **{
            "thrust falls with climb": inflow,
            "ground effect": ground_effect,
            "battery collapses": battery_collapses,
            "brown-outs": brown_outs,
            "propeller chips in flight": chipped_propeller,
            "motor loses its step": lost_steps,
            "rough bearing": rough_bearing,
        }),
        *_rows("ceiling in flight", **{"hot motors": hot_motors}),
        *_rows("rotor_thrust_max", **{"worn motors": worn_motors}),
        *_rows("thrust_map", **{"bent thrust curve": bent_thrust_curve}),
        *_rows("motor_time_constant_down", **{"rotors slow down slowly": slow_braking}),
        *_rows("gyro_time_constant", **{"filtered gyroscope": filtered_gyro}),
        *_rows("centre of mass in flight", **{"loose battery": loose_battery}),
        *_rows("mass in flight", **{"payload falls off": payload_falls}),
    )
}  # fmt: skip
"""The rows by name. The position of a row determines what it draws, so new rows are added at the end."""


WIDTHS = {"lag": 4, "error": 12, "grain": 4, "wind": 3, "shift": 2, "thrust_map": 3}
"""Number of values of the entries of `LawStep` that are vectors, besides `share`, which has one for each rotor."""


def steps_of(law: StressLaw | None, setting: LawSetting) -> LawStep:
    """The control steps of n flights under a law, every entry (t, n, ...). None: no law."""
    vehicle = setting.vehicle
    lag, slower, gyro = (getattr(vehicle, name) for name in ("motor_time_constant", *BODY[1:]))
    entries = {f.name: 0.0 for f in dataclasses.fields(LawStep)} | {
        "share": 1.0,
        "ceiling": 1.0,
        "mass": 1.0,
        "thrust_map": vehicle.thrust_map,
        "motor_time_constant_down": lag if slower is None else slower,
        "gyro_time_constant": UNFILTERED if gyro is None else gyro,
    }
    entries |= {} if law is None else law.entries(setting)
    shape = setting.steps, setting.n
    widths = WIDTHS | {"share": vehicle.rotor_count}
    sizes = {name: (*shape, widths[name]) if name in widths else shape for name in entries}
    return LawStep(**{name: np.broadcast_to(x, sizes[name]) for name, x in entries.items()})
