"""Your own plant: a point mass that follows commanded rates at once. `e2efly validate hover --plant FILE:PointMass`."""

import numpy as np

import e2efly
from e2efly.control import Quat, Vec3


@e2efly.register_plant("point_mass")
class PointMass(e2efly.Plant):
    """Thrust and body rates equal the commands. There is neither lag nor drag."""

    def __init__(self, vehicle: object, command_mode: str) -> None:
        """Create the plant. It ignores the vehicle."""
        if command_mode != "ctbr":
            raise ValueError(f"command_mode is {command_mode}; accepted: ctbr")
        self._state = e2efly.RigidState(np.zeros(3), np.zeros(3), np.eye(4)[0], np.zeros(3))

    @property
    def state(self) -> e2efly.RigidState:
        """The current state of the vehicle."""
        return self._state

    def reset(self, state: e2efly.RigidState) -> None:
        """Set the state of the vehicle."""
        self._state = state

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command for `dt` s: an exact rotation about a fixed axis, with the thrust direction in the middle of
        the step.
        """
        s, thrust, rate = self._state, command[0], command[1:]
        middle, end = (_turned(s.quaternion, rate, part * dt) for part in (0.5, 1.0))
        push = thrust * np.array(Quat.of(middle).z_axis().stack()) - np.array([0.0, 0.0, 9.81])
        position = s.position + dt * s.velocity + 0.5 * dt**2 * push
        self._state = e2efly.RigidState(position, s.velocity + dt * push, end, rate.copy())


def _turned(quaternion: np.ndarray, rate: np.ndarray, dt: float) -> np.ndarray:
    speed = max(float(np.linalg.norm(rate)), 1e-12)
    axis = Vec3(*(np.sin(speed * dt / 2) * rate / speed))
    return np.array(Quat.of(quaternion).compose(Quat(np.cos(speed * dt / 2), axis.x, axis.y, axis.z)).stack())


if __name__ == "__main__":
    found = e2efly.validate("hover", PointMass, episodes=5)
    print(f"the zoo's hover on a point mass: success drops by {found.criteria['hover'].drop:.0f} points")
