"""The cameras of the tests' AirSim server: what its settings.json says of them, drawn by our renderer.

What it takes from AirSim's sources: keys and defaults of settings.json (`AirSimSettings.hpp`); the field of view is
that of the longer side, and `simGetCameraInfo` tells that of ImageType -1 (`PIPCamera.cpp`); the order of colours
(`RenderRequest.cpp`); fields of the answers (`RpcLibAdaptorsBase.hpp`).
"""

import math
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import jax
import numpy as np

from e2efly.config import CameraConfig
from e2efly.courses.solids import CLASSES
from e2efly.simulation.scenes import camera
from e2efly.simulation.scenes.scene import Scene

SEES: dict[int, Any] = {0: "rgb", 1: "depth", 2: "range", 5: "label"}
SKY = 65504.0
"""Depth where nothing is: the largest half-precision number."""
PALETTE = np.array(
    [[0, 0, 0], [34, 81, 17], [107, 140, 16], [151, 126, 171], [242, 107, 146], [131, 182, 224]], np.uint8
)
"""Red, green and blue that the segmentation gives to each of `CLASSES`."""
PAD = ",".join(map(str, PALETTE[CLASSES.index("pad")]))
_DEFAULT = {"Width": 256, "Height": 144, "FOV_Degrees": 90.0}


class AirSimError(Exception):
    """An exception of AirSim's method, whose words rpclib answers."""


