"""Vehicles, air and sensors that differ from a policy's training: one fixed set of rows, and what they draw.

In every row, the flight controller is tuned for the policy's own vehicle. A row only sets numbers of the episodes, so
that one compiled program flies all rows.
"""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import jax
import numpy as np

from e2efly.config import CameraConfig, EstimateConfig, LinkConfig, NoiseConfig
from e2efly.environment.disturbance import Disturbance
from e2efly.environment.env_state import EnvState
from e2efly.environment.environment import Env
from e2efly.environment.lost_commands import EVERY, LostCommands
from e2efly.environment.pose_errors import PoseErrors
from e2efly.environment.stress_cameras import CAMERAS, CameraDraw, CameraRow, with_noise
from e2efly.simulation.sensors import latency
from e2efly.vehicles.vehicle import Vehicle

ALL = "all at once"
"""The row in which each vehicle draws all changes at once."""
LATEST = 0.04
"""Largest delay that a row adds to commands, and to images, s."""
MOCAP = NoiseConfig(position=0.005, velocity=0.05, attitude=0.005, body_rate=0.02)
VIO = NoiseConfig(position=0.02, velocity=0.1, attitude=0.01, body_rate=0.02)


@dataclass(frozen=True)
class StressRow:
    """One way in which reality differs from the training."""

    name: str
    factors: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    """Factors on fields of the vehicle."""
    latency: float = 0.0
    """Time added to the latency from observation to command, s. The sum is at least 0."""
    wind: float = 0.0
    """Steady wind, m/s, from a random horizontal direction."""
    gust: float = 0.0
    """Standard deviation of gusts, m/s per axis."""
    sag: float = 0.0
    """Share of the thrust that is lost by the end of the episode."""
    rotor: float = 0.0
    """Share of its thrust that one randomly chosen rotor loses."""
    centre_of_mass: float = 0.0
    """Offset of the centre of mass, m, in a random direction in the plane of the rotors."""
    plain_mixer: bool = False
    """Whether the mixer clips each rotor separately."""
    noise: NoiseConfig = NoiseConfig()
    """White noise of the observed state."""
    drift: float = 0.0
    """Random walk of the observed position after one second, m per axis."""
    estimate: EstimateConfig = EstimateConfig()
    """Errors of the observed state, which each episode has in full."""
    link: LinkConfig = LinkConfig()
    """Commands that are lost, in each episode in full."""
    camera: CameraRow = CameraRow()
    """Changes of the cameras."""

    @property
    def alters(self) -> frozenset[str]:
        """What a plant must change for it, unknown to the flight controller: `e2efly.validation.plant.EVERYTHING`.

        Delay, noise, drift and cameras act between the plant and the policy, so every plant can be flown with them.
        """
        if self.name == ALL:
            others = frozenset().union(*(row.alters for row in ROWS.values() if row.name != ALL))
            return others - {"plain_mixer"}
        beside = {
            "rotor_position": self.centre_of_mass,
            "wind": self.wind or self.gust,
            "rotor_share": self.sag or self.rotor,
            "plain_mixer": self.plain_mixer,
        }
        return frozenset(self.factors) | {name for name, there in beside.items() if there}


def _factor(what: str, factor: float, *fields: str) -> StressRow:
    return StressRow(f"{what} x{factor:g}", dict.fromkeys(fields, factor))


ROWS: dict[str, StressRow] = {
    row.name: row
    for row in (
        StressRow("nominal"),
        *(_factor("mass", x, "mass") for x in (0.8, 1.25)),
        *(_factor("thrust", x, "thrust_map") for x in (0.8, 1.15)),
        *(_factor("inertia", x, "inertia") for x in (0.6, 1.5)),
        *(_factor("motor lag", x, "motor_time_constant") for x in (0.5, 2.0)),
        *(StressRow(f"delay {1e3 * x:+.0f} ms", latency=x) for x in (-0.03, 0.02, LATEST)),
        *(_factor("drag", x, "drag_linear", "drag_quadratic") for x in (0.0, 2.0)),
        *(_factor("torque ratio", x, "torque_ratio") for x in (0.7, 1.3)),
        *(_factor("rate loop", x, "rate_gain") for x in (0.5, 2.0)),
        StressRow("thrust falls by 15 %", sag=0.15),
        StressRow("one rotor 10 % weaker", rotor=0.1),
        StressRow("centre of mass 5 mm off", centre_of_mass=0.005),
        StressRow("wind 3 m/s", wind=3.0),
        StressRow("gusts 1.5 m/s", gust=1.5),
        StressRow("mixer clips each rotor", plain_mixer=True),
        StressRow("noise of motion capture", noise=MOCAP),
        StressRow("noise and drift of a VIO", noise=VIO, drift=0.005),
        StressRow(ALL),
        *(StressRow(name, camera=row) for name, row in CAMERAS.items()),
        StressRow("velocity 50 ms late", estimate=EstimateConfig(velocity_lag=0.05)),
        StressRow("body rates 20 ms late", estimate=EstimateConfig(body_rate_lag=0.02)),
        StressRow("heading 5 degrees wrong", estimate=EstimateConfig(yaw=math.radians(5))),
        StressRow("attitude 2 degrees wrong", estimate=EstimateConfig(tilt=math.radians(2))),
        StressRow("poses repeated up to 4 times", estimate=EstimateConfig(hold=4.0)),
        StressRow("poses jump by 10 cm", estimate=EstimateConfig(jump=0.1)),
        StressRow("10 % of the commands lost", link=LinkConfig(dropped=0.1)),
        StressRow("commands lost for 0.2 s", link=LinkConfig(silence=0.2)),
    )
}
"""The rows by name. The position of a row determines what it draws, so new rows are added at the end."""


