"""What a flight may do is checked before it: each bad setting is refused by its name."""

import dataclasses
import math
import re

import pytest

from e2efly.flight.settings import Fence, FlightSettings, PilotChannels, check


def refused(settings: FlightSettings, named: str) -> None:
    with pytest.raises(ValueError, match=f"^flight.{re.escape(named)}.*; accepted: "):
        check(settings)


def test_the_defaults_can_be_flown_with() -> None:
    check(FlightSettings())


def test_what_a_user_may_well_want_is_accepted() -> None:
    check(FlightSettings(ground_height=-1.3, fence=Fence(low=(0, 0, -1), high=(8, 4, 3))))
    no_copies = PilotChannels(mission=5, roll=None, pitch=None, throttle=None, yaw=None)
    check(FlightSettings(channels=no_copies, battery_unknown=True))


@pytest.mark.parametrize(("name", "value"), [("stick_deadband", 1.0), ("takeoff_height", 5.0), ("takeoff_height", 0.1)])
def test_numbers_that_make_no_sense(name: str, value: object) -> None:
    refused(dataclasses.replace(FlightSettings(), **{name: value}), f"{name} is {value!r}")


@pytest.mark.parametrize(
    ("fence", "named"),
    [
        (Fence(high=(1, 2, math.nan)), "fence.high is"),
        (Fence(low=(3, 0, 0)), "fence.low and flight.fence.high are 3 and 3.0 in x"),
        (Fence(low=(0, 5, 0)), "fence.low and flight.fence.high are 5 and 3.0 in y"),
        (Fence(low=(0, 0, 4.2)), "fence.low and flight.fence.high are 4.2 and 4.5 in z"),
        (Fence(solids=((0, 0, 0, 1, 1, 1), (0, 0, 0, 1, -1, 1))), "fence.solids[1] is (0, 0, 0, 1, -1, 1)"),
        (Fence(solids=((0, 0, 0, 1, 1, math.inf),)), "fence.solids[0] is"),
    ],
)  # fmt: skip
def test_a_fence_that_is_none(fence: Fence, named: str) -> None:
    refused(FlightSettings(fence=fence), named)


@pytest.mark.parametrize(
    ("channels", "named"),
    [
        (PilotChannels(mission=4), "channels.mission is 4"),
        (PilotChannels(mission=None), "channels.mission is None"),  # type: ignore[arg-type]
        (PilotChannels(yaw=19), "channels.yaw is 19"),
        (PilotChannels(roll=9.0), "channels.roll is 9.0"),  # type: ignore[arg-type]
        (PilotChannels(mission=9), "channels are"),
        (PilotChannels(roll=10), "channels are"),
    ],
)
def test_channels_that_are_none(channels: PilotChannels, named: str) -> None:
    refused(FlightSettings(channels=channels), named)
