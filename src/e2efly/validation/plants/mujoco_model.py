"""Vehicles over a ground plane in MuJoCo's format, MJCF. Imports no MuJoCo."""

from collections.abc import Sequence

import numpy as np

from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle, inertia_tensor, rotor_arms, rotor_axes, rotor_places

STEP = 1e-3
"""Longest step of MuJoCo and of the rate loop, s."""
FOOT = 0.005
"""Radius of the balls under the rotors on which a vehicle stands, m."""
HULL = 2
"""The bit of the collision masks of the hulls: they touch each other, and neither ground nor feet."""
YIELD_S = 0.005
"""Time constant of the contact of two hulls, s. It gives back no energy."""


def world_xml(vehicles: Sequence[Vehicle]) -> str:
    """Vehicles over a ground plane as MJCF: for each a free body, its rotors and feet, the drag.

    Among others, each has a hull: the sphere of its collision radius, at which a task judges a touch, too. Thrust maps
    and drags are those at hover. `MujocoPlant` updates them in flight.
    """
    bodies, actuators, line = [], [], "\n      "
    for i, vehicle in enumerate(vehicles):
        tag = "" if len(vehicles) == 1 else f"_of_{i}"
        body, driven = _vehicle(vehicle, tag)
        bodies.append(body)
        actuators += driven
    return f"""<mujoco model="{" ".join(dict.fromkeys(vehicle.name for vehicle in vehicles))}">
  <compiler inertiafromgeom="false"/>
  <option timestep="{STEP}" integrator="RK4" gravity="0 0 -{GRAVITY}" density="0" viscosity="0">
    <flag autoreset="disable"/>
  </option>
  <worldbody>
    <light pos="0 0 10"/>
    <geom name="ground" type="plane" size="20 20 1"/>
{"".join(bodies)}  </worldbody>
  <actuator>
      {line.join(actuators)}
  </actuator>
</mujoco>
"""


def _vehicle(vehicle: Vehicle, tag: str) -> tuple[str, list[str]]:
    """The body of a vehicle, and its actuators: motors first. `tag` ends the names of its parts, and is empty for a
    vehicle that is alone.
    """
    k2, k1, k0 = vehicle.thrust_map
    hover, lag, ratio = vehicle.hover_rotor_speed, vehicle.motor_time_constant, vehicle.torque_ratio
    centre = np.zeros(3) if vehicle.centre_of_mass is None else vehicle.centre_of_mass
    dx, dy, dz = (-centre).tolist()  # the body's frame has its origin in the centre of mass
    sites, feet, actuators = [f'<site name="centre{tag}" pos="{dx} {dy} {dz}"/>'], [], []

    axes, feet_at = rotor_axes(vehicle).tolist(), rotor_arms(vehicle).tolist()
    rotors = zip(rotor_places(vehicle).tolist(), feet_at, axes, vehicle.rotor_spin, strict=True)
    for i, (place, (x, y), axis, spin) in enumerate(rotors):
        gear = " ".join(map(str, [*axis, *(float(spin) * ratio * along for along in axis)]))
        sites.append(f'<site name="rotor_{i}{tag}" pos="{" ".join(map(str, place))}"/>')
        feet.append(
            f'<geom name="foot_{i}{tag}" type="sphere" size="{FOOT}" pos="{x} {y} {FOOT - vehicle.feet_height}"/>'
        )
        actuators.append(
            f'<general name="motor_{i}{tag}" site="rotor_{i}{tag}" gear="{gear}" dyntype="filter" '
            f'dynprm="{lag}" gainprm="{2 * k2 * hover + k1}" biastype="affine" biasprm="{k0 - k2 * hover**2}"/>'
        )
    drags = [("drag", "{} 0 0 0", vehicle.drag_linear), ("drag_torque", "0 0 0 {}", vehicle.drag_torque)]
    for name, gear, drag in [row for row in drags if row[2] is not None]:
        for axis, along, size in zip("xyz", ("1 0 0", "0 1 0", "0 0 1"), drag, strict=True):
            actuators.append(
                f'<general name="{name}_{axis}{tag}" site="centre{tag}" gear="{gear.format(along)}" gainprm="0" '
                f'biastype="affine" biasprm="0 0 {-size}"/>'
            )
    entries = inertia_tensor(vehicle)[(0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)].tolist()
    inertia = f'diaginertia="{" ".join(map(str, entries[:3]))}"'
    if vehicle.inertia_products is not None:
        inertia = f'fullinertia="{" ".join(map(str, entries))}"'
    line = "\n      "
    if tag:
        masks = f'contype="{HULL}" conaffinity="{HULL}" solref="{YIELD_S} 1"'
        feet.append(f'<geom name="hull{tag}" type="sphere" size="{vehicle.radius}" {masks}/>')
    return (
        f"""    <body name="vehicle{tag}" pos="0 0 {vehicle.feet_height}">
      <freejoint/>
      <inertial pos="0 0 0" mass="{vehicle.mass}" {inertia}/>
      {line.join(sites)}
      {line.join(feet)}
    </body>
""",
        actuators,
    )
