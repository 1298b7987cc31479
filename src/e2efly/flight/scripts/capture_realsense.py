"""Depth or colours of a RealSense camera, read with pyrealsense2. They are used as the sensor delivers them, without
any of the package's filters.
"""

from __future__ import annotations

import importlib
import math
import time
from typing import Any

WAIT_MS = 1000
"""If no image comes for this time, it is checked whether the camera is still connected, ms."""
GLOBAL_CLOCK = ("global_time", "system_time")
"""Timestamp domains that are this computer's wall clock, in ms. Any other domain is the camera's own clock."""


def capture(output: Any, serial: str) -> None:
    """Publish the images of the camera with a serial number. If the number is empty, it is the only camera.

    Raises:
        RuntimeError: there is no such camera, it does not show what the policy sees, or it is unplugged.
    """
    rs = importlib.import_module("pyrealsense2")
    follow(output, rs, find(rs, rs.context().query_devices(), serial), None)


def find(rs: Any, devices: Any, serial: str) -> Any:
    """The camera with a serial number. If the number is empty, the only camera.

    Raises:
        RuntimeError: no camera fits, or more than one. The message names the cameras that are connected.
    """
    there = [device.get_info(rs.camera_info.serial_number) for device in devices]
    chosen = [device for device, number in zip(devices, there) if serial in ("", number)]  # noqa: B905  # Python 3.8
    if len(chosen) != 1:
        what = repr(serial) if serial else "chosen"
        raise RuntimeError(f"no camera is {what}; there are: {', '.join(there) or 'none'}; accepted: realsense:SERIAL")
    return chosen[0]


def follow(output: Any, rs: Any, device: Any, begun: Any) -> None:
    """Publish the images of a device until it is unplugged.

    The frames are read from its sensor and not from a pipeline, so nothing aligns, decimates or fills them. `rs` is the
    module pyrealsense2. `begun` is called when the camera streams, unless it is None.

    Raises:
        RuntimeError: the camera does not show what the policy sees, or is unplugged.
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
    queue = rs.frame_queue(1)  # only the newest frame
    sensor.open(profile)
    sensor.start(queue)
    if begun is not None:
        begun()
    intrinsics = profile.get_intrinsics()
    fov = tuple(
        2 * math.atan(size / (2 * focal))
        for size, focal in ((intrinsics.width, intrinsics.fx), (intrinsics.height, intrinsics.fy))
    )
    clock = CameraClock(output.speech)
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
    """The sort key of a stream profile: the profile with the least key is used.

    First comes the rate that is nearest to 30 images per second, then the width nearest to 848 columns, which is the
    widest view of a D435i, then the height nearest to 480 rows.
    """
    return abs(profile.fps() - 30), abs(profile.width() - 848), abs(profile.height() - 480)


def values_of(data: Any, scale: float | None) -> tuple[bytes, tuple[int, ...], str]:
    """The values of a frame in the format of the shared memory.

    Args:
        data: (h, w) uint16 depth, where 0 is a hole, or (h, w, 3) uint8 colours.
        scale: the size of one unit of depth, m. None: the values are colours.

    Returns:
        Their bytes, their shape and their type. Depth in units of 1 mm stays as it is; other units become m.
    """
    np = importlib.import_module("numpy")
    image = np.asanyarray(data)
    if scale is None or abs(scale - 1e-3) < 1e-9:
        return image.tobytes(), image.shape, "uint16" if scale is not None else "uint8"
    return (image * np.float32(scale)).astype("<f4").tobytes(), image.shape, "float32"


class CameraClock:
    """Converts the timestamps of frames to times on the monotonic clock.

    The origin of the camera's own clock is not known. The offset between the clocks is taken from the frame that came
    soonest after its stamp, whose delay counts as zero. So a frame that was held up looks as old as it is.
    """

    def __init__(self, speech: Any) -> None:
        """Nothing is known yet."""
        self._speech = speech
        self._stamps = importlib.import_module("capture").Stamps(speech, "the camera")
        self._apart = math.inf

    def moment(self, stamp: float, domain: str) -> float:
        """When a frame that arrives now was exposed, s on the monotonic clock. `stamp` is in ms, and `domain` its
        clock: the name of a `rs.timestamp_domain`.
        """
        if domain in GLOBAL_CLOCK:
            return self._stamps.moment(1e-3 * stamp)
        if self._apart == math.inf:
            self._speech.say("problem", "stamps are of the camera's own clock: the time on the way is not in them")
        self._apart = min(self._apart, time.monotonic() - 1e-3 * stamp)
        return 1e-3 * stamp + self._apart
