"""Names of the methods and structures of AirSim's server.

They were read in `RpcLibServerBase.cpp`, `MultirotorRpcLibServer.cpp` and `RpcLibAdaptorsBase.hpp` of its AirLib.
rpclib refuses a call with more or fewer parameters than are named there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.validation.airsim import frames
from e2efly.validation.plant import RigidState

METHODS: Mapping[str, tuple[str, ...]] = {
    "ping": (),
    "getServerVersion": (),
    "getSettingsString": (),
    "reset": (),
    "simPause": ("is_paused",),
    "simIsPaused": (),
    "simContinueForTime": ("seconds",),
    "enableApiControl": ("is_enabled", "vehicle_name"),
    "isApiControlEnabled": ("vehicle_name",),
    "armDisarm": ("arm", "vehicle_name"),
    "simGetGroundTruthKinematics": ("vehicle_name",),
    "simSetKinematics": ("state", "ignore_collision", "vehicle_name"),
    "getMultirotorState": ("vehicle_name",),
    "moveByAngleRatesThrottle": ("roll_rate", "pitch_rate", "yaw_rate", "throttle", "duration", "vehicle_name"),
    "setAngleRateControllerGains": ("kp", "ki", "kd", "vehicle_name"),
    "cancelLastTask": ("vehicle_name",),
}
"""The methods that are used, with their parameters. They are the same in every dialect of `DIALECTS`."""


@dataclass(frozen=True)
class Dialect:
    """A family of servers, distinguished by `getServerVersion`."""

    name: str
    """Name of the simulator."""
    image_parameters: tuple[str, ...]
    """Parameters of `simGetImages`."""
    image_request: tuple[str, ...]
    """Fields of an `ImageRequest`."""
    camera_parameters: tuple[str, ...]
    """Parameters of `simGetCameraInfo`."""
    colours: str
    """Order of the colours in an uncompressed image (`RenderRequest::getScreenshot`)."""


DIALECTS: Mapping[int, Dialect] = {
    1: Dialect(
        "AirSim 1.8.1",
        ("requests", "vehicle_name", "external"),
        ("camera_name", "image_type", "pixels_as_float", "compress"),
        ("camera_name", "vehicle_name", "external"),
        "BGR",
    ),
    4: Dialect(
        "Cosys-AirSim 3.3 or later",
        ("requests", "vehicle_name"),
        ("camera_name", "image_type", "pixels_as_float", "compress", "annotation_name"),
        ("camera_name", "vehicle_name"),
        "RGB",
    ),
}
"""Dialects by the answer of `getServerVersion`. They differ only in images, not for flights by state."""


def vector(values: Sequence[float] | np.ndarray) -> dict[str, float]:
    """A `Vector3r`."""
    x, y, z = (float(value) for value in values)
    return {"x_val": x, "y_val": y, "z_val": z}


def kinematics(state: RigidState) -> dict[str, Any]:
    """A `KinematicsState`: NED, body FRD, body rates about the body's axes; no acceleration."""
    w, x, y, z = frames.attitude(state.quaternion).tolist()
    return {
        "position": vector(frames.world(state.position)),
        "orientation": {"x_val": x, "y_val": y, "z_val": z, "w_val": w},
        "linear_velocity": vector(frames.world(state.velocity)),
        "angular_velocity": vector(frames.body(state.body_rate)),
        "linear_acceleration": vector((0.0, 0.0, 0.0)),
        "angular_acceleration": vector((0.0, 0.0, 0.0)),
    }


def rigid_state(answer: Any) -> RigidState:
    """The state in a `KinematicsState`, ENU and FLU.

    Raises:
        ValueError: naming the field that is missing or is not a finite number.
    """
    told = answer if isinstance(answer, dict) else {}
    quaternion = turn_of(told.get("orientation"), "KinematicsState.orientation")
    position, velocity, rate = (
        vector_of(told.get(field), f"KinematicsState.{field}")
        for field in ("position", "linear_velocity", "angular_velocity")
    )
    return RigidState(frames.world(position), frames.world(velocity), frames.attitude(quaternion), frames.body(rate))


def vector_of(told: Any, field: str) -> np.ndarray:
    """(3,) the numbers of a `Vector3r`.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    return np.array([_number(told, field, name) for name in ("x_val", "y_val", "z_val")])


def turn_of(told: Any, field: str) -> np.ndarray:
    """(4,) the unit quaternion wxyz of a `Quaternionr`. Errors are as for `vector_of`."""
    q = np.array([_number(told, field, name) for name in ("w_val", "x_val", "y_val", "z_val")])
    length = float(np.linalg.norm(q))
    if abs(length - 1) > 0.01:
        raise ValueError(f"{field} is {q.tolist()}; accepted: a unit quaternion")
    return q / length


def _number(told: Any, field: str, name: str) -> float:
    value = told.get(name) if isinstance(told, dict) else None
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise ValueError(f"{field}.{name} is {repr(value)[:120]}; accepted: a finite number")
    return float(value)
