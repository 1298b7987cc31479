"""AirSim's settings.json for a vehicle and a policy's cameras, and the values that it cannot contain.

The keys come from `AirSimSettings.hpp` of AirSim's AirLib. Mass, inertia, rotors and drag have no keys. They are set in
the source, in `MultiRotorParams::setupFrameGenericQuad`, `RotorParams` and `MultiRotorPhysicsBody::createDragVertices`.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from e2efly.policy.images import Image
from e2efly.validation.airsim.airsim_camera import IMAGE_TYPES
from e2efly.validation.airsim.rpc import PORT
from e2efly.vehicles.vehicle import Vehicle, inertia_tensor, terms

CELL = 4
"""Smallest number of AirSim pixels per row and column of the policy's image, if its pixels are not square. AirSim's
pixels are square."""


def settings(vehicle: Vehicle, images: Sequence[Image] = (), port: int = PORT) -> dict[str, Any]:
    """The content of settings.json for a vehicle and the images of a contract.

    AirSim listens on this machine only.
    """
    own: dict[str, Any] = {
        "VehicleType": "SimpleFlight",
        "DefaultVehicleState": "Armed",
        "AllowAPIAlways": True,
        "RC": {"RemoteControlID": -1, "AllowAPIWhenDisconnected": True},
    }
    if cameras := {image.name: _camera(image) for image in images if not _beyond(image)}:
        own["Cameras"] = cameras
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
    """Values for which settings.json has no key: (field, its value, its place in AirSim)."""
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
    return rows + [(f"image {image.name!r}", told, "no camera") for image in images if (told := _beyond(image))]


def named(images: Sequence[Image]) -> list[str]:
    """Options with which `e2efly validate` uses the cameras of the file, one per image."""
    colour = {"mask": ":RED,GREEN,BLUE"}
    return [
        f"--image {image.name}=plant:{image.name}{colour.get(image.sees, '')}" for image in images if not _beyond(image)
    ]


def _beyond(image: Image) -> str | None:
    """The part of an image that AirSim's cameras cannot provide. None: they can provide all of it."""
    if image.sees not in IMAGE_TYPES:
        return f"sees {image.sees}"
    return None if image.projection == "pinhole" else f"is {image.projection}"


def _camera(image: Image) -> dict[str, Any]:
    """A camera in the vehicle's frame: forward, right, down, m; pitch upwards, degrees.

    `simGetCameraInfo` gives the field of view of ImageType -1, the camera itself. Both therefore get the same value.
    """
    x, y, z = image.position_m
    width, height = _size(image)
    half = math.tan(image.fov_rad[0] / 2) * max(width, height) / width  # Unreal's angle is that of the longer side
    fov = {"FOV_Degrees": round(math.degrees(2 * math.atan(half)), 6)}
    kinds = -1, IMAGE_TYPES[image.sees]
    place = {"X": x, "Y": -y + 0.0, "Z": -z + 0.0}
    angles = {"Pitch": round(-math.degrees(image.pitch_rad), 6) + 0.0, "Roll": 0.0, "Yaw": 0.0}
    captures = [{"ImageType": kind, "Width": width, "Height": height, **fov} for kind in kinds]
    return {**place, **angles, "CaptureSettings": captures}


def _size(image: Image) -> tuple[int, int]:
    """Columns and rows of square pixels.

    If the policy's pixels are square, these are its own numbers. Otherwise there are at least `CELL` times as many, and
    the policy's pixels are made from them.
    """
    wide, high = (math.tan(angle / 2) for angle in image.fov_rad)
    rows = image.width * high / wide
    if abs(rows / image.height - 1) < 1e-3:
        return image.width, image.height
    times = math.ceil(CELL * max(1.0, image.height / rows))
    return image.width * times, math.ceil(rows * times)


def _list(values: Any) -> str:
    return "[" + ", ".join(f"{float(value):.4g}" for value in np.asarray(values, float).ravel()) + "]"
