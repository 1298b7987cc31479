"""Depth or colours of a RealSense camera, by pyrealsense2: as the sensor gives them, without any of its filters."""

from __future__ import annotations

import importlib
import math
import time
from typing import Any

WAIT_MS = 1000
"""A camera that gives no image for so long is looked for: it may be unplugged."""
GLOBAL_CLOCK = ("global_time", "system_time")
"""Timestamp domains that are this computer's wall clock, in ms; any other is the camera's own clock."""


def capture(output: Any, serial: str) -> None:
    """Publish the images of the camera with a serial number, or of the only one.

    Raises:
        RuntimeError: when there is no such camera, it does not show what the policy sees, or it is unplugged.
    """
    rs = importlib.import_module("pyrealsense2")
    follow(output, rs, find(rs, rs.context().query_devices(), serial), None)


def find(rs: Any, devices: Any, serial: str) -> Any:
    """The camera with a serial number, or the only one.

    Raises:
        RuntimeError: when there is none, or more than one, naming those that there are.
    """
    there = [device.get_info(rs.camera_info.serial_number) for device in devices]
    chosen = [device for device, number in zip(devices, there) if serial in ("", number)]  # noqa: B905  # Python 3.8
    if len(chosen) != 1:
        what = repr(serial) if serial else "chosen"
        raise RuntimeError(f"no camera is {what}; there are: {', '.join(there) or 'none'}; accepted: realsense:SERIAL")
    return chosen[0]


def follow(output: Any, rs: Any, device: Any, begun: Any) -> None:
    """Publish the images of a device until it goes.

    The frames come from its sensor and not from a pipeline, so that nothing aligns, decimates or fills them.

    Args:
        output: of the capture process.
        rs: the module pyrealsense2.
        device: the camera.
        begun: called when it streams; None: nothing.

    Raises:
        RuntimeError: when it does not show what the policy sees, or gives no more images.
    """
    depth = output.sees == "depth"
    if not depth and output.sees != "rgb":
        raise RuntimeError(f"it gives depth and colours; accepted: a policy that sees depth or rgb, not {output.sees}")
    stream, kind = (rs.stream.depth, rs.format.z16) if depth else (rs.stream.color, rs.format.rgb8)
    found = [
        (sensor, profile.as_video_stream_profile())
        for sensor in device.query_sensors()
        for profile in sensor.get_stream_profiles()
        if profile.stream_type() == stream and profile.format() == kind
    ]
    if not found:
        raise RuntimeError(f"the camera has no {'depth as z16' if depth else 'colours as rgb8'}")
    sensor, profile = min(found, key=lambda pair: preference(pair[1]))
    scale = sensor.as_depth_sensor().get_depth_scale() if depth else 1.0
    if sensor.supports(rs.option.global_time_enabled):
        sensor.set_option(rs.option.global_time_enabled, 1.0)  # stamps by this computer's clock
    queue = rs.frame_queue(1)  # the newest alone
    sensor.open(profile)
    sensor.start(queue)
    if begun is not None:
        begun()
    intrinsics = profile.get_intrinsics()
    fov = tuple(
        2 * math.atan(size / (2 * focal))
        for size, focal in ((intrinsics.width, intrinsics.fx), (intrinsics.height, intrinsics.fy))
    )
    clock = Clock(output.speech)
    name = device.get_info(rs.camera_info.name) if device.supports(rs.camera_info.name) else "camera"
    detail = f"{name}, pyrealsense2 {rs.__version__}" if hasattr(rs, "__version__") else name
    while not output.speech.closing.is_set():
        there, frame = queue.try_wait_for_frame(WAIT_MS)
        if not there:
            if not device.is_connected():
                raise RuntimeError("the camera is unplugged")
            continue
        moment = clock.moment(frame.get_timestamp(), frame.get_frame_timestamp_domain().name)
        values, shape, kind_of = values_of(frame.get_data(), scale if depth else None)
        output.put(moment, values, shape, kind_of, fov, detail)
    sensor.stop()
    sensor.close()


def preference(profile: Any) -> tuple[int, int, int]:
    """The least is taken: 30 images a second or what is nearest, then 848 columns, of a D435i its widest view."""
    return abs(profile.fps() - 30), abs(profile.width() - 848), abs(profile.height() - 480)


def values_of(data: Any, scale: float | None) -> tuple[bytes, tuple[int, ...], str]:
    """The values of a frame as shared memory has them.

    Args:
        data: (h, w) uint16 depth, 0 a hole, or (h, w, 3) uint8 colours.
        scale: m of one unit of depth; None: these are colours.

    Returns:
        Their bytes, their shape and their type: whole units of 1 mm as they are, other units in m.
    """
    np = importlib.import_module("numpy")
    image = np.asanyarray(data)
    if scale is None or abs(scale - 1e-3) < 1e-9:
        return image.tobytes(), image.shape, "uint16" if scale is not None else "uint8"
    return (image * np.float32(scale)).astype("<f4").tobytes(), image.shape, "float32"


class Clock:
    """Timestamps of frames as times on the monotonic clock.

    Those of the camera's own clock start anywhere: the frame that came soonest after its stamp tells how far the clocks
    are apart, so that a frame which is held up looks as old as it is. The least delay of all counts as none.
    """

    def __init__(self, speech: Any) -> None:
        """Nothing is known yet."""
        self._speech = speech
        self._stamps = importlib.import_module("capture").Stamps(speech, "the camera")
        self._apart = math.inf

    def moment(self, stamp: float, domain: str) -> float:
        """When a frame was exposed that comes now, s on the monotonic clock.

        Args:
            stamp: ms.
            domain: whose clock: the name of a `rs.timestamp_domain`.
        """
        if domain in GLOBAL_CLOCK:
            return self._stamps.moment(1e-3 * stamp)
        if self._apart == math.inf:
            self._speech.say("problem", "stamps are of the camera's own clock: the time on the way is not in them")
        self._apart = min(self._apart, time.monotonic() - 1e-3 * stamp)
        return 1e-3 * stamp + self._apart
