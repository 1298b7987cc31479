"""The table of `e2efly fly --check`, for controllers of several versions as they were recorded (`record_releases`)."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console
from rich.table import Table

from e2efly.commands.fly_check import add_images, add_sensing, print_settings, print_table
from e2efly.config.domain import Extent
from e2efly.flight.betaflight import messages, settings_by_name
from e2efly.flight.betaflight.allowed_modes import ANGLE
from e2efly.flight.betaflight.client import MESSAGES, Client
from e2efly.flight.betaflight.codec import ERROR, MspFrame, encode
from e2efly.flight.betaflight.controller import ControllerInfo, identify
from e2efly.flight.betaflight.messages import MotorTelemetry
from e2efly.flight.betaflight.mode_slots import ModeRange
from e2efly.flight.betaflight.settings_check import NOT_TOLD, examine
from e2efly.flight.betaflight.settings_messages import PidGains, RxFailConfig
from e2efly.flight.betaflight.sticks import RATES_PULSE, sticks_of
from e2efly.flight.pilot.delay_watch import MeasuredDelay
from e2efly.flight.pilot.estimate import StateEstimate
from e2efly.flight.pilot.lag_watch import MeasuredLag
from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.pace import Half, Pace
from e2efly.flight.row import Row, problems
from e2efly.flight.settings import FlightSettings
from e2efly.flight.sight.quality import SeenImages
from e2efly.policy.contract import Contract
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.vehicles.loading import load_vehicle
from tests.flight.test_msp_client import Wire

REPLIES: dict[str, dict[str, str]] = json.loads(
    (Path(__file__).parents[1] / "data" / "msp_releases.json").read_text(encoding="utf-8")
)
VEHICLE = load_vehicle("vis_r")
LIGHT = replace(VEHICLE, mass=VEHICLE.mass / 2)
NEWEST = list(REPLIES)[-1]


class Recorded(Wire):
    """A link to a recorded controller."""

    def __init__(self, version: str) -> None:
        super().__init__()
        self.replies = REPLIES[version]

    def send(self, data: bytes) -> None:
        self.inbox += b"".join(self.reply(frame) for frame in self.decoder.feed(data))

    def reply(self, frame: MspFrame) -> bytes:
        if frame.code != settings_by_name.CODE:
            return bytes.fromhex((REPLIES["4.6.0"] | self.replies)[str(frame.code)])  # gains: of 4.6.0 alone
        key = f"{frame.code} {messages.text(frame.payload)}"
        if key not in self.replies:
            return encode(MspFrame(frame.code, direction=ERROR, version=2))
        return bytes.fromhex(self.replies[key])


def recorded(version: str) -> ControllerInfo:
    return identify(Client(Recorded(version)))


def rows_of(info: ControllerInfo, vehicle: object = VEHICLE) -> dict[str, Row]:
    return {row.setting: row for row in examine(info, vehicle, FlightSettings())}  # type: ignore[arg-type]


@pytest.mark.parametrize("version", list(REPLIES))
def test_a_controller_that_is_set_as_the_guide_asks_may_take_off(version: str) -> None:
    info = recorded(version)
    assert info.firmware == version
    packaged = {MotorTelemetry.CODE, PidGains.CODE}  # recorded of the packaged firmware alone
    assert {int(code) for code in REPLIES[version] if code.isdigit()} >= set(MESSAGES) - packaged
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
        (ModeRange(1, 1, 900, 1700, 2),),  # on the switch of the override: off while it is high, whoever has the sticks
        (ModeRange(1, 2, 1700, 2100, 2),),  # a switch of the pilot's, who may have left it off
        (ModeRange(1, 2, 900, 2100, 2),),  # always on: the bridge could not fly
        (ModeRange(1, 2, 925, 1700, 2),),
        (ModeRange(1, 0, 925, 2100, 2),),  # the channel of ARM
    ],
)
def test_a_dead_link_must_leave_a_vehicle_that_levels_itself(modes: tuple[ModeRange, ...]) -> None:
    info = recorded(NEWEST)
    others = tuple(r for r in info.modes if r.box != ANGLE)
    row = rows_of(replace(info, modes=(*others, *modes)))["range of ANGLE"]
    assert not row.good and [line.partition("  #")[0] for line in row.mend] == ["aux 2 1 2 925 2100 0 0"]


def test_the_mask_follows_the_channel_of_angle() -> None:
    info = recorded(NEWEST)
    assert rows_of(info)["msp_override_channels_mask"].mend == ("set msp_override_channels_mask=79",)
    modes = tuple(replace(r, aux=9) if r.box == ANGLE else r for r in info.modes)
    rows = rows_of(replace(info, modes=modes))
    assert rows["msp_override_channels_mask"].mend == (f"set msp_override_channels_mask={15 + (1 << 13)}",)
    assert rows["rxfail of AUX10"].mend == ("rxfail 13 s 2000",)


@pytest.mark.parametrize("fail", [("HOLD", 1500), ("SET", 900), ("AUTO", 1500)])
def test_without_the_receiver_angle_must_be_on(fail: tuple[str, int]) -> None:
    info = recorded(NEWEST)
    channels = (*info.rx_fail.channels[:6], fail, *info.rx_fail.channels[7:])
    row = rows_of(replace(info, rx_fail=RxFailConfig(channels)))["rxfail of AUX3"]
    assert not row.good and row.mend == ("rxfail 6 s 2000",)


def test_a_throttle_stick_that_climbs_in_its_middle_is_refused_where_it_is_handed_back() -> None:
    old, new = recorded("2025.12.5"), recorded("2026.6.1")
    name = "throttle stick in its middle"
    assert rows_of(new)[name].good and rows_of(new)[name].value.endswith("of the weight: sinks")
    assert not rows_of(new, LIGHT)[name].good and rows_of(new, LIGHT)[name].value.endswith("of the weight: climbs")
    assert rows_of(old, LIGHT)[name].good
    assert rows_of(replace(new, throttle=replace(new.throttle, hover=30)), LIGHT)[name].good  # what mends it


@pytest.mark.parametrize("version", list(REPLIES))
def test_without_airmode_nothing_takes_off(version: str) -> None:
    info = recorded(version)
    assert rows_of(info)["feature AIRMODE"].value == "on"
    off = replace(info, features=info.features - {"AIRMODE"})
    assert problems(examine(off, VEHICLE, FlightSettings())) == (
        "feature AIRMODE is off; needed: on: torque goes before thrust at any throttle (feature AIRMODE)",
    )


@pytest.mark.parametrize(("low", "high", "good"), [(900, 2100, True), (1700, 2100, False), (900, 1700, False)])
def test_the_mode_air_mode_counts_where_it_is_always_on(low: int, high: int, good: bool) -> None:
    info = recorded(NEWEST)
    modes = (*info.modes, ModeRange(28, 5, low, high))
    row = rows_of(replace(info, features=info.features - {"AIRMODE"}, modes=modes))["feature AIRMODE"]
    assert row.good is good and row.value == f"off, mode AIR MODE on AUX6 {low} to {high}"


@pytest.mark.parametrize(
    ("name", "value", "good"),
    [
        ("mixer_type", "LEGACY", True), ("mixer_type", "LINEAR", True), ("mixer_type", "DYNAMIC", True),
        ("mixer_type", "EZLANDING", False), ("mixer_type", "4", False), ("msp_override_failsafe", "ON", False),
        ("max_aux_channels", "8", True), ("max_aux_channels", "7", False), ("max_aux_channels", "-1", False),
        ("serial_update_rate_hz", "100", False),
    ],
)  # fmt: skip
def test_settings_that_new_firmware_tells_by_name(name: str, value: str, good: bool) -> None:
    info = recorded("2026.6.1")
    assert dict(info.by_name) == {
        "mixer_type": "LEGACY", "msp_override_failsafe": "OFF", "max_aux_channels": "14",
        "serial_update_rate_hz": "1000",
    }  # fmt: skip
    row = rows_of(replace(info, by_name=tuple((dict(info.by_name) | {name: value}).items())))[name]
    assert (row.good, row.told, row.value) == (good, True, value)
    assert row.mend[0].startswith(f"set {name}=")


@pytest.mark.parametrize("version", ["4.5.5", "4.6.0", "2025.12.5"])
def test_settings_that_older_firmware_does_not_tell_are_the_pilots_to_look_at(version: str) -> None:
    rows = rows_of(recorded(version))
    for name in settings_by_name.NAMES:
        assert (rows[name].value, rows[name].good, rows[name].told) == (NOT_TOLD, True, False)
    assert rows["mixer_type"].mend == ("set mixer_type=LEGACY",)


def test_a_firmware_built_without_its_command_line_tells_nothing_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    bare = {code: reply for code, reply in REPLIES["2026.6.1"].items() if code.isdigit()}
    monkeypatch.setitem(REPLIES, "2026.6.1", bare)
    info = recorded("2026.6.1")
    assert info.by_name == () and not rows_of(info)["mixer_type"].told


@pytest.mark.parametrize("said", ["mixer_type", "mixer_type = ", "mixer = LEGACY", ""])
def test_a_reply_about_another_setting_is_none(said: str) -> None:
    with pytest.raises(ValueError, match="answers for mixer_type; accepted: 'mixer_type = "):
        settings_by_name.value_of("mixer_type", said.encode())


@pytest.mark.parametrize(
    ("field", "value", "row", "mend"),
    [
        ("thrust_linear", 20, "thrust_linear", "set thrust_linear=0"),
        ("vbat_sag_compensation", 100, "vbat_sag_compensation", "set vbat_sag_compensation=0"),
        ("throttle_boost", 6, "throttle_boost", "set throttle_boost=0"),
        ("motor_output_limit", 99, "motor_output_limit", "set motor_output_limit=100"),
    ],
)
def test_what_bends_the_throttle_is_refused(field: str, value: int, row: str, mend: str) -> None:
    info = recorded(NEWEST)
    changed = replace(info, pid_advanced=replace(info.pid_advanced, **{field: value}))
    found = rows_of(changed)[row]
    assert not found.good and found.mend == (mend,)
    assert len(problems(examine(changed, VEHICLE, FlightSettings()))) == 1


def test_a_rate_loop_unlike_the_vehicle_files_is_shown_with_what_to_set_and_forbids_nothing() -> None:
    info = recorded("4.6.0")
    assert rows_of(info)["P, I, D of roll"].told  # recorded with the gains of this vehicle
    light = rows_of(info, load_vehicle("crazyflie"))["P, I, D of roll"]
    assert (light.value, light.told) == ("16, 3, 5: rate_gain about 38 1/s", False)
    assert light.needed == "10, 2, 3, by the vehicle file's rate_gain 24 1/s"
    assert light.mend == ("set p_roll=10", "set i_roll=2", "set d_roll=3", "set d_max_roll=0")
    usual = rows_of(info)["anti_gravity_gain"]
    assert (usual.value, usual.told, usual.mend) == ("80", False, ("set anti_gravity_gain=0",))
    idle = rows_of(info)["idle of the motors"]
    assert (idle.value, idle.told, idle.mend) == ("5.5%", False, ("set motor_idle=848",))
    assert problems(examine(info, load_vehicle("crazyflie"), FlightSettings())) == ()


def test_the_sticks_keep_angle_off_on_its_own_channel() -> None:
    info = recorded(NEWEST)
    mid = info.rx.mid
    sticks = sticks_of(info)
    assert sticks.arrange((mid, mid, mid, 1000), ()) == (1500, 1500, 1000, 1500, 1500, 1500, RATES_PULSE, 1500)
    far = replace(sticks, angle=5).arrange((mid, mid, mid, 1000), ())
    assert far == (1500, 1500, 1000, 1500, 1500, 1500, 1500, 1500, 1500, RATES_PULSE)
    assert replace(sticks, angle=None).arrange((mid, mid, mid, 1000), ()) == (1500, 1500, 1000, *[1500] * 5)


def test_the_table_says_which_settings_the_pilot_has_to_look_at(capsys: pytest.CaptureFixture[str]) -> None:
    print_settings(Console(width=60), examine(recorded("2025.12.5"), VEHICLE, FlightSettings()))
    out = capsys.readouterr().out.splitlines()
    marks = {line.split()[1]: line.split()[0] for line in out if len(line.split()) > 1}
    assert marks["mixer_type"] == "look" and marks["thrust_linear"] == "ok"
    lines = [line for name in settings_by_name.NAMES for line in rows_of(recorded("2025.12.5"))[name].mend]
    assert out[-5:] == [*lines, "save"]


def reported(estimate: StateEstimate, contract: Contract | None, capsys: pytest.CaptureFixture[str]) -> dict[str, str]:
    """The rows on the sensing, by the first words; the rows without such words together under none."""
    table = Table(box=None, show_header=False, pad_edge=False)
    add_sensing(table, estimate, contract)
    print_table(Console(width=30), table)
    lines = [line.split("  ", 1) for line in capsys.readouterr().out.splitlines()]
    return {name.strip(): said.strip() for name, said in lines}


def test_the_report_says_how_late_velocities_and_poses_are_beside_the_training(
    capsys: pytest.CaptureFixture[str],
) -> None:
    contract = load_policy(policy_file(Path("hover"))).contract
    most = {"velocity_lag": 0.0, "body_rate_lag": 0.08, "pose_age": 0.07, "hold": 1 / 30}
    trained = replace(
        contract, observation_latency_range_s=(0.0, 0.02), latency_range_s=(0.05, 0.05),
        sensing=tuple(Extent(name, "s", 0.0, high) for name, high in most.items()),
    )  # fmt: skip
    alone = reported(StateEstimate(Checks(velocity_cutoff=15.0), 0.1), trained, capsys)
    estimated = "later than the poses, from which it is estimated; the policy is for up to"
    assert alone["velocity lag"] == f"21 ms {estimated} 25 ms" and alone["body rate lag"] == f"11 ms {estimated} 80 ms"
    assert alone["pose age"] == "not measured: not enough motion; the policy is for up to 70 ms"
    assert "states 0 to 20 ms old, and 50 ms from observation to command" in alone[""]
    watched = StateEstimate(
        Checks(), 0.1, given=(True, True), lag=(MeasuredLag(0.06, 0.002), None),
        delay=MeasuredDelay(0.1, 0.012), pace=Pace(9.0, 9.0, 9.0, present=Half(0.0, 900, 0.1, (0.08, 0.06))),
    )  # fmt: skip
    rows = reported(watched, trained, capsys)
    assert rows["velocity lag"] == "no: 60 ms (within 4 ms) later than the poses; the policy is for up to 25 ms"
    assert rows["body rate lag"] == "not measured: not enough motion; the policy is for up to 80 ms"
    assert rows["pose age"] == "no: 100 ms (within 24 ms) by the gyro; the policy is for up to 70 ms"
    assert rows["hold"] == "no: 60 ms without a new pose, twice or more; the policy is for up to 50 ms"
    old = reported(watched, replace(trained, sensing=None), capsys)
    assert old["velocity lag"] == "60 ms (within 4 ms) later than the poses"
    table = Table(box=None)
    add_sensing(table, watched, replace(trained, sensing=None))
    print_table(Console(width=30), table)
    assert "the policy's file does not state" in capsys.readouterr().out
    assert "" not in reported(watched, None, capsys)


def test_the_report_says_how_the_camera_of_the_training_was_mounted(capsys: pytest.CaptureFixture[str]) -> None:
    (camera,) = load_policy(policy_file(Path("race_clutter"))).contract.images
    source = SimpleNamespace(describe=lambda: "shm:front")
    table = Table(box=None)
    bridge: Any = SimpleNamespace(cameras=[source], seen=[SeenImages(camera)])
    add_images(table, bridge, [30.0], None)
    print_table(Console(width=30), table)
    said = capsys.readouterr().out
    assert f"trained with a camera: {camera.mount}" in said
    assert "tilted 20 degrees up" in said
