"""Policies that see, flown whole through the real firmware, with and without a camera that breaks."""

from pathlib import Path

import numpy as np
import pytest

from e2efly.flight.sight.image_source import Frame, ImageSource
from e2efly.flight.sight.shared import SharedCamera, SharedImages, place
from e2efly.logs.flight_log import read_log
from e2efly.logs.telemetry import Telemetry
from e2efly.policy.images import Image
from e2efly.validation import firmware_program
from e2efly.validation.candidate import candidate
from e2efly.validation.rehearsal import rehearse
from e2efly.validation.scenery import Scenery
from e2efly.vehicles.loading import load_vehicle
from tests.faults.image_faults import FAULTS, UPSIDE_DOWN, fly_with

VEHICLE = load_vehicle("vis_r")
NAME = "e2efly_test_landing"


class Published:
    """A camera whose images go through shared memory, as those of another process do."""

    def __init__(self, inner: ImageSource, camera: Image) -> None:
        self.inner, self.images = inner, SharedImages(NAME, camera.shape)
        self.read_back, self.problem = SharedCamera(NAME, camera), None

    def read(self, now: float) -> list[Frame]:
        for frame in self.inner.read(now):
            self.images.publish(frame.time, frame.image.astype(np.float32))
        return self.read_back.read(now)

    def close(self) -> None:
        self.read_back.close()

    def describe(self) -> str:
        return self.read_back.describe()


@pytest.mark.whole
def test_a_policy_lands_on_a_pad_that_it_only_sees(tmp_path: Path) -> None:
    found, path = candidate("land_visual"), tmp_path / "flight.mcap"
    camera = found.policy.contract.images[0]
    scenery = Scenery.draw(found.environment(found.task.criteria()["land_visual"]), 5)
    try:
        with Telemetry(path) as log:
            flight = rehearse(
                firmware_program.chosen(), found.policy, VEHICLE, seed=5, scenery=scenery, log=log,
                wrap=lambda inner: Published(inner, camera),
            )  # fmt: skip
    finally:
        place(NAME).unlink(missing_ok=True)
    assert flight.complete
    assert flight.success, flight.told
    assert flight.final_error < 0.2
    ages = [row["image_age"][0] for row in read_log(path)["policy"].values]
    assert min(ages) >= camera.latency_range_s[0]
    assert max(ages) <= camera.latency_range_s[1] + 1 / camera.rate_hz + 0.011  # and a round of the bridge


@pytest.mark.whole
@pytest.mark.parametrize("fault", ["silent", "all holes", "capture killed"])
def test_a_camera_that_breaks_in_flight_ends_in_hover_within_a_control_step(fault: str) -> None:
    ended = fly_with(firmware_program.chosen(), candidate("avoid"), VEHICLE, fault)
    assert ended.mode == "hover"
    assert FAULTS[fault][1] in ended.reason
    assert ended.noticed_s <= 1 / 30 + 1e-6
    assert ended.landed


@pytest.mark.whole
def test_a_camera_that_hangs_upside_down_is_never_flown_by() -> None:
    ended = fly_with(firmware_program.chosen(), candidate("avoid"), VEHICLE, UPSIDE_DOWN)
    assert ended.mode == "hover"
    assert "upside down?" in ended.reason
    assert ended.landed
