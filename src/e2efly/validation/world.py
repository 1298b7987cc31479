"""The world of a flight controller under test: our rigid body, the ground, and an IMU.

The firmware's motor outputs turn the rotors. The firmware's sensors get the motion of the body.
"""

from dataclasses import dataclass
from dataclasses import fields as fields_of
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.control.vectors import Quat, Vec3
from e2efly.simulation.physics import State
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.body import reached
from e2efly.simulation.physics.integrate import rk4
from e2efly.simulation.physics.state import Parts
from e2efly.validation.plant_flight import imu_of
from e2efly.validation.sitl import FirmwareState
from e2efly.vehicles.vehicle import Vehicle

STEP_S = 0.001
"""Length of a step of the rigid body, s."""
_PROGRAMS: dict[str, Any] = {}
"""Compiled programs by the vehicle's hash. Compiling takes a second, which is saved for the next world of the same
vehicle."""


@dataclass(frozen=True)
class FlownBody:
    """The rigid body's state: the fields of `physics.State`, NumPy, one vehicle."""

    position: np.ndarray
    velocity: np.ndarray
    quaternion: np.ndarray
    body_rate: np.ndarray
    rotor_speed: np.ndarray


@dataclass(frozen=True)
class World:
    """The rigid body of a vehicle over flat ground. Pure: `advance` returns the next state."""

    vehicle: Vehicle
    """The plant; loaded."""

    @cached_property
    def full_speed(self) -> float:
        """Rotor speed at full motor output, rad/s."""
        return self.vehicle.full_rotor_speed

    def at_rest(self, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> FlownBody:
        """The state on the ground with stopped rotors."""
        zero = np.zeros(3)
        position = np.array([x, y, self.vehicle.feet_height])
        return FlownBody(
            position, zero, np.array([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]), zero, np.zeros(self.vehicle.rotor_count)
        )

    def advance(
        self,
        state: FlownBody,
        motors: np.ndarray,
        dt: float,
        wind: np.ndarray | None = None,
        rotor_share: np.ndarray | None = None,
    ) -> FlownBody:
        """The state after `dt` s, a whole number of `STEP_S`, under constant motor outputs.

        The outputs, (N,) in [0, 1] in the order of the vehicle file, are proportional to the rotor speeds. The wind is
        in the world, m/s. `rotor_share` is the thrust of each rotor divided by the thrust from the vehicle's thrust
        map.
        """
        standing = state.position[2] <= self.vehicle.feet_height and not (state.velocity.any() or state.body_rate.any())
        if standing and not (motors.any() or state.rotor_speed.any()):
            return state  # nothing changes for seconds after each boot
        steps = max(round(dt / STEP_S), 1)
        air, share = np.zeros(3) if wind is None else wind, rotor_share
        share = np.ones(self.vehicle.rotor_count) if share is None else share
        parts = (getattr(state, f.name) for f in fields_of(FlownBody))
        row = np.concatenate([*parts, np.asarray(motors) * self.full_speed, air, share]).astype(np.float32)
        after = np.asarray(self._steps(row, steps), np.float64)  # one array in and out: the transfer costs most
        return FlownBody(after[:3], after[3:6], after[6:10], after[10:13], after[13:])

    @cached_property
    def _steps(self) -> Any:
        """(row of state, rotor commands, wind, shares; steps) -> row of state, with the vehicle's numbers built in."""
        vehicle, n = self.vehicle, self.vehicle.rotor_count

        def run(row: Any, steps: int) -> Any:
            state, rest = State(row[:3], row[3:6], row[6:10], row[10:13], row[13 : 13 + n]), row[13 + n :]
            command, air, plant = tuple(rest[:n]), Vec3.of(rest[n : n + 3]), Airframe.of(vehicle, STEP_S, rest[n + 3 :])

            def step(parts: Parts, _: None) -> tuple[Parts, None]:
                told = reached(plant, parts.rotor_speed, command)  # type: ignore[arg-type]
                free = rk4(plant, parts, told, air, STEP_S)
                return _stand(vehicle, free), None

            after = jax.lax.scan(step, Parts.of(state), None, length=steps)[0].join()
            return jnp.concatenate(
                [after.position, after.velocity, after.quaternion, after.body_rate, after.rotor_speed]
            )

        return _PROGRAMS.setdefault(vehicle.hash, jax.jit(run, static_argnums=1))

    def sensed(self, before: FlownBody, after: FlownBody, dt: float) -> FirmwareState:
        """The readings of gyroscope and accelerometer after a step of `dt` s."""
        felt = imu_of(before, after, dt)
        return FirmwareState(felt.gyroscope, felt.accelerometer, after.quaternion, after.velocity, after.position)


def _stand(vehicle: Vehicle, free: Parts) -> Parts:
    """Hold a vehicle that touches the ground: it does not sink, slide or turn, and stands upright on its feet."""
    down = free.position.z <= vehicle.feet_height
    keep = jnp.where(down, 0.0, 1.0)
    q = free.attitude
    upright = Quat(q.w, q.x * keep, q.y * keep, q.z).normalized()
    return Parts(
        position=Vec3(free.position.x, free.position.y, jnp.maximum(free.position.z, vehicle.feet_height)),
        velocity=Vec3(
            free.velocity.x * keep, free.velocity.y * keep,
            jnp.where(down, jnp.maximum(free.velocity.z, 0.0), free.velocity.z),
        ),
        attitude=upright,
        body_rate=free.body_rate * keep,
        rotor_speed=free.rotor_speed,
    )  # fmt: skip
