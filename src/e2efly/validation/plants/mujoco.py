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
from typing import Any

import numpy as np

from e2efly.control import Quat, Vec3
from e2efly.validation.flight_controller import FlightController, rotor_speed_of
from e2efly.validation.plant import EVERYTHING, MOMENT, Plant, RigidState, check_mode
from e2efly.validation.plants.registry import register
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import RATE_LOOP, Vehicle, inertia_tensor, rotor_arms, rotor_axes, rotor_places
from e2efly.vehicles.vehicle_rules import LEAST_VOLTAGE

STEP = 1e-3
"""Longest step of MuJoCo and of the rate loop, s."""
HOLD = 0.00025
"""Period of the rate loop that is simulated, s."""
FOOT = 0.005
"""Radius of the balls under the rotors on which the vehicle stands, m."""
_CALM = Vec3(0.0, 0.0, 0.0)


def vehicle_xml(vehicle: Vehicle) -> str:
    """The vehicle over a ground plane as MJCF: a free body, four rotors, four feet, the drag.

    Thrust map and drag are those at hover. `MujocoPlant` updates them in flight.
    """
    k2, k1, k0 = vehicle.thrust_map
    hover, lag, ratio = vehicle.hover_rotor_speed, vehicle.motor_time_constant, vehicle.torque_ratio
    centre = np.zeros(3) if vehicle.centre_of_mass is None else vehicle.centre_of_mass
    dx, dy, dz = (-centre).tolist()  # the body's frame has its origin in the centre of mass
    sites, feet, actuators = [f'<site name="centre" pos="{dx} {dy} {dz}"/>'], [], []

    axes, feet_at = rotor_axes(vehicle).tolist(), rotor_arms(vehicle).tolist()
    rotors = zip(rotor_places(vehicle).tolist(), feet_at, axes, vehicle.rotor_spin, strict=True)
    for i, (place, (x, y), axis, spin) in enumerate(rotors):
        gear = " ".join(map(str, [*axis, *(float(spin) * ratio * along for along in axis)]))
        sites.append(f'<site name="rotor_{i}" pos="{" ".join(map(str, place))}"/>')
        feet.append(f'<geom name="foot_{i}" type="sphere" size="{FOOT}" pos="{x} {y} {FOOT - vehicle.feet_height}"/>')
        actuators.append(
            f'<general name="motor_{i}" site="rotor_{i}" gear="{gear}" dyntype="filter" '
            f'dynprm="{lag}" gainprm="{2 * k2 * hover + k1}" biastype="affine" biasprm="{k0 - k2 * hover**2}"/>'
        )
    drags = [("drag", "{} 0 0 0", vehicle.drag_linear), ("drag_torque", "0 0 0 {}", vehicle.drag_torque)]
    for name, gear, drag in [row for row in drags if row[2] is not None]:
        for axis, along, size in zip("xyz", ("1 0 0", "0 1 0", "0 0 1"), drag, strict=True):
            actuators.append(
                f'<general name="{name}_{axis}" site="centre" gear="{gear.format(along)}" gainprm="0" '
                f'biastype="affine" biasprm="0 0 {-size}"/>'
            )
    entries = inertia_tensor(vehicle)[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)].tolist()
    inertia = f'diaginertia="{" ".join(map(str, entries[:3]))}"'
    if vehicle.inertia_products is not None:
        inertia = f'fullinertia="{" ".join(map(str, entries))}"'
    line = "\n      "
    return f"""<mujoco model="{vehicle.name}">
  <compiler inertiafromgeom="false"/>
  <option timestep="{STEP}" integrator="RK4" gravity="0 0 -{GRAVITY}" density="0" viscosity="0">
    <flag autoreset="disable"/>
  </option>
  <worldbody>
    <light pos="0 0 10"/>
    <geom name="ground" type="plane" size="20 20 1"/>
    <body name="vehicle" pos="0 0 {vehicle.feet_height}">
      <freejoint/>
      <inertial pos="0 0 0" mass="{vehicle.mass}" {inertia}/>
      {line.join(sites)}
      {line.join(feet)}
    </body>
  </worldbody>
  <actuator>
      {line.join(actuators)}
  </actuator>
</mujoco>
"""


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
        self._mujoco: Any = importlib.import_module("mujoco")  # here: the plant is known without MuJoCo
        self._believed, self._mode, self._largest_step = vehicle, command_mode, largest_step
        self.meet(vehicle)
        self.reset(RigidState(np.array([0.0, 0.0, vehicle.feet_height]), np.zeros(3), np.eye(4)[0], np.zeros(3)))

    def meet(self, body: Vehicle, plain_mixer: bool = False) -> None:
        """Fly another body from the next `reset` on, which the flight controller does not know."""
        self.model = self._mujoco.MjModel.from_xml_string(vehicle_xml(body))
        self.data = self._mujoco.MjData(self.model)
        self._body = body
        self._controller = FlightController(self._believed.under(body, *RATE_LOOP), self._mode, plain_mixer)
        self._full_speed = body.full_rotor_speed
        self._ceiling = np.inf if body.rotor_speed_ceiling is None else body.rotor_speed_ceiling

    def disturb(self, wind: np.ndarray, rotor_share: np.ndarray) -> None:
        """Set wind and shares of thrust from now on."""
        self._wind, self._share = Vec3(*wind.tolist()), rotor_share

    @property
    def state(self) -> RigidState:
        """The vehicle now."""
        pose, motion = self.data.qpos.copy(), self.data.qvel.copy()  # its rotation is in the body frame
        return RigidState(pose[:3], motion[:3], pose[3:] / np.linalg.norm(pose[3:]), motion[3:])

    @property
    def rotor_speed(self) -> np.ndarray:
        """(r,) rotor speeds in the order of the vehicle file, rad/s."""
        return self.data.act.copy()

    def reset(self, state: RigidState) -> None:
        """Put the vehicle into a state, with the rotors at hover speed."""
        self._mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = np.concatenate([state.position, state.quaternion])
        self.data.qvel[:] = np.concatenate([state.velocity, state.body_rate])
        self.data.act[:] = self._body.hover_rotor_speed
        self._wind, self._share, self._last_rate = _CALM, np.ones(self._body.rotor_count), state.body_rate
        self._controller.start(state.body_rate.tolist())
        self._mujoco.mj_forward(self.model, self.data)  # computes the velocities from which the drag starts

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command for `dt` s, in equal steps."""
        count = math.ceil((dt - MOMENT) / self._largest_step)
        model, data, wanted = self.model, self.data, command.tolist()
        told, (k2, k1, k0) = self._believed.thrust_map.tolist(), self._body.thrust_map.tolist()
        linear, quadratic, share = self._body.drag_linear, self._body.drag_quadratic, self._share
        rotors = slice(self._body.rotor_count)
        drags = slice(rotors.stop, rotors.stop + 3)
        for _ in range(count):
            model.opt.timestep = dt / count
            period, rate = dt / count, data.qvel[3:].copy()
            coming = rate + (rate - self._last_rate) * (period - min(HOLD, period)) / (2 * period)
            motion = [*data.qvel[:3].tolist(), *coming.tolist()]
            thrusts = self._controller.thrusts(wanted, data.qpos.tolist(), motion, period)
            speed = data.act.copy()
            reached = np.minimum(rotor_speed_of(told, thrusts), self._full_speed) * self._powered(speed)
            data.ctrl[rotors] = np.minimum(reached, self._ceiling)
            model.actuator_dynprm[rotors, 0] = self._lags()
            wind = self._wind if self._wind == _CALM else Quat(*data.qpos[3:].tolist()).unrotate(self._wind)
            kept = share * self._kept(wind, speed)
            model.actuator_gainprm[rotors, 0] = kept * (2 * k2 * speed + k1)
            model.actuator_biasprm[rotors, 0] = kept * (k0 - k2 * speed * speed)
            air = np.array([wind.x, wind.y, wind.z])
            drag = linear + quadratic * np.abs(data.actuator_velocity[drags] - air)
            model.actuator_biasprm[drags, 0] = drag * air
            model.actuator_biasprm[drags, 2] = -drag
            if self._body.rotor_inertia is not None:
                data.qfrc_applied[3:] = self._rotor_torque(dt / count)
            self._last_rate = rate
            self._mujoco.mj_step(model, data)

    def _kept(self, wind: Vec3, speed: np.ndarray) -> float | np.ndarray:
        """Share of its thrust that each rotor keeps in the air that it meets; the wind is in body axes, m/s."""
        body, motion = self._body, self.data.qvel.tolist()
        if body.inflow_loss is None:
            return 1.0
        air = (Quat(*self.data.qpos[3:].tolist()).unrotate(Vec3(*motion[:3])) - wind).stack()
        places = rotor_places(body) * [1.0, 1.0, 0.0]
        inflow = np.sum((air + np.cross(motion[3:], places)) * rotor_axes(body), axis=1)
        return np.maximum(1.0 - body.inflow_loss * inflow / np.maximum(speed, 1.0), 0.0)

    def _powered(self, speed: np.ndarray) -> float:
        """Speed to which the battery brings a rotor, divided by its commanded speed."""
        body, (k2, k1, k0) = self._body, self._body.thrust_map
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
        up, down = self._body.motor_time_constant, self._body.motor_time_constant_down
        told = self.data.ctrl[: self._body.rotor_count]
        return np.where(told < self.data.act, up if down is None else down, up)

    def _rotor_torque(self, dt: float) -> np.ndarray:
        """Mean torque on the body from the angular momentum of its rotors over the next step, body axes, N*m."""
        body, data = self._body, self.data
        now, told, lag = data.act, data.ctrl[: body.rotor_count], self._lags()
        after = told + (now - told) * np.exp(-dt / lag)
        # a rotor turns against its reaction torque
        inertia = -body.rotor_inertia * body.rotor_spin * rotor_axes(body).T
        before = inertia @ now
        change = inertia @ after - before
        middle_rate = 1.5 * data.qvel[3:] - 0.5 * self._last_rate
        return -np.cross(middle_rate, before + change / 2) - change / dt
