"""AirSim's frames and ours: world NED and body FRD there, world ENU and body FLU here.

East is our x, north our y. Both changes are half turns: the world's about (1, 1, 0) / sqrt 2, the body's about x. A
half turn is its own inverse, so each function here goes both ways.
"""

import numpy as np

from e2efly.control import Quat

_HALF = float(np.sqrt(0.5))
_WORLD = Quat(0.0, _HALF, _HALF, 0.0)
_BODY = Quat(0.0, 1.0, 0.0, 0.0)


def world(vector: np.ndarray) -> np.ndarray:
    """A vector of one world, (3,), in the other."""
    x, y, z = vector
    return np.array([y, x, -z])


def body(vector: np.ndarray) -> np.ndarray:
    """A vector of one body frame, (3,), in the other."""
    x, y, z = vector
    return np.array([x, -y, -z])


def attitude(quaternion: np.ndarray) -> np.ndarray:
    """A unit quaternion wxyz from body to world, (4,), of the other pair of frames."""
    return np.array(_WORLD.compose(Quat.of(np.asarray(quaternion, float))).compose(_BODY).stack())
