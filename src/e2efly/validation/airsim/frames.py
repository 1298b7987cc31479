"""Frames of AirSim and ours: AirSim has world NED and body FRD, we have world ENU and body FLU.

East is our x, and north is our y. Both conversions are half turns: that of the world about (1, 1, 0) / sqrt 2, that of
the body about x. A half turn is its own inverse, so each function here works in both directions.
"""

import numpy as np

from e2efly.control import Quat

_HALF = float(np.sqrt(0.5))
_WORLD = Quat(0.0, _HALF, _HALF, 0.0)
_BODY = Quat(0.0, 1.0, 0.0, 0.0)


def world(vector: np.ndarray) -> np.ndarray:
    """Convert a vector, (3,), from one world frame to the other."""
    x, y, z = vector
    return np.array([y, x, -z])


def body(vector: np.ndarray) -> np.ndarray:
    """Convert a vector, (3,), from one body frame to the other."""
    x, y, z = vector
    return np.array([x, -y, -z])


def attitude(quaternion: np.ndarray) -> np.ndarray:
    """Convert a unit quaternion wxyz from body to world, (4,), from one pair of frames to the other."""
    return np.array(_WORLD.compose(Quat.of(np.asarray(quaternion, float))).compose(_BODY).stack())
