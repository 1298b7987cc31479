"""AirSim's settings.json for a vehicle and a policy's cameras, and what it cannot say of them.

Keys: `AirSimSettings.hpp` of AirSim's AirLib. Mass, inertia, rotors and drag have none: they are set in the source, in
`MultiRotorParams::setupFrameGenericQuad`, `RotorParams` and `MultiRotorPhysicsBody::createDragVertices`.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from e2efly.deploy.policy.images import Image
from e2efly.validation.airsim.rpc import PORT
from e2efly.vehicles import Vehicle
from e2efly.vehicles.vehicle import inertia_tensor, terms

IMAGE_TYPES = {"depth": 1, "range": 2, "rgb": 0, "normal": 6, "mask": 5}
"""AirSim's `ImageType` of what a camera shows: planar depth, distance, scene, surface normals, segmentation."""


def settings(vehicle: Vehicle, images: Sequence[Image] = (), port: int = PORT) -> dict[str, Any]:
    """The content of settings.json.

    Args:
        vehicle: after which AirSim's vehicle is called.
        images: of the policy's contract.
        port: on which AirSim listens, on this machine only.
    """
    own: dict[str, Any] = {
        "VehicleType": "SimpleFlight",
        "DefaultVehicleState": "Armed",
        "AllowAPIAlways": True,
        "RC": {"RemoteControlID": -1, "AllowAPIWhenDisconnected": True},
    }
    if images:
        own["Cameras"] = {image.name: _camera(image) for image in images}
    return {
        "SettingsVersion": 1.2,
        "SimMode": "Multirotor",
        "ClockType": "SteppableClock",
        "ClockSpeed": 1.0,
        "PhysicsEngineName": "FastPhysicsEngine",
        "LocalHostIp": "127.0.0.1",
        "ApiServerPort": port,
        "Vehicles": {vehicle.name: own},
    }


def unsaid(vehicle: Vehicle, images: Sequence[Image] = ()) -> list[tuple[str, str, str]]:
    """What settings.json has no key for: (field, its value, where AirSim has it)."""
    tensor, high = inertia_tensor(vehicle), vehicle.thrust_range[1]
    front_right = np.abs(np.asarray(vehicle.rotor_position, float)).max(0)
    rows = [
        ("mass", f"{vehicle.mass:g} kg", "params.mass"),
        ("inertia", f"{_list(np.diag(tensor))} kg*m^2", "params.inertia, after computeInertiaMatrix"),
        ("rotor_position", f"x, y of {_list(front_right)} m", "params.rotor_poses"),
        ("thrust_map", f"{high:.4g} N at most", "params.rotor_params.max_thrust, after calculateMaxThrust"),
        ("torque_ratio", f"{high * vehicle.torque_ratio:.4g} N*m at most", "params.rotor_params.max_torque"),
        (
            "motor_time_constant",
            f"{vehicle.motor_time_constant:g} s of the speed",
            "params.rotor_params.control_signal_filter_tc, of the thrust",
        ),
        (
            "rotor_speed_min",
            f"{vehicle.thrust_range[0]:.3g} N at least",
            "nowhere: AirSim's rotors stand at no throttle",
        ),
        ("drag_linear", f"{_list(vehicle.drag_linear)} N*s/m", "nowhere: AirSim's drag is quadratic"),
        (
            "drag_quadratic",
            f"{_list(vehicle.drag_quadratic)} N*s^2/m^2",
            "params.linear_drag_coefficient and body_box, by createDragVertices",
        ),
    ]
    rows += [
        (f.name, _list(np.atleast_1d(getattr(vehicle, f.name))), "nowhere")
        for f in terms()
        if getattr(vehicle, f.name) is not None
    ]
    for image in images:
        if image.sees not in IMAGE_TYPES:
            rows.append((f"image {image.name!r}", f"sees {image.sees}", "nowhere"))
        if (square := _rows(image)) != image.height:
            fov = " x ".join(f"{math.degrees(angle):.4g}" for angle in image.fov_rad)
            told = f"{image.height} rows of {fov} degrees"
            rows.append((f"image {image.name!r}", told, f"AirSim's pixels are square: {square} rows see as much"))
    return rows


def _camera(image: Image) -> dict[str, Any]:
    """A camera in the vehicle's frame: forward, right, down, m; pitch upwards, degrees."""
    x, y, z = image.position_m
    capture = {
        "ImageType": IMAGE_TYPES.get(image.sees, 0),
        "Width": image.width,
        "Height": _rows(image),
        "FOV_Degrees": round(math.degrees(image.fov_rad[0]), 6),
    }
    place = {"X": x, "Y": -y + 0.0, "Z": -z + 0.0}
    angles = {"Pitch": round(-math.degrees(image.pitch_rad), 6) + 0.0, "Roll": 0.0, "Yaw": 0.0}
    return {**place, **angles, "CaptureSettings": [capture]}


def _rows(image: Image) -> int:
    """Rows of square pixels that see as high an angle."""
    wide, high = (math.tan(angle / 2) for angle in image.fov_rad)
    return max(round(image.width * high / wide), 1)


def _list(values: Any) -> str:
    return "[" + ", ".join(f"{float(value):.4g}" for value in np.asarray(values, float).ravel()) + "]"
