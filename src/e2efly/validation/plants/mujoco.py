"""The same vehicle in MuJoCo, with another engine, another integrator and a ground. It uses nothing of our own physics.

MuJoCo integrates all parts of the motion together, by RK4: the rigid body and its gyroscopic torque, the lag of the
rotors, the points at which their thrust and torque act, the drag, and the contact of the feet with the ground. The
flight controller (rate loop and mixer, float64) runs before every step of at most 1 ms. Four parts need an
explanation:

- The activation of a motor is its rotor's *speed* (`dyntype` filter, driven by the commanded speed), because the lag
  is a lag of speed. The force of MuJoCo's actuators is proportional to their activation. Each step therefore uses the
  tangent of the thrust map at its first speed. The error in a step is k2 (change of speed)^2, 0.005 N in the fastest
  spin-up.
- MuJoCo's fluid models derive the drag from a body's box or ellipsoid, and have no coefficients per axis. Each axis
  therefore has an actuator without input whose force depends on its own velocity, -(k1 + k2 |v|) v, with |v| from the
  last step. Wind is subtracted from that velocity, in the body frame of the last step.
- A rotor that is tilted pushes, turns the body and has its angular momentum along its axis.
- The angular momentum of the rotors is included if the vehicle has rotor inertia. Over a step the rotors give the body
  the momentum that they lose, and the torque w x h. The body rate w is that in the middle of the step, extrapolated
  from its last change.
- The flight controller of the simulator runs at 4 kHz. Here it runs once a step, and is therefore given the body rate
  at which a faster one has computed its commands in the mean: that in the middle of the step, less half of a period of
  that loop. It is extrapolated from the last change of the body rate.
"""

import importlib
import math
from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from e2efly.control import Quat, Vec3
from e2efly.policy.contract import Contract
from e2efly.validation.flight_controller import FlightController, rotor_speed_of
from e2efly.validation.plant import EVERYTHING, MOMENT, Plant, RigidState, check_mode
from e2efly.validation.plants.mujoco_model import STEP, world_xml
from e2efly.validation.plants.registry import register
from e2efly.vehicles.vehicle import RATE_LOOP, Vehicle, rotor_axes, rotor_places
from e2efly.vehicles.vehicle_rules import LEAST_VOLTAGE

HOLD = 0.00025
"""Period of the rate loop that is simulated, s."""
_CALM = Vec3(0.0, 0.0, 0.0)


class MujocoWorld:
    """One model for all vehicles of a world. It advances when each has a command, or has left."""

    def __init__(self, plants: Sequence["MujocoPlant"], largest_step: float) -> None:
        """Put vehicles into one model. All must be reset before the first step, of at most `largest_step` s."""
        self.plants, self._largest_step = tuple(plants), largest_step
        self._mujoco: Any = importlib.import_module("mujoco")  # here: the plant is known without MuJoCo
        self.build()

    def build(self) -> None:
        """Make the model of the present bodies. Each vehicle then knows its part of it."""
        self.model = self._mujoco.MjModel.from_xml_string(world_xml([plant.body for plant in self.plants]))
        self.data = self._mujoco.MjData(self.model)
        rotor = actuator = 0
        for i, plant in enumerate(self.plants):
            plant.enter(self, i, rotor, actuator)
            rotor += plant.body.rotor_count
            actuator += plant.body.rotor_count + 3 * (1 + (plant.body.drag_torque is not None))

    def placed(self) -> None:
        """Compute what follows from the poses: the velocities from which the drag starts."""
        self.data.qacc_warmstart[:] = 0.0
        self._mujoco.mj_forward(self.model, self.data)

    def advance(self) -> None:
        """Hold the commands of all vehicles for their time, in equal steps. If one has yet to command, nothing happens.

        Raises:
            ValueError: for commands that are held for different times.
        """
        asked = [plant.asked for plant in self.plants if not plant.left]
        times = [each[1] for each in asked if each is not None]
        if not times or len(times) < len(asked):
            return
        dt = times[0]
        if max(times) - min(times) > MOMENT:
            raise ValueError(f"the vehicles of a world hold their commands for {times} s; accepted: one time")
        count = math.ceil((dt - MOMENT) / self._largest_step)
        self.model.opt.timestep = period = dt / count
        for _ in range(count):
            for plant in self.plants:
                plant.drive(period)
            self._mujoco.mj_step(self.model, self.data)
        for plant in self.plants:
            plant.asked = None