def rows_for(cameras: tuple[CameraConfig, ...]) -> tuple[str, ...]:
    """The names of the rows that apply to a policy with these cameras, in the order of the tables."""
    return (*(name for name, row in ROWS.items() if name != ALL and row.camera.fits(cameras)), ALL)


@dataclass(frozen=True)
class Draw:
    """The numbers of a row for n episodes."""

    plant: dict[str, np.ndarray]
    """Fields of the vehicle, (n, ...)."""
    latency: np.ndarray
    """(n,) latency from observation to command, s."""
    wind: np.ndarray
    """(n, 3) wind, m/s."""
    disturbance: Disturbance
    noise: NoiseConfig
    """White noise of the observed state, with values of shape (n, 1)."""
    camera: CameraDraw
    estimate: dict[str, np.ndarray]
    """Arguments of `PoseErrors.of` but the state."""
    link: dict[str, np.ndarray]
    """Fields of `LostCommands` but what arrived."""

    @staticmethod
    def of(row: StressRow, vehicle: Vehicle, latency: float, rng: np.random.Generator, n: int) -> "Draw":
        """Draw n episodes of a row for a nominal vehicle with a latency, s. `ALL` draws every strength between the
        rows' extremes.
        """
        rows, everything = tuple(ROWS.values()), row.name == ALL

        def strength(name: str) -> np.ndarray:
            if not everything:
                return np.full(n, getattr(row, name))
            values = [getattr(r, name) for r in rows]
            return rng.uniform(min(values), max(values), n)

        drag = "drag_linear", "drag_quadratic"
        plant, factors = {}, {}
        for name in dict.fromkeys(name for r in rows for name in r.factors):
            known = [r.factors[name] for r in rows if name in r.factors]
            if not everything:
                factors[name] = np.full(n, row.factors.get(name, 1.0))
            elif name == drag[1]:
                factors[name] = factors[drag[0]]
            else:
                factors[name] = rng.uniform(min(known), max(known), n)
            value = np.asarray(getattr(vehicle, name))
            plant[name] = value * factors[name].reshape(n, *[1] * value.ndim)
        angle, side = rng.uniform(-math.pi, math.pi, (2, n))
        direction = np.stack([np.cos(side), np.sin(side)], axis=1)
        offset = np.zeros((n, 1, vehicle.rotor_position.shape[-1]))
        offset[:, 0, :2] = strength("centre_of_mass")[:, None] * direction
        plant["rotor_position"] = vehicle.rotor_position - offset
        share = np.ones((n, vehicle.rotor_count))
        share[np.arange(n), rng.integers(0, vehicle.rotor_count, n)] -= strength("rotor")
        gust = strength("gust")
        zero = np.zeros(n)
        heard = {f.name: max(getattr(r.noise, f.name) for r in rows) for f in dataclasses.fields(NoiseConfig)}
        share_of_noise = rng.uniform(0, 1, n)
        noise = {
            name: (share_of_noise * largest if everything else zero + getattr(row.noise, name))[:, None]
            for name, largest in heard.items()
        }
        return Draw(
            plant=plant,
            latency=np.maximum(latency + strength("latency"), 0.0),
            wind=strength("wind")[:, None] * np.stack([np.cos(angle), np.sin(angle), zero], axis=1),
            disturbance=Disturbance(
                gust_speed=gust,
                gust_time=np.ones(n),
                gust=gust[:, None] * rng.standard_normal((n, 3)),
                rotor_share=share,
                sag=strength("sag"),
                drift_rate=strength("drift"),
                drift=np.zeros((n, 3)),
                ceiling=np.ones_like(share),
                push=np.zeros((n, 2)),
                plain_mixer=zero + row.plain_mixer,
            ),
            noise=NoiseConfig(**noise),  # type: ignore[arg-type]
            camera=CameraDraw.of(None if everything else row.camera, rng.spawn(1)[0], n),
            **_told(None if everything else row, rng.spawn(1)[0], n),
        )

    def vehicle(self, nominal: Vehicle, i: int) -> Vehicle:
        """The body of an episode. A factor on the rotors' thrust also applies to their maximum thrust."""
        body = dataclasses.replace(nominal, **{name: _number(value[i]) for name, value in self.plant.items()})
        stronger = float(body.thrust_map[0] / nominal.thrust_map[0])
        return dataclasses.replace(body, rotor_thrust_max=nominal.rotor_thrust_max * stronger)

    def env(self, env: Env) -> Env:
        """The environment with the changes of a row."""
        return dataclasses.replace(
            env,
            noise=self.noise,
            cameras=with_noise(env.cameras),
            estimate=EstimateConfig(),
            link=LinkConfig(),
        )

    def state(self, env: Env, state: EnvState) -> EnvState:
        """The initial state of the episodes with the changes of a row."""
        return dataclasses.replace(
            state,
            eyes=self.camera.eyes(env.cameras, state.eyes, env.control_period),
            plant=self.plant,
            wind=self.wind,
            disturbance=self.disturbance,
            estimate=PoseErrors.of(**self.estimate, seen=state.vehicle),
            link=LostCommands(**self.link, arrived=state.actions),
            action_latency=self.latency,
        )


