"""Where the vehicle is and how it moves: what pose sources deliver and what the bridge flies by."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sample:
    """One message of a pose source, as it came, in the source's own clock."""

    received: float
    """When it arrived, s on this machine's monotonic clock."""
    position: np.ndarray
    """(3,) centre of mass, world ENU, m."""
    quaternion: np.ndarray
    """(4,) attitude, wxyz, body FLU to world ENU."""
    stamp: float | None = None
    """When it was true, s on the source's clock; None: the source does not say."""
    velocity: np.ndarray | None = None
    """(3,) world, m/s; None: to be estimated."""
    body_rate: np.ndarray | None = None
    """(3,) about body x, y, z, rad/s; None: to be estimated."""
    frame: str = ""
    """Name of the frame that the source says it speaks of; empty: it does not say."""


@dataclass(frozen=True)
class Odometry:
    """The vehicle's motion, checked."""

    time: float
    """When it was true, s on this machine's monotonic clock."""
    position: np.ndarray
    """(3,) centre of mass, world ENU, m."""
    velocity: np.ndarray
    """(3,) world, m/s."""
    quaternion: np.ndarray
    """(4,) unit, wxyz, body FLU to world ENU, w >= 0 not enforced: continuous in time."""
    body_rate: np.ndarray
    """(3,) about body x, y, z, rad/s."""
