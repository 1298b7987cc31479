"""The capture process with a camera of software: librealsense's own software device, into which frames are injected.

    software_camera.py realsense NAME SEES FOV SERIAL

The kind of camera is in the environment variable SOFTWARE_CAMERA: its unit of depth, m, and the domain of its stamps.
"""

import importlib
import os
import sys
import threading
import time
from typing import Any

import numpy as np
import pyrealsense2 as rs

from e2efly.flight.child import SCRIPTS

sys.path.insert(0, str(SCRIPTS))
WIDTH, HEIGHT, FOCAL = 96, 48, 40.0
FRAMES = 60
"""After these it is unplugged."""


class Device:
    """A software device that tells, after its last frame, that it is not connected; nothing else of it is changed."""

    def __init__(self, unit: float) -> None:
        self.inner = rs.software_device()
        self.inner.register_info(rs.camera_info.name, "Software camera")
        self.inner.register_info(rs.camera_info.serial_number, "042")
        self.connected = True
        self.sensors = {}
        for stream, kind, size in ((rs.stream.depth, rs.format.z16, 2), (rs.stream.color, rs.format.rgb8, 3)):
            sensor = self.inner.add_sensor(str(stream))
            for width, height in ((WIDTH // 2, HEIGHT // 2), (WIDTH, HEIGHT)):  # the wider one is to be taken
                video = rs.video_stream()
                video.type, video.fmt, video.bpp, video.fps = stream, kind, size, 30
                video.uid, video.index, video.width, video.height = size + 10 * width, 0, width, height
                view = rs.intrinsics()
                view.width, view.height, view.fx, view.fy = width, height, FOCAL * width / WIDTH, FOCAL * width / WIDTH
                view.ppx, view.ppy, view.model, view.coeffs = width / 2, height / 2, rs.distortion.none, [0.0] * 5
                video.intrinsics = view
                sensor.add_video_stream(video)
            if stream == rs.stream.depth:
                sensor.add_read_only_option(rs.option.depth_units, unit)
            self.sensors[stream] = sensor

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def is_connected(self) -> bool:
        return self.connected


def inject(device: Device, stream: Any, unit: float, domain: str) -> None:
    """30 frames a second, exposed 20 ms before they come."""
    sensor = device.sensors[stream]
    profile = next(p for p in sensor.get_stream_profiles() if p.as_video_stream_profile().width() == WIDTH)
    metres = np.tile(1 + 0.05 * np.arange(WIDTH), (HEIGHT, 1))
    metres[:, :3] = 0.0  # a hole
    pixels = np.round(metres / unit).astype(np.uint16)
    if stream == rs.stream.color:
        pixels = np.full((HEIGHT, WIDTH, 3), (10, 40, 250), np.uint8)
        pixels[:, : WIDTH // 2] = (200, 30, 60)
    for number in range(FRAMES):
        frame = rs.software_video_frame()
        frame.pixels, frame.bpp = pixels, pixels.itemsize * (pixels.shape[2] if pixels.ndim == 3 else 1)
        frame.stride, frame.frame_number, frame.profile = frame.bpp * WIDTH, number, profile.as_video_stream_profile()
        now = time.time() if domain != "hardware_clock" else time.monotonic() - 500.0
        frame.timestamp, frame.domain = 1e3 * (now - 0.02), getattr(rs.timestamp_domain, domain)
        if stream == rs.stream.depth:
            frame.depth_units = unit
        sensor.on_video_frame(frame)
        time.sleep(1 / 30)
    device.connected = False


def capture(speech: Any, name: str, sees: str, fov: str, serial: str) -> None:
    """As capture.py does, with this device for the ones that are plugged in."""
    unit, domain = os.environ["SOFTWARE_CAMERA"].split()
    realsense, output = importlib.import_module("capture_realsense"), importlib.import_module("capture").ImageOutput
    device = Device(float(unit))
    stream = rs.stream.color if sees == "rgb" else rs.stream.depth
    thread = threading.Thread(target=inject, args=(device, stream, float(unit), domain), daemon=True)
    found = realsense.find(rs, [device], serial)
    realsense.follow(output(speech, name, sees, fov), rs, found, thread.start)


if __name__ == "__main__":
    importlib.import_module("speech").main({"realsense": capture}, sys.argv[1:])
