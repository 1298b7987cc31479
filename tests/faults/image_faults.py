"""What goes wrong with a camera in flight, put between it and the bridge, and what becomes of the policy's flight."""

import dataclasses
import os
import signal
import socket
import sys
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

import numpy as np

from e2efly.flight.pilot.flight_state import Mode
from e2efly.flight.sight import captured
from e2efly.flight.sight.captured import Captured
from e2efly.flight.sight.image_source import Frame, ImageSource
from e2efly.policy.images import Image
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.candidate import Candidate
from e2efly.validation.firmware_program import Firmware
from e2efly.validation.plant import RigidState
from e2efly.validation.rehearsal import REACH_IN_SIGHT, whole_course
from e2efly.validation.rig import Rig
from e2efly.validation.scenery import Scenery
from e2efly.vehicles.vehicle import Vehicle
from tests.faults.camera_process import FRAME
from tests.faults.faulty import FaultyImages, inner
from tests.waiting import until

LATE_S = 0.15
"""By how much the fault `late` holds images back, s."""


def _as(change: Callable[[Frame], Frame]) -> Callable[[Frame, Frame], Frame]:
    return lambda frame, last: change(frame)


FAULTS: dict[str, tuple[Callable[[Frame, Frame], Frame | None], str]] = {
    "late": (_as(lambda f: dataclasses.replace(f, time=f.time - LATE_S)), "before the one before"),
    "silent": (lambda f, last: None, "ms old; accepted: at most"),
    "frozen": (lambda f, last: dataclasses.replace(f, image=last.image), "equal images in a row"),
    "all holes": (_as(lambda f: dataclasses.replace(f, image=np.zeros_like(f.image))), "holes everywhere"),
    "wrong size": (_as(lambda f: dataclasses.replace(f, image=f.image[1:])), "has shape"),
    "not finite": (_as(lambda f: dataclasses.replace(f, image=f.image * np.nan)), "has the value nan"),
    "clock jumps back": (_as(lambda f: dataclasses.replace(f, time=f.time - 1.0)), "before the one before"),
    "clock jumps ahead": (_as(lambda f: dataclasses.replace(f, time=f.time + 1.0)), "ms from now"),
    "capture killed": (_as(lambda f: f), "its process has ended: killed by SIGKILL"),
    "camera unplugged": (_as(lambda f: f), "the camera is unplugged"),
}
"""What becomes of a frame, given the last good one, and a part of the reason that ends POLICY."""
OF_THE_PROCESS = ("capture killed", "camera unplugged")
"""Faults of a real capture process, through which the images go."""
UPSIDE_DOWN = "upside down"
"""The fault that is there from the start: HOVER must not hand over."""


class FaultyCamera(FaultyImages):
    """An image source whose frames go through a fault once it is told one."""

    def __init__(self, inner: ImageSource) -> None:
        super().__init__(inner)
        self.alter, self.inner = self._altered, inner
        self.fault: str | None = None
        self._last: Frame | None = None

    def _altered(self, frame: Frame) -> Frame | None:
        if self.fault is None or self._last is None:
            self._last = frame
            return frame
        if self.fault == UPSIDE_DOWN:
            return dataclasses.replace(frame, image=frame.image[::-1].copy())
        return FAULTS[self.fault][0](frame, self._last)


class ProcessCamera:
    """Images that go through a real capture process and its shared memory; virtual time waits for them."""

    def __init__(self, inner: ImageSource, camera: Image) -> None:
        self._inner, self._struck = inner, False
        self._folder = tempfile.TemporaryDirectory(prefix="e2efly-")
        path = str(Path(self._folder.name) / "camera")
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(path)
            server.listen(1)
            with mock.patch.object(captured, "SCRIPT", str(Path(__file__).with_name("camera_process.py"))):
                self._pending: list[socket.socket] = []
                self._source = _opened(server, camera, path, self._pending)
        (self._cable,) = self._pending
        self._source.read(0.0)  # the first image came before the flight

    problem, describe = inner("problem", of="_source"), inner("describe", of="_source")

    def read(self, now: float) -> list[Frame]:
        if self._struck:
            return self._source.read(now)
        found = []
        for frame in self._inner.read(now):
            _send(self._cable, frame)
            until(lambda: found.extend(come := self._source.read(now)) or come, said=lambda: self.problem)
        return found

    def strike(self, fault: str) -> None:
        """Kill the process, or pull the cable; returns when that has happened."""
        self._struck = True
        if fault == "capture killed":
            os.kill(self._source._child.process.pid, signal.SIGKILL)
        else:
            self._cable.shutdown(socket.SHUT_RDWR)
        until(
            lambda: self._source.read(0.0) is None or FAULTS[fault][1] in str(self.problem), said=lambda: self.problem
        )

    def close(self) -> None:
        self._source.close()
        self._cable.close()
        self._folder.cleanup()


