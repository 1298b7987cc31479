"""The table of `e2efly fly --check`, for controllers of several versions as they were recorded (`record_releases`)."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from e2efly.deploy.check import Row, examine, problems
from e2efly.deploy.msp.client import MESSAGES, Client
from e2efly.deploy.msp.codec import Decoder
from e2efly.deploy.msp.controller import ControllerInfo, identify
from e2efly.deploy.msp.settings import ModeRange, RxFailConfig
from e2efly.deploy.settings import FlightSettings
from e2efly.deploy.sticks import RATES_PULSE, sticks_of
from e2efly.vehicles import load_vehicle

REPLIES: dict[str, dict[str, str]] = json.loads(
    (Path(__file__).parents[1] / "data" / "msp_releases.json").read_text(encoding="utf-8")
)
VEHICLE = load_vehicle("vis_r")
LIGHT = replace(VEHICLE, mass=VEHICLE.mass / 2)
NEWEST = list(REPLIES)[-1]


class Wire:
    """A link to a recorded controller."""

    alive, reason, connections = True, "", 1

    def __init__(self, version: str) -> None:
        self.replies, self.decoder, self.pending = REPLIES[version], Decoder(), b""

    def poll(self, now: float) -> None:
        pass

    def send(self, data: bytes) -> None:
        self.pending += b"".join(bytes.fromhex(self.replies[str(f.code)]) for f in self.decoder.feed(data))

    def receive(self) -> bytes:
        data, self.pending = self.pending, b""
        return data

    def close(self) -> None:
        pass


def recorded(version: str) -> ControllerInfo:
    return identify(Client(Wire(version)))


def rows_of(info: ControllerInfo, vehicle: object = VEHICLE) -> dict[str, Row]:
    return {row.setting: row for row in examine(info, vehicle, FlightSettings())}  # type: ignore[arg-type]


@pytest.mark.parametrize("version", list(REPLIES))
def test_a_controller_that_is_set_as_the_guide_asks_may_take_off(version: str) -> None:
    info = recorded(version)
    assert info.firmware == version
    assert set(REPLIES[version]) == {str(code) for code in MESSAGES}
    assert problems(examine(info, VEHICLE, FlightSettings())) == ()
    rows = rows_of(info)
    assert rows["firmware"].value.startswith(f"BTFL {version}, MSP ")
    assert rows["range of ANGLE"].value == "AUX3 925 to 2100"
    assert rows["rxfail of AUX3"].value == "SET 2000 us"


@pytest.mark.parametrize(
    ("version", "words"),
    [
        ("4.5.5", "held for as long as override is on"),
        ("2025.12.5", "held for as long as override is on"),
        ("2026.6.1", "handed back to the receiver after 0.3 s"),
    ],
)
def test_it_says_what_becomes_of_an_override_without_msp(version: str, words: str) -> None:
    assert rows_of(recorded(version))["override without MSP"].value == words


@pytest.mark.parametrize(
    "modes",
    [
        (),
        (ModeRange(1, 1, 900, 1700),),  # on the switch of the override: off while it is high, whoever has the sticks
        (ModeRange(1, 2, 1700, 2100),),  # a switch of the pilot's, who may have left it off
        (ModeRange(1, 2, 900, 2100),),  # always on: the bridge could not fly
        (ModeRange(1, 2, 925, 1700),),
        (ModeRange(1, 0, 925, 2100),),  # the channel of ARM
    ],
)
def test_a_dead_link_must_leave_a_vehicle_that_levels_itself(modes: tuple[ModeRange, ...]) -> None:
    info = recorded(NEWEST)
    others = tuple(r for r in info.modes if r.box != 1)
    row = rows_of(replace(info, modes=(*others, *modes)))["range of ANGLE"]
    assert not row.good and row.mend == "aux 2 1 2 925 2100 0 0"


def test_the_mask_follows_the_channel_of_angle() -> None:
    info = recorded(NEWEST)
    assert rows_of(info)["msp_override_channels_mask"].mend == "set msp_override_channels_mask=79"
    modes = tuple(replace(r, aux=9) if r.box == 1 else r for r in info.modes)
    rows = rows_of(replace(info, modes=modes))
    assert rows["msp_override_channels_mask"].mend == f"set msp_override_channels_mask={15 + (1 << 13)}"
    assert rows["rxfail of AUX10"].mend == "rxfail 13 s 2000"


@pytest.mark.parametrize("fail", [("HOLD", 1500), ("SET", 900), ("AUTO", 1500)])
def test_without_the_receiver_angle_must_be_on(fail: tuple[str, int]) -> None:
    info = recorded(NEWEST)
    channels = (*info.rx_fail.channels[:6], fail, *info.rx_fail.channels[7:])
    row = rows_of(replace(info, rx_fail=RxFailConfig(channels)))["rxfail of AUX3"]
    assert not row.good and row.mend == "rxfail 6 s 2000"


def test_a_throttle_stick_that_climbs_in_its_middle_is_refused_where_it_is_handed_back() -> None:
    old, new = recorded("2025.12.5"), recorded("2026.6.1")
    name = "throttle stick in its middle"
    assert rows_of(new)[name].good and rows_of(new)[name].value.endswith("of the weight: sinks")
    assert not rows_of(new, LIGHT)[name].good and rows_of(new, LIGHT)[name].value.endswith("of the weight: climbs")
    assert rows_of(old, LIGHT)[name].good
    assert rows_of(replace(new, throttle=replace(new.throttle, hover=30)), LIGHT)[name].good  # what mends it


def test_the_sticks_keep_angle_off_on_its_own_channel() -> None:
    info = recorded(NEWEST)
    mid = info.rx.mid
    sticks = sticks_of(info)
    assert sticks.arrange((mid, mid, mid, 1000), ()) == (1500, 1500, 1000, 1500, 1500, 1500, RATES_PULSE, 1500)
    far = replace(sticks, angle=5).arrange((mid, mid, mid, 1000), ())
    assert far == (1500, 1500, 1000, 1500, 1500, 1500, 1500, 1500, 1500, RATES_PULSE)
    assert replace(sticks, angle=None).arrange((mid, mid, mid, 1000), ()) == (1500, 1500, 1000, *[1500] * 5)