@register("mujoco")
class MujocoPlant(Plant):
    """A vehicle in MuJoCo."""

    needs = {"mujoco": "e2efly[mujoco]"}
    alters = EVERYTHING

    def __init__(self, vehicle: Vehicle, command_mode: str = "ctbr", largest_step: float = STEP) -> None:
        """Make the plant, with the vehicle standing on the ground and a flight controller that is tuned to it.

        Command modes above `ctbr` go through the bridge's own controllers before each step. `largest_step` is the
        longest step of MuJoCo and the rate loop, s.

        Raises:
            ValueError: for an unknown command mode, or a step that is not positive.
        """
        check_mode(command_mode, self.name)
        if not (math.isfinite(largest_step) and largest_step > 0):
            raise ValueError(f"largest_step is {largest_step}; accepted: a positive number of seconds")
        self._believed, self._mode, self._map = vehicle, command_mode, vehicle.thrust_map.tolist()
        self._met(vehicle, False)
        MujocoWorld([self], largest_step)
        self.reset(RigidState(np.array([0.0, 0.0, vehicle.feet_height]), np.zeros(3), np.eye(4)[0], np.zeros(3)))

    @classmethod
    def company(cls, vehicle: Vehicle, contract: Contract, count: int) -> Sequence[Self]:
        """Vehicles in one model, which push each other when they touch."""
        plants = [cls.of(vehicle, contract) for _ in range(count)]
        if count > 1:
            MujocoWorld(plants, STEP)
        return plants

    def enter(self, world: MujocoWorld, number: int, rotor: int, actuator: int) -> None:
        """Be vehicle `number` of a world. Its first rotor and its first actuator have these numbers there."""
        self._world, self.model, self.data = world, world.model, world.data
        rotors, pose, motion = self.body.rotor_count, 7 * number, 6 * number
        motors = slice(actuator, actuator + rotors)
        drags = slice(motors.stop, motors.stop + 3)
        model, data = world.model, world.data
        self._pose, self._motion = data.qpos[pose : pose + 7], data.qvel[motion : motion + 6]
        self._applied = data.qfrc_applied[motion : motion + 6]
        self._speed, self._told = data.act[rotor : rotor + rotors], data.ctrl[motors]
        self._lag, self._gain = model.actuator_dynprm[motors, 0], model.actuator_gainprm[motors, 0]
        self._offset, self._through = model.actuator_biasprm[motors, 0], data.actuator_velocity[drags]
        self._drag = model.actuator_biasprm[drags]
        self.asked: tuple[list[float], float] | None = None
        self.left = False

    def meet(self, body: Vehicle, plain_mixer: bool = False) -> None:
        """Fly another body from the next `reset` on, which the flight controller does not know."""
        self._met(body, plain_mixer)
        self._world.build()

    def _met(self, body: Vehicle, plain_mixer: bool) -> None:
        self.body = body
        self._controller = FlightController(self._believed.under(body, *RATE_LOOP), self._mode, plain_mixer)
        self._full_speed = body.full_rotor_speed
        self._ceiling = np.inf if body.rotor_speed_ceiling is None else body.rotor_speed_ceiling

    def disturb(self, wind: np.ndarray, rotor_share: np.ndarray) -> None:
        """Set wind and shares of thrust from now on."""
        self._wind, self._share = Vec3(*wind.tolist()), rotor_share

    @property
    def state(self) -> RigidState:
        """The vehicle now."""
        pose, motion = self._pose.copy(), self._motion.copy()  # its rotation is in the body frame
        return RigidState(pose[:3], motion[:3], pose[3:] / np.linalg.norm(pose[3:]), motion[3:])

    @property
    def rotor_speed(self) -> np.ndarray:
        """(r,) rotor speeds in the order of the vehicle file, rad/s."""
        return self._speed.copy()

    def reset(self, state: RigidState) -> None:
        """Put the vehicle into a state, with the rotors at hover speed."""
        self._pose[:] = np.concatenate([state.position, state.quaternion])
        self._motion[:] = np.concatenate([state.velocity, state.body_rate])
        self._applied[:] = 0.0
        self._speed[:] = self.body.hover_rotor_speed
        self._wind, self._share, self._last_rate = _CALM, np.ones(self.body.rotor_count), state.body_rate
        self._controller.start(state.body_rate.tolist())
        self.asked, self.left = None, False
        self._world.placed()

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command for `dt` s, in equal steps. In a world of several, time passes with the last of them."""
        self.asked = command.tolist(), dt
        self._world.advance()

    def leave(self) -> None:
        """Stop the motors until the next `reset`. The others fly on."""
        self.asked, self.left = None, True
        self._world.advance()

    def drive(self, period: float) -> None:
        """Command the rotors, and set the air, for a step of MuJoCo of `period` s."""
        rate = self._motion[3:].copy()
        coming = rate + (rate - self._last_rate) * (period - min(HOLD, period)) / (2 * period)
        motion = [*self._motion[:3].tolist(), *coming.tolist()]
        thrusts = [0.0] * self.body.rotor_count
        if self.asked is not None:
            thrusts = self._controller.thrusts(self.asked[0], self._pose.tolist(), motion, period)
        speed = self._speed.copy()
        reached = np.minimum(rotor_speed_of(self._map, thrusts), self._full_speed) * self._powered(speed)
        self._told[:] = np.minimum(reached, self._ceiling)
        self._lag[:] = self._lags()
        wind = self._wind if self._wind == _CALM else Quat(*self._pose[3:].tolist()).unrotate(self._wind)
        k2, k1, k0 = self.body.thrust_map.tolist()
        kept = self._share * self._kept(wind, speed)
        self._gain[:] = kept * (2 * k2 * speed + k1)
        self._offset[:] = kept * (k0 - k2 * speed * speed)
        air = np.array([wind.x, wind.y, wind.z])
        drag = self.body.drag_linear + self.body.drag_quadratic * np.abs(self._through - air)
        self._drag[:, 0] = drag * air
        self._drag[:, 2] = -drag
        if self.body.rotor_inertia is not None:
            self._applied[3:] = self._rotor_torque(period)
        self._last_rate = rate

    def _kept(self, wind: Vec3, speed: np.ndarray) -> float | np.ndarray:
        """Share of its thrust that each rotor keeps in the air that it meets; the wind is in body axes, m/s."""
        body, motion = self.body, self._motion.tolist()
        if body.inflow_loss is None:
            return 1.0
        air = (Quat(*self._pose[3:].tolist()).unrotate(Vec3(*motion[:3])) - wind).stack()
        places = rotor_places(body) * [1.0, 1.0, 0.0]
        inflow = np.sum((air + np.cross(motion[3:], places)) * rotor_axes(body), axis=1)
        return np.maximum(1.0 - body.inflow_loss * inflow / np.maximum(speed, 1.0), 0.0)

    def _powered(self, speed: np.ndarray) -> float:
        """Speed to which the battery brings a rotor, divided by its commanded speed."""
        body, (k2, k1, k0) = self.body, self.body.thrust_map
        if body.battery_voltage is None:
            return 1.0
        thrust = self._share @ np.maximum((k2 * speed + k1) * speed + k0, 0.0)
        voltage = body.battery_voltage - (0.0 if body.voltage_sag is None else body.voltage_sag) * thrust
        exponent = 1.0 if body.speed_per_volt is None else float(body.speed_per_volt)
        return max(float(voltage / body.nominal_voltage), LEAST_VOLTAGE) ** exponent

    def _lags(self) -> np.ndarray:
        """Time constant of each rotor's lag towards its present command, s.

        It does not change on the way, because a rotor does not pass its command.
        """
        up, down = self.body.motor_time_constant, self.body.motor_time_constant_down
        return np.where(self._told < self._speed, up if down is None else down, up)

    def _rotor_torque(self, dt: float) -> np.ndarray:
        """Mean torque on the body from the angular momentum of its rotors over the next step, body axes, N*m."""
        body, now, told, lag = self.body, self._speed, self._told, self._lags()
        after = told + (now - told) * np.exp(-dt / lag)
        # a rotor turns against its reaction torque
        inertia = -body.rotor_inertia * body.rotor_spin * rotor_axes(body).T
        before = inertia @ now
        change = inertia @ after - before
        middle_rate = 1.5 * self._motion[3:] - 0.5 * self._last_rate
        return -np.cross(middle_rate, before + change / 2) - change / dt
