"""The load on a cable against MuJoCo, which has a rigid rod on a ball joint, and a tendon of limited length."""

import dataclasses

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from e2efly.simulation.physics import State
from e2efly.simulation.physics.body import rotor_speed_for
from e2efly.simulation.physics.state import split
from e2efly.vehicles.vehicle import Vehicle
from tests.simulation.physics.test_cable import carrying, sailed
from tests.simulation.physics.test_terms_mujoco import STEP, world

pytestmark = pytest.mark.usefixtures("x64")

MASS, LENGTH, HOOK, ANGLE = 0.25, 0.5, 0.04, 0.4
THRUST = np.array([2.44, 2.46, 2.45, 2.44])
"""Thrust of each rotor, N: about the weight of both, and hardly uneven, so that the vehicle tumbles slowly."""


def rotors(vehicle: Vehicle) -> tuple[str, str]:
    """Rotors with constant thrust: their sites and actuators."""
    sites, actuators = "", ""
    for i, (x, y) in enumerate(vehicle.rotor_position):
        sites += f'<site name="rotor_{i}" pos="{x} {y} 0"/>'
        gear = f"0 0 1 0 0 {vehicle.rotor_spin[i] * vehicle.torque_ratio}"
        actuators += f'<general site="rotor_{i}" gear="{gear}" biastype="affine" biasprm="{THRUST[i]} 0 0"/>'
    return sites, f"<actuator>{actuators}</actuator>"


def start(vehicle: Vehicle) -> State:
    """Level and still, with the load aside."""
    state = State.hovering(vehicle, jnp.zeros(3))
    speed = jnp.stack(rotor_speed_for(vehicle, split(jnp.asarray(THRUST))))
    return carrying(dataclasses.replace(state, rotor_speed=speed), ANGLE, MASS, LENGTH, HOOK)


def test_a_rod_on_a_ball_joint(vacuum: Vehicle) -> None:
    """A vehicle that tumbles slowly with a swinging load below its centre of mass, for a second.

    At the environment's sub-step they are millimetres apart, and with smaller sub-steps ours comes nearer.
    """
    sites, actuators = rotors(vacuum)
    moments = " ".join(map(str, vacuum.inertia))
    rod = (
        f'<body pos="0 0 {-HOOK}"><joint type="ball"/>'
        f'<inertial pos="0 0 {-LENGTH}" mass="{MASS}" diaginertia="1e-9 1e-9 1e-9"/></body>'
    )
    model, data = world(f'<inertial pos="0 0 0" mass="{vacuum.mass}" diaginertia="{moments}"/>{sites}{rod}', actuators)
    data.qpos[7:] = Rotation.from_euler("y", -ANGLE).as_quat(scalar_first=True)
    for _ in range(round(1.0 / STEP)):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    apart = []
    for dt in (0.005, 0.0025, 0.00125):
        path = sailed(vacuum, start(vacuum), 1.0, dt, "rk3")
        assert path.load is not None
        here = np.concatenate([path.position[-1], path.load.position[-1]])
        apart.append(np.abs(here - np.concatenate([data.qpos[:3], data.xipos[2]])).max())
    assert np.linalg.norm(data.xipos[2] - data.qpos[:3] - [0.0, 0.0, -LENGTH]) > 0.02  # it has swung
    assert Rotation.from_quat(data.qpos[3:7], scalar_first=True).magnitude() > 0.1
    assert apart[0] < 0.006
    assert apart[1] < apart[0] / 2
    assert apart[2] < apart[1] / 2


def test_a_tendon_that_becomes_taut(vacuum: Vehicle) -> None:
    """A load that is thrown up falls, becomes taut, and swings: velocities before and after the jerk agree."""
    sites, actuators = rotors(vacuum)
    moments = " ".join(map(str, vacuum.inertia))
    model, data = world(
        f'<inertial pos="0 0 0" mass="{vacuum.mass}" diaginertia="{moments}"/>{sites}'
        f'<site name="hook" pos="0 0 {-HOOK}"/></body><body name="load" pos="0 0 {-HOOK - LENGTH}"><freejoint/>'
        f'<inertial pos="0 0 0" mass="{MASS}" diaginertia="1e-4 1e-4 1e-4"/><site name="eye"/>',
        f'<tendon><spatial limited="true" range="0 {LENGTH}" solreflimit="0.008 0.5" solimplimit="0.999 0.999 0.001">'
        f'<site site="hook"/><site site="eye"/></spatial></tendon>{actuators}',
    )
    first, thrown = start(vacuum), np.array([0.6, 0.3, 1.5])
    assert first.load is not None
    place = jnp.array([0.0, 0.0, -HOOK - LENGTH])
    first = dataclasses.replace(
        first, load=dataclasses.replace(first.load, position=place, velocity=jnp.asarray(thrown))
    )
    data.qvel[6:9] = thrown
    rows = []
    for _ in range(round(0.8 / STEP)):
        mujoco.mj_step(model, data)
        rows.append(np.concatenate([data.qvel[:3], data.qvel[6:9]]))
    path = sailed(vacuum, first, 0.8, 0.0025, "rk3")
    assert path.load is not None
    ours = np.concatenate([path.velocity, path.load.velocity], axis=1)
    theirs = np.array(rows)
    times, own = STEP * (1 + np.arange(len(theirs))), 0.0025 * (1 + np.arange(len(ours)))
    there = np.stack([np.interp(own, times, column) for column in theirs.T], axis=1)
    away = np.linalg.norm(path.load.position - path.position, axis=1)
    taut = own[np.argmax((away > LENGTH) & (own > 0.1))]
    assert 0.15 < taut < 0.6
    for moment in (taut - 0.02, taut + 0.1):
        i = np.argmin(np.abs(own - moment))
        np.testing.assert_allclose(ours[i], there[i], atol=0.06)