def _opened(server: socket.socket, camera: Image, path: str, pending: list[socket.socket]) -> Captured:
    """The source, once the process has connected and got a first image."""

    def feed() -> None:
        server.settimeout(20.0)
        cable, _ = server.accept()
        _send(cable, Frame(-1.0, np.ones(camera.shape, np.float32)))
        pending.append(cable)

    thread = threading.Thread(target=feed)
    thread.start()
    try:
        return Captured("socket", camera, sys.executable, "socket", path, "policy")
    finally:
        thread.join()


def _send(cable: socket.socket, frame: Frame) -> None:
    cable.sendall(FRAME.pack(frame.time, *frame.image.shape) + frame.image.astype("<f4").tobytes())


@dataclass(frozen=True)
class Ended:
    mode: str
    """After the fault; policy: nothing was noticed."""
    reason: str
    """Why."""
    after_s: float
    """From the first frame that the fault changed, or should have come, to the change of mode, s."""
    noticed_s: float
    """From the control step in which the images stopped being good to the change of mode, s."""
    landed: bool
    """Whether it then landed without help."""


def fly_with(
    firmware: Firmware, found: Candidate, vehicle: Vehicle, fault: str, seed: int = 0, flies_s: float = 1.0
) -> Ended:
    """Take off, hand over to a policy that sees, break its camera after `flies_s`, and see who flies then."""
    suite = next(iter(found.task.criteria().values()))
    scenery = Scenery.draw(found.environment(suite), seed)
    course = scenery.on(whole_course(found.policy, vehicle))
    with (
        tempfile.TemporaryDirectory(prefix="e2efly-") as folder,
        Rig(firmware, Path(folder), vehicle, seed=seed) as rig,
    ):
        sources: list[ImageSource] = list(scenery.sources(lambda: RigidState.of(rig.state), course.origin))
        if fault in OF_THE_PROCESS:
            images = found.policy.contract.images
            sources = [ProcessCamera(c, image) for c, image in zip(sources, images, strict=True)]
        cameras = [FaultyCamera(c) for c in sources]
        first = course.origin.points(course.start)
        heading = (course.heading or 0.0) + course.origin.yaw
        rig.state = rig.world.at_rest(*first[:2], heading)
        rig.sleep(0.5)
        settings = rehearsal_settings(first[2] - vehicle.feet_height, REACH_IN_SIGHT)
        session = Session(rig, settings, policy=found.policy, course=course, cameras=cameras)
        try:
            return _broken(session, cameras, fault, flies_s)
        finally:
            session.close()
            for camera in cameras:
                camera.close()


def _broken(session: Session, cameras: list[FaultyCamera], fault: str, flies_s: float) -> Ended:
    rig, bridge = session.rig, session.bridge
    from_start = fault == UPSIDE_DOWN
    if from_start:
        for camera in cameras:
            camera.fault = fault
    assert session.take_off(3.0)
    rig.set(mission="policy")
    session.fly(0.5, session.in_mode(Mode.POLICY))
    broken = noticed = rig.now()
    if not from_start:
        session.fly(flies_s)
        assert bridge.flight.mode is Mode.POLICY, bridge.flight.reasons
        for camera in cameras:
            camera.fault = fault
            if isinstance(camera.inner, ProcessCamera):
                camera.inner.strike(fault)
        broken = noticed = rig.now()

    def ended() -> bool:
        nonlocal noticed
        if all(seen.problem(rig.now()) is None for seen in bridge.seen):
            noticed = rig.now()
        return bridge.flight.mode is not Mode.POLICY

    session.fly(1.0, ended)
    mode, reasons, at = bridge.flight.mode, bridge.flight.reasons, rig.now()
    rig.set(mission="hover")
    session.fly(2.0)
    return Ended(str(mode), "; ".join(map(str, reasons)), at - broken, at - noticed, session.land())
