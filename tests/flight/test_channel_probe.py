"""Before arming the bridge sends its channels apart, and looks whether the controller takes each for what it is."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from e2efly.flight.betaflight.instruments import CLOSED, PROBE, PROBE_S, ChannelProbe, Instruments, Reading
from e2efly.flight.betaflight.messages import Rc, StatusEx
from e2efly.flight.betaflight.sticks import RATES_PULSE
from e2efly.flight.settings import FlightSettings
from tests.flight.test_sticks import STICKS

WITH_ANGLE = replace(STICKS, angle=2)
SENT = (*(STICKS.centre + offset for offset in PROBE), CLOSED)


def reading(channels: tuple[int, ...] | None, override: bool = True) -> Reading:
    rc = None if channels is None else Rc(channels)
    return Reading(None, False, override, None, False, None, (), rc, None, {})


def looked(channels: tuple[int, ...] | None) -> tuple[bool, tuple[str, ...]]:
    """Whether it is content, and what it says, after `PROBE_S`."""
    probe = ChannelProbe()
    assert probe.look(1.0, reading(None), WITH_ANGLE, grounded=True) == ()
    said = probe.look(1.0 + PROBE_S, reading(channels), WITH_ANGLE, grounded=True)
    return probe.seen, said


def test_sticks_and_the_channel_of_angle_must_be_taken_as_they_are_sent() -> None:
    assert looked((*SENT, 2000, 2000, RATES_PULSE, 1000)) == (True, ())
    assert looked((*SENT, 2000, 2000, RATES_PULSE + 1, 1000)) == (True, ())


def test_a_mask_without_the_channel_of_angle_is_found() -> None:
    seen, (said,) = looked((*SENT, 2000, 2000, 1500, 1000))
    assert not seen
    assert "roll, pitch, yaw, throttle and AUX3 were sent as [1520, 1540, 1560, 1000, 900] us and taken as " in said
    assert "[1520, 1540, 1560, 1000, 1500]" in said and "msp_override_channels_mask" in said


def test_channels_that_are_not_told_are_not_seen() -> None:
    for channels in (None, SENT[:3], SENT, (*SENT, 2000, 2000)):
        seen, said = looked(channels)
        assert not seen and said


def test_two_sticks_that_are_exchanged_are_found() -> None:
    roll, pitch, *rest = SENT
    seen, said = looked((pitch, roll, *rest, 2000, 2000, RATES_PULSE))
    assert not seen and said


def test_without_a_channel_of_angle_the_sticks_alone_are_looked_for() -> None:
    probe = ChannelProbe()
    assert probe.look(1.0, reading(SENT), STICKS, grounded=True) == () and probe.seen
    assert probe.look(2.0, reading(SENT, override=False), STICKS, grounded=True) == () and not probe.seen


@pytest.mark.parametrize("sends", [True, False])
def test_angle_meddles_only_while_sticks_are_sent(sends: bool) -> None:
    """`--check` sends none: ANGLE is on then, as it is to be."""
    status = StatusEx(1e-3, 0b111, 0.0, 0, ())
    link = SimpleNamespace(alive=True, reason="")
    client: Any = SimpleNamespace(
        latest={}, latency=0.0, link=link, message=lambda code, now, age: status if code == StatusEx.CODE else None
    )
    info: Any = SimpleNamespace(box_ids=(0, 1, 50), api=(1, 46), rate_profile=0)
    instruments = Instruments(client, FlightSettings())
    said = instruments.read(1.0, info, land=False, sends=sends).meddling
    assert said == ("ANGLE (mode 1) is on; accepted: off while the bridge flies",) * sends
