"""An AirSim camera as a policy's camera: checked against the contract, cropped and resampled to it."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from e2efly.control import Quat, Vec3
from e2efly.flight.sight.fit import fitted
from e2efly.policy.images import Image
from e2efly.validation.airsim.airsim_images import (
    DEPTH_PERSPECTIVE,
    DEPTH_PLANAR,
    NAMES,
    SCENE,
    SEGMENTATION,
    Picture,
    fields_of_view,
)
from e2efly.validation.airsim.lockstep import AirSimSession
from e2efly.validation.plant import RigidState

IMAGE_TYPES = {"depth": DEPTH_PLANAR, "range": DEPTH_PERSPECTIVE, "rgb": SCENE, "mask": SEGMENTATION}
"""AirSim's `ImageType` for each kind of image of a policy. Surface normals are left out, because AirSim does not say in
which frame they are."""
OFF_M, OFF_RAD = 0.02, math.radians(1.0)
"""Largest accepted difference of a camera's position, m, and direction, rad, from the contract."""
NEAR_M, NEAR_RAD, LATE_S = 0.003, 0.003, 0.004
"""Largest accepted errors of a picture in flight: the camera's position, m, and direction, rad, and the age of the
shown vehicle position, s: one physics step."""
FOV_DEG = 0.5
"""Largest accepted difference between the field of view in the settings and that of `simGetCameraInfo`, degrees."""
_TRIES = 8
"""Physics steps after which a picture must show the vehicle's present position."""
FORM = "plant:CAMERA, for a mask plant:CAMERA:RED,GREEN,BLUE"


@dataclass(frozen=True)
class AirSimMount:
    """How a camera is mounted on its vehicle."""

    place: np.ndarray
    """(3,) position: forward, left, up, m."""
    turn: np.ndarray
    """(4,) unit, wxyz: rotation from the camera's axes forward, left, up to those of the vehicle."""

    def off(self, other: "AirSimMount") -> tuple[float, float]:
        """Distance, m, and angle, rad, to another mount."""
        cosine = abs(float(self.turn @ other.turn))
        return float(np.linalg.norm(self.place - other.place)), 2 * math.acos(min(cosine, 1.0))


@dataclass(frozen=True)
class AirSimCamera:
    """One camera for one image of a contract."""

    name: str
    """Name of the camera in AirSim's settings."""
    image: Image
    """Image of the contract."""
    colour: tuple[int, ...] = ()
    """Red, green and blue, 0 to 255, of the mask's class in AirSim's segmentation. Empty for other images."""
    longer: float = 0.0
    """Field of view of the longer side, degrees."""
    size: tuple[int, int] = (0, 0)
    """Columns and rows of its pictures."""
    mount: AirSimMount | None = None
    """The measured mount."""

    @property
    def kind(self) -> int:
        """AirSim's `ImageType` of the camera."""
        return IMAGE_TYPES[self.image.sees]

    def describe(self) -> str:
        """A description of the camera, as text."""
        across, down = (math.degrees(angle) for angle in fields_of_view(self.longer, *self.size))
        return (
            f"{self.image.name} is what AirSim's camera {self.name!r} shows of AirSim's world ({NAMES[self.kind]}, "
            f"{self.size[0]} x {self.size[1]} pixels, {across:.4g} x {down:.4g} degrees), without the task's world, "
            "noise and random mounting."
        )


def camera_of(where: str, image: Image) -> AirSimCamera:
    """The camera that a text names, before AirSim is asked for it: CAMERA, or CAMERA:RED,GREEN,BLUE for a mask.

    Raises:
        ValueError: naming the text and what is accepted; or naming an image that AirSim's cameras cannot provide.
    """
    given = f"--image {image.name} is 'plant:{where}'"
    if image.sees not in IMAGE_TYPES:
        raise ValueError(f"{given}, and the policy sees {image.sees}; accepted of AirSim: {', '.join(IMAGE_TYPES)}")
    if image.projection != "pinhole":
        raise ValueError(f"{given}, and the policy's camera is {image.projection}; accepted of AirSim: pinhole")
    name, colon, text = where.partition(":")
    if not name or bool(colon) != (image.sees == "mask"):
        lacking = (
            f"; which colour of AirSim's segmentation is {image.of!r} no AirSim says" if image.sees == "mask" else ""
        )
        raise ValueError(f"{given}{lacking}; accepted: {FORM}")
    colour = tuple(int(part) for part in text.split(",") if part.isascii() and part.isdigit())
    if colon and not (len(colour) == 3 == len(text.split(",")) and max(colour) <= 255):
        raise ValueError(f"{given}; accepted: {FORM}, each 0 to 255")
    return AirSimCamera(name, image, colour)


