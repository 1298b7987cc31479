"""Images in AirSim's protocol: requests, answers and errors in them. Pure functions.

The formats were read in `RpcLibAdaptorsBase.hpp`, `ImageCaptureBase.hpp`, `UnrealImageCapture.cpp`,
`RenderRequest.cpp` and `PIPCamera.cpp` of AirSim's sources.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.validation.airsim import frames
from e2efly.validation.airsim.protocol import Dialect, turn_of, vector_of

SCENE, DEPTH_PLANAR, DEPTH_PERSPECTIVE, SEGMENTATION = 0, 1, 2, 5
"""Values of `ImageCaptureBase::ImageType`: colours, depth along the optical axis, distance, a colour for each
object."""
NAMES: Mapping[int, str] = {
    SCENE: "Scene", DEPTH_PLANAR: "DepthPlanar", DEPTH_PERSPECTIVE: "DepthPerspective", SEGMENTATION: "Segmentation",
}  # fmt: skip
"""AirSim's names of these types."""
FLOATS = (DEPTH_PLANAR, DEPTH_PERSPECTIVE)
"""The types that are requested as numbers, m."""
_LARGEST = 4096
"""Largest accepted length of a side, pixels."""


@dataclass(frozen=True)
class Picture:
    """A camera's picture, and the camera's pose at that time."""

    image: np.ndarray
    """(h, w) float64, m; or (h, w, 3) uint8: red, green, blue."""
    position: np.ndarray
    """(3,) position of the camera, ENU, relative to the place where AirSim has put the vehicle, m."""
    quaternion: np.ndarray
    """(4,) unit, wxyz: rotation from the camera's axes forward, left, up to ENU."""


def image_request(dialect: Dialect, camera: str, image_type: int) -> dict[str, Any]:
    """An `ImageRequest` for an uncompressed picture."""
    values = (camera, image_type, image_type in FLOATS, False, "")
    return dict(zip(dialect.image_request, values, strict=False))


def picture(answer: Any, request: Mapping[str, Any], dialect: Dialect) -> Picture:
    """The picture in an answer to one request of `simGetImages`.

    Raises:
        ValueError: naming the field, its value and what is accepted.
    """
    if not (isinstance(answer, list) and len(answer) == 1 and isinstance(answer[0], dict)):
        raise ValueError(f"the answer is {_short(answer)}; accepted: a list of one ImageResponse")
    response: dict[str, Any] = answer[0]
    width, height = (response.get(name) for name in ("width", "height"))
    if not width and not height and response.get("message"):  # no picture was taken; the message says why
        raise _refusal("message", response["message"], "none, and a picture")
    for name, size in (("width", width), ("height", height)):
        if isinstance(size, bool) or not isinstance(size, int) or not 1 <= size <= _LARGEST:
            raise _refusal(name, size, f"1 to {_LARGEST} pixels")
    assert isinstance(width, int)
    assert isinstance(height, int)
    if response.get("image_type") != request["image_type"]:
        raise _refusal("image_type", response.get("image_type"), str(request["image_type"]))
    position = vector_of(response.get("camera_position"), "ImageResponse.camera_position")
    turn = turn_of(response.get("camera_orientation"), "ImageResponse.camera_orientation")
    image = _depth if request["pixels_as_float"] else _colours
    return Picture(image(response, width, height, dialect), frames.world(position), frames.attitude(turn))


def field_of_view(answer: Any) -> float:
    """Field of view of the longer side of a camera's pictures, degrees, from the answer to `simGetCameraInfo`.

    Raises:
        ValueError: naming the field, its value and what is accepted.
    """
    angle = answer.get("fov") if isinstance(answer, dict) else None
    if isinstance(angle, bool) or not isinstance(angle, int | float) or not 0 < angle < 180:
        raise ValueError(f"CameraInfo.fov is {_short(angle)}; accepted: an angle between 0 and 180 degrees")
    return float(angle)


def fields_of_view(longer: float, width: int, height: int) -> tuple[float, float]:
    """Horizontal and vertical field of view of a pinhole camera with square pixels, rad.

    Args:
        longer: field of view of the longer side, degrees. This is the meaning of Unreal's `FOVAngle` in
            `APIPCamera::getProjectionMatrix`.
        width: columns.
        height: rows.
    """
    half = math.tan(math.radians(longer) / 2) / max(width, height)
    return 2 * math.atan(half * width), 2 * math.atan(half * height)


def _depth(response: Mapping[str, Any], width: int, height: int, dialect: Dialect) -> np.ndarray:
    data = response.get("image_data_float")
    if not isinstance(data, list) or len(data) != width * height:
        raise _refusal("image_data_float", _size(data), f"{width * height} numbers: {height} rows of {width}")
    try:
        image = np.array(data, np.float64)
    except (TypeError, ValueError):
        image = np.full(1, np.nan)
    if image.shape != (width * height,):
        raise _refusal("image_data_float", _short(data), "numbers")
    if bad := np.flatnonzero(~(image >= 0)).tolist():  # infinity is the sky
        row, column = divmod(bad[0], width)
        place = f"image_data_float in row {row}, column {column}"
        raise _refusal(place, float(image[bad[0]]), "0 or more metres")
    return image.reshape(height, width)


def _colours(response: Mapping[str, Any], width: int, height: int, dialect: Dialect) -> np.ndarray:
    data = response.get("image_data_uint8")
    if not isinstance(data, bytes) or len(data) != 3 * width * height:
        accepted = f"{3 * width * height} bytes: {height} rows of {width} pixels of 3"
        raise _refusal("image_data_uint8", _size(data), accepted)
    image = np.frombuffer(data, np.uint8).reshape(height, width, 3)
    return image[..., [dialect.colours.index(colour) for colour in "RGB"]]


def _size(data: Any) -> str:
    if isinstance(data, bytes):
        return f"{len(data)} bytes"
    return f"a list of {len(data)}" if isinstance(data, list) else _short(data)


def _refusal(field: str, value: Any, accepted: str) -> ValueError:
    return ValueError(f"ImageResponse.{field} is {_short(value)}; accepted: {accepted}")


def _short(value: Any) -> str:
    return str(value)[:120]