@dataclass
class Eyes:
    """The cameras of one vehicle, and the world that they look at."""

    settings: dict[str, Any]
    """Of settings.json."""
    version: int
    """What `getServerVersion` answers."""
    scene: Scene | None = None
    """One world, in the server's coordinates; None: flat ground."""
    changes: dict[str, Any] = field(default_factory=dict)
    """Fields of the answers that are to be wrong."""

    def show(self, scene: Scene, *kinds: int) -> None:
        """Look at another world; what draws one of its kind is compiled now, as a client does not wait so long.

        Args:
            scene: the world.
            kinds: types of images that will be asked for beside those of the settings.
        """
        self.scene = scene
        (vehicle,) = self.settings["Vehicles"].values()
        for name, own in vehicle["Cameras"].items():
            for kind in {row.get("ImageType", 0) for row in own["CaptureSettings"]} & set(SEES) | set(kinds):
                self._render(name, kind, np.array([0.0, 0.0, -1.0]), np.eye(3), 0.0)

    def camera(self, name: str) -> dict[str, Any]:
        """What the settings say of a camera.

        Raises:
            AirSimError: for one that is not there, in the words of a `std::map`.
        """
        (vehicle,) = self.settings["Vehicles"].values()
        if name not in vehicle.get("Cameras", {}):
            raise AirSimError("map::at")
        return vehicle["Cameras"][name]

    def capture(self, name: str, image_type: int) -> dict[str, Any]:
        rows = [row for row in self.camera(name)["CaptureSettings"] if row.get("ImageType", 0) == image_type]
        return _DEFAULT | (rows[-1] if rows else {})

    def info(self, name: str, position: np.ndarray, matrix: np.ndarray) -> dict[str, Any]:
        """A `CameraInfo`; of the vehicle's pose, NED and FRD."""
        place, turn = self._pose(name, position, matrix)
        fov = float(self.capture(name, -1)["FOV_Degrees"])
        return {"pose": {"position": place, "orientation": turn}, "fov": fov, "proj_mat": {"matrix": [[0.0] * 4] * 4}}

    def answer(
        self, request: dict[str, Any], position: np.ndarray, matrix: np.ndarray, time: float, stamp: int
    ) -> dict[str, Any]:
        """An `ImageResponse` to an `ImageRequest`; of the vehicle's pose, NED and FRD, s since it was placed."""
        name, kind, floats = request["camera_name"], request["image_type"], request["pixels_as_float"]
        assert not request["compress"]
        image = self._render(name, kind, position, matrix, time)
        numbers = image.ravel().tolist() if floats else []
        colours = b"" if floats else np.ascontiguousarray(image[..., ::-1] if self.version == 1 else image).tobytes()
        place, turn = self._pose(name, position, matrix)
        height, width = image.shape[:2]
        told = {
            "image_data_uint8": colours, "image_data_float": numbers, "camera_position": place, "camera_name": name,
            "camera_orientation": turn, "time_stamp": stamp, "message": "", "pixels_as_float": floats,
            "compress": False, "width": width, "height": height, "image_type": kind,
        }  # fmt: skip
        told |= {"annotation_name": request["annotation_name"]} if self.version == 4 else {}
        return told | self.changes

    def _pose(self, name: str, position: np.ndarray, matrix: np.ndarray) -> tuple[dict[str, float], dict[str, float]]:
        """Of a camera, NED: `Vector3r` and `Quaternionr`."""
        own = self.camera(name)
        half = math.radians(own["Pitch"]) / 2
        pitch = np.array([math.cos(half), 0.0, math.sin(half), 0.0])
        x, y, z = (position + matrix @ [own["X"], own["Y"], own["Z"]]).tolist()
        w, a, b, c = _product(np.array(quaternion_of(matrix)), pitch).tolist()
        return {"x_val": x, "y_val": y, "z_val": z}, {"w_val": w, "x_val": a, "y_val": b, "z_val": c}

    def _render(self, name: str, kind: int, position: np.ndarray, matrix: np.ndarray, time: float) -> np.ndarray:
        """(h, w) float32, m, or (h, w, 3) uint8, red, green, blue."""
        own, capture = self.camera(name), self.capture(name, kind)
        width, height = capture["Width"], capture["Height"]
        half = math.tan(math.radians(capture["FOV_Degrees"]) / 2) / max(width, height)
        config = CameraConfig(
            sees=SEES[kind],
            width=width,
            height=height,
            fov=(2 * math.atan(half * width), 2 * math.atan(half * height)),
            position=(own["X"], -own["Y"], -own["Z"]),
            pitch=-math.radians(own["Pitch"]),
            reach=(0.0, SKY),
        )
        east, north, up = position[1], position[0], -position[2]
        to_enu, to_frd = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]]), np.diag([1.0, -1, -1])
        attitude = quaternion_of(to_enu @ matrix @ to_frd)
        scene = Scene.of({}, 1) if self.scene is None else self.scene
        place, turn, now = (np.array([x], np.float32) for x in ([east, north, up], attitude, time))
        seen = np.asarray(_looking(config)(scene, place, turn, now))[0]
        if kind == 5:
            return PALETTE[np.round(seen).astype(int)]
        return np.round(255 * seen).astype(np.uint8) if kind == 0 else seen


@cache
def _looking(config: CameraConfig) -> Any:
    mount = camera.mount(config, 1)
    return jax.jit(
        lambda scene, position, quaternion, time: camera.look(config, scene.at(time), mount, position, quaternion)
    )


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    (w, x, y, z), (e, f, g, h) = a, b
    return np.array([
        w * e - x * f - y * g - z * h, w * f + x * e + y * h - z * g,
        w * g - x * h + y * e + z * f, w * h + x * g - y * f + z * e,
    ])  # fmt: skip


def quaternion_of(r: np.ndarray) -> list[float]:
    """Of a rotation matrix, wxyz: the eigenvector of the largest eigenvalue (Bar-Itzhack, 2000)."""
    (a, b, c), (d, e, f), (g, h, i) = r
    k = np.array([
        [a - e - i, d + b, g + c, h - f],
        [d + b, e - a - i, h + f, c - g],
        [g + c, h + f, i - a - e, d - b],
        [h - f, c - g, d - b, a + e + i],
    ])  # fmt: skip
    x, y, z, w = np.linalg.eigh(k)[1][:, -1].tolist()
    return [w, x, y, z]