def opened(session: AirSimSession, camera: AirSimCamera) -> AirSimCamera:
    """The camera with AirSim's data, after one picture of the standing vehicle.

    Raises:
        ValueError: for a camera that sees less than the contract's camera, is mounted differently, has too few pixels,
            or gives an invalid answer.
        RpcError: when AirSim refuses, as for an unknown camera.
    """
    session.tick()  # the game draws the vehicle at its position
    first, found = _picture(session, camera)
    longer, where = session.field_of_view(camera.name), _where(session, camera)
    told = _told(session.settings, session.vehicle, camera)
    if told is not None and abs(told - longer) > FOV_DEG:
        raise ValueError(
            f"{where}: simGetCameraInfo says a field of view of {longer:g} degrees, and FOV_Degrees of ImageType "
            f"{camera.kind} in the settings is {told:g}; accepted: the same FOV_Degrees for the ImageTypes -1 and "
            f"{camera.kind}, as e2efly airsim-settings writes them"
        )
    height, width = first.image.shape[:2]
    whole = replace(camera, longer=longer, size=(width, height), mount=found)
    _fitted(first, whole, where)
    return whole


def taken(session: AirSimSession, camera: AirSimCamera) -> np.ndarray:
    """The present image of the policy's camera: (h, w) or (h, w, 3) float32, as `Image.check` accepts it.

    AirSim updates what it draws once per frame of its game, and never during a pause. A picture may therefore show an
    earlier position of the vehicle, which it reports. Then one physics step passes, and another picture is taken.

    Raises:
        ValueError: for a picture that was not taken by this camera at the vehicle's position, or for an invalid answer.
        RpcError: when AirSim refuses.
    """
    return _fitted(_picture(session, camera)[0], camera, _where(session, camera))


def _fitted(seen: Picture, camera: AirSimCamera, where: str) -> np.ndarray:
    """A picture as the policy's camera would have taken it."""
    height, width = seen.image.shape[:2]
    if (width, height) != camera.size:
        raise ValueError(
            f"{where}: a picture has {width} columns and {height} rows; accepted: {camera.size[0]} and "
            f"{camera.size[1]}, as the first"
        )
    fov, values = fields_of_view(camera.longer, width, height), seen.image
    if camera.kind == SCENE:
        values = values / 255
    elif camera.kind == SEGMENTATION:
        values = (values == np.array(camera.colour)).all(axis=-1).astype(np.float64)
    image = fitted(values, fov, camera.image, where)
    camera.image.check(image, ())
    return image


def _picture(session: AirSimSession, camera: AirSimCamera) -> tuple[Picture, AirSimMount]:
    """A picture from the camera's present place.

    Until its mount is known, this is the place that the contract gives.
    """
    image, half = camera.image, camera.image.pitch_rad / 2
    meant = AirSimMount(np.array(image.position_m), np.array([math.cos(half), 0.0, math.sin(half), 0.0]))
    off = ""
    for _ in range(_TRIES):
        state, seen = session.state(), session.picture(camera.name, camera.kind)
        found = _mount(seen, state)
        far, turn = found.off(camera.mount or meant)
        late = LATE_S * float(np.linalg.norm(state.velocity)), LATE_S * float(np.linalg.norm(state.body_rate))
        most = (OFF_M, OFF_RAD) if camera.mount is None else (NEAR_M + late[0], NEAR_RAD + late[1])
        if far <= most[0] and turn <= most[1]:
            return seen, found
        off = (
            f"a picture is taken {found.place.round(3).tolist()} m (forward, left, up) from the vehicle, "
            f"{math.degrees(turn):.2f} degrees from where the camera is to look; accepted: {list(image.position_m)} m "
            f"to within {most[0]:.3f}, and {math.degrees(image.pitch_rad):.4g} degrees downwards to within "
            f"{math.degrees(most[1]):.2f}"
        )
        session.tick()
    raise ValueError(f"{_where(session, camera)}: {off}")


def _mount(seen: Picture, state: RigidState) -> AirSimMount:
    """The camera's mount, from one of its pictures and the vehicle's state."""
    attitude = Quat.of(state.quaternion)
    away = attitude.unrotate(Vec3.of(seen.position - state.position))
    turn = attitude.conjugate().compose(Quat.of(seen.quaternion))
    return AirSimMount(np.array([away.x, away.y, away.z], float), np.array(turn.stack()))


def _where(session: AirSimSession, camera: AirSimCamera) -> str:
    return f"{session.rpc.where}: camera {camera.name!r} for {camera.image.name}"


def _told(settings: dict[str, Any], vehicle: str, camera: AirSimCamera) -> float | None:
    """The field of view in the settings, degrees. None if they do not give it."""
    vehicles = settings.get("Vehicles")
    if not isinstance(vehicles, dict):
        return None
    own: Any = vehicles.get(vehicle) if vehicle else next(iter(vehicles.values()), None) if len(vehicles) == 1 else None
    for key in ("Cameras", camera.name, "CaptureSettings"):
        own = own.get(key) if isinstance(own, dict) else None
    rows = own if isinstance(own, list) else []
    found = [row.get("FOV_Degrees") for row in rows if isinstance(row, dict) and row.get("ImageType", 0) == camera.kind]
    return float(found[-1]) if found and isinstance(found[-1], int | float) else None