def _told(row: StressRow | None, rng: np.random.Generator, n: int) -> dict[str, dict[str, np.ndarray]]:
    """The errors of the poses and the lost commands of n episodes of a row; None: up to the rows' largest at once."""

    def strength(part: str, name: str) -> np.ndarray:
        if row is not None:
            return np.full(n, getattr(getattr(row, part), name))
        return rng.uniform(0.0, max(getattr(getattr(r, part), name) for r in ROWS.values()), n)

    told = {field.name: strength("estimate", field.name) for field in dataclasses.fields(EstimateConfig)}
    side, angle, way = rng.choice([-1.0, 1.0], n), rng.uniform(-math.pi, math.pi, n), rng.standard_normal((n, 3))
    silence = strength("link", "silence")
    return {
        "estimate": {
            "lag": np.stack(
                [told[f"{name}_lag"] for name in ("position", "velocity", "attitude", "body_rate")], axis=1
            ),
            "turned": np.stack(
                [side * told["yaw"], np.cos(angle) * told["tilt"], np.sin(angle) * told["tilt"]], axis=1
            ),
            "jump": told["jump"][:, None] * way / np.linalg.norm(way, axis=1, keepdims=True),
            "hold": told["hold"],
        },
        "link": {
            "dropped": strength("link", "dropped"),
            "silence": silence,
            "phase": silence + (EVERY - silence) * rng.uniform(0, 1, n),
        },
    }


jax.tree_util.register_dataclass(Draw, data_fields=[f.name for f in dataclasses.fields(Draw)], meta_fields=[])


def with_longer_queue(env: Env) -> Env:
    """The environment with queues for the largest delays of the rows, for commands and images. The policy sees the same
    number of past actions as before.
    """
    latest = latency.frames(float(env.physics.nominal.latency) + LATEST, env.control_period)
    oldest = max((camera.latency[0] + LATEST for camera in env.cameras), default=0.0)
    past = latency.frames(oldest, env.control_period) + 1 if oldest else 0
    return dataclasses.replace(env, queue=max(env.queue, latest + 1), past=max(env.past, past))


def check_seen(rows: tuple[str, ...], cameras: tuple[CameraConfig, ...]) -> None:
    """Refuse a row for cameras that a policy does not have.

    Raises:
        ValueError: naming it, what the policy sees, and the rows that are accepted.
    """
    for name in rows:
        if name in ROWS and not ROWS[name].camera.fits(cameras):
            seen = " and ".join(camera.sees for camera in cameras) or "nothing"
            raise ValueError(
                f"--rows has {name!r}, but the policy sees {seen}; accepted: "
                + ", ".join(repr(row) for row in rows_for(cameras))
            )


def _number(value: np.ndarray) -> Any:
    return value if value.ndim else float(value)
