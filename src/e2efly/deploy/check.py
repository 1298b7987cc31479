"""What of a flight controller's settings matters to a flight: what it is, what is needed, and what mends it."""

from dataclasses import dataclass
from math import degrees

from e2efly.deploy.contract import Contract
from e2efly.deploy.msp.controller import ControllerInfo
from e2efly.deploy.msp.names import BOXES
from e2efly.deploy.msp.settings import ModeRange
from e2efly.deploy.msp.versions import RELEASES
from e2efly.deploy.settings import FlightSettings
from e2efly.deploy.sticks import RATES_PULSE, angle_range
from e2efly.deploy.throttle_map import ThrottleMap
from e2efly.vehicles.vehicle import GRAVITY, Vehicle

QUADX = 3
"""Betaflight's number of the mixer of a quadrotor in X."""
ANGLE_AUX = 2
"""AUX channel, from 0, that the guide gives to ANGLE."""
LARGEST_DEADBAND = 10
"""Deadband that is still jumped over without harm, us."""


@dataclass(frozen=True)
class Row:
    """One setting."""

    setting: str
    """Its name in the controller's command line, or in words."""
    value: str
    """What it is."""
    needed: str
    """What the flight needs."""
    good: bool
    """Whether that is so."""
    mend: str = ""
    """Lines of the controller's command line that mend it."""

    @property
    def problem(self) -> str:
        """What is wrong, in words."""
        return f"{self.setting} is {self.value}; needed: {self.needed}" + (f" ({self.mend})" if self.mend else "")


def examine(
    info: ControllerInfo, vehicle: Vehicle, settings: FlightSettings, contract: Contract | None = None
) -> tuple[Row, ...]:
    """The table of `e2efly fly --check`.

    Args:
        info: as read from the controller.
        vehicle: whose body rates are commanded.
        settings: with the pilot's channels.
        contract: of the policy; its body rates count where it commands them.
    """
    api = ".".join(map(str, info.api))
    known = f"BTFL, {RELEASES[0].name} to {RELEASES[-1].name}"
    rows = [
        Row("firmware", f"{info.variant} {info.firmware}, MSP {api}, built {info.built.strip()}", known, True),
        Row("craft_name", info.craft or "(none)", "any", True),
        Row("map", info.rx_map.letters, "any: it is read", True),
        *_rates(info, vehicle, contract),
        *_throttle(info),
        *_modes(info),
        *_hand_back(info, vehicle),
        *_channels(info, settings),
    ]
    for axis, band in (("deadband", info.deadband.deadband), ("yaw_deadband", info.deadband.yaw_deadband)):
        small = band <= LARGEST_DEADBAND
        rows.append(Row(axis, f"{band} us", f"at most {LARGEST_DEADBAND} us", small, f"set {axis}=0"))
    quad = info.mixer.mixer == QUADX
    rows.append(Row("mixer", "QUADX" if quad else f"number {info.mixer.mixer}", "QUADX", quad, "mixer QUADX"))
    rows.append(Row("feature 3D", _on("3D" in info.features), "off", "3D" not in info.features, "feature -3D"))
    rows.append(
        Row("rc_smoothing", _on(info.rx.smoothing), "off: it delays the policy", not info.rx.smoothing,
            "set rc_smoothing=OFF")
    )  # fmt: skip
    rows.append(
        Row("failsafe_procedure", info.failsafe.procedure, "DROP or AUTO-LAND", info.failsafe.procedure != "GPS-RESCUE",
            "set failsafe_procedure=AUTO-LAND")
    )  # fmt: skip
    falls = info.failsafe.procedure == "AUTO-LAND" and info.failsafe.throttle <= info.rx.min_check
    rows.append(
        Row("failsafe_throttle", f"{info.failsafe.throttle} us", "with AUTO-LAND: a little under hovering, or it falls",
            not falls, "set failsafe_throttle=... or set failsafe_procedure=DROP")
    )  # fmt: skip
    turned = [round(degrees(angle)) for angle in info.alignment.angles]
    rows.append(Row("align_board", f"{turned} deg", "any: attitudes are compared before take-off", True))
    return tuple(rows)


def problems(rows: tuple[Row, ...]) -> tuple[str, ...]:
    """What forbids a take-off."""
    return tuple(row.problem for row in rows if not row.good)


def _rates(info: ControllerInfo, vehicle: Vehicle, contract: Contract | None) -> list[Row]:
    wanted = [float(rate) for rate in vehicle.body_rate_max]
    if contract is not None and contract.action.mode == "ctbr":
        wanted = [max(abs(a), abs(b)) for a, b in zip(contract.action.low[1:], contract.action.high[1:], strict=True)]
    rows = [Row("rates_type", info.rates.rates_type, "any: its curve is inverted", True)]
    for axis, have, need in zip(("roll", "pitch", "yaw"), info.rates.max_rate, wanted, strict=True):
        enough = have >= need * (1 - 1e-6)
        tens = -(-degrees(need) // 10)
        mend = f"set rates_type=ACTUAL, set {axis}_rc_rate={tens:.0f}, set {axis}_srate={tens:.0f}, set {axis}_expo=0"
        rows.append(
            Row(f"{axis} rate at full stick", f"{degrees(have):.0f} deg/s", f"at least {degrees(need):.0f} deg/s",
                enough, mend)
        )  # fmt: skip
    return rows


def _throttle(info: ControllerInfo) -> list[Row]:
    largest = info.throttle.largest
    return [
        Row("throttle_limit_type", f"largest throttle {largest:.0%}", "100 %: no limit", largest > 0.999,
            "set throttle_limit_type=OFF"),
        Row("min_check", f"{info.rx.min_check} us", "1010 to 1100 us: the throttle begins there",
            1010 <= info.rx.min_check <= 1100, "set min_check=1050"),
    ]  # fmt: skip


def _modes(info: ControllerInfo) -> list[Row]:
    rows = []
    for mode, hint in (("ARM", "aux 0 0 0 1700 2100 0 0"), ("MSP OVERRIDE", "aux 1 50 1 1700 2100 0 0")):
        ranges = info.ranges(mode)
        switched = bool(ranges) and all(r.low > 1000 or r.high < 2000 for r in ranges)
        needed = "a switch of the pilot's, not always on"
        rows.append(Row(f"switch of {mode}", _where(ranges), needed, switched, hint))
    angle = angle_range(info)
    place = ANGLE_AUX if angle is None else angle.aux
    channel = info.rx_map.channel[4 + place] if 4 + place < len(info.rx_map.channel) else 4 + place
    needed = f"925 to 2100 on a channel of its own: on, but for the {RATES_PULSE} us that the bridge sends there"
    rows.append(
        Row("range of ANGLE", _where(info.ranges("ANGLE")), needed, angle is not None,
            f"aux 2 1 {ANGLE_AUX} 925 2100 0 0")
    )  # fmt: skip
    known = next(number for number, name in BOXES.items() if name == "MSP OVERRIDE") in info.box_ids
    mask = 15 | 1 << channel
    rows.append(
        Row("msp_override_channels_mask", "set" if known else "0", f"{mask}: the sticks and AUX{place + 1} of ANGLE "
            "(tried before arming)", known, f"set msp_override_channels_mask={mask}")
    )  # fmt: skip
    fail = info.rx_fail.channels[4 + place : 5 + place]
    levels = not fail or (fail[0][0] == "SET" and angle is not None and angle.low <= fail[0][1] < angle.high)
    value = f"{fail[0][0]} {fail[0][1]} us" if fail else "not told"
    rows.append(
        Row(f"rxfail of AUX{place + 1}", value, "SET within ANGLE's range: level without the receiver", levels,
            f"rxfail {4 + place} s 2000")
    )  # fmt: skip
    return rows


def _where(ranges: tuple[ModeRange, ...]) -> str:
    return ", ".join(f"AUX{r.aux + 1} {r.low} to {r.high}" for r in ranges) or "none"


def _hand_back(info: ControllerInfo, vehicle: Vehicle) -> list[Row]:
    """What a dead link leaves: the receiver's sticks, level, and a throttle stick that rests in the middle."""
    middle = info.throttle.throttle_of(info.rx.mid)
    share = ThrottleMap.of(vehicle).nominal(middle) / GRAVITY
    verb = "climbs" if share > 1 else "sinks"
    taken = info.release.override_timeout is not None
    mend = "set thr_hover=... (thr_mid before 2025.12) to just under hovering, or weigh the vehicle with its battery"
    return [
        Row("override without MSP", info.release.hand_back, "any: docs/hardware.md says what follows", True),
        Row("throttle stick in its middle", f"{share:.2f} of the weight: {verb}",
            "at most 1, where it is handed back by itself" if taken else "any: only the pilot's switch hands it back",
            share <= 1 or not taken, mend),
    ]  # fmt: skip


def _channels(info: ControllerInfo, settings: FlightSettings) -> list[Row]:
    """The channels that the bridge reads must not be those of the controller's own switches."""
    taken = {r.aux + 5: BOXES.get(r.box, str(r.box)) for r in info.modes}
    c = settings.channels
    used = {"mission": c.mission, "roll": c.roll, "pitch": c.pitch, "throttle": c.throttle, "yaw": c.yaw}
    return [
        Row(f"channel {channel} ({name})", taken.get(channel, "free"), "free of the controller's own modes",
            channel not in taken, f"fly --flight.channels.{name} to another than {sorted(taken)}")
        for name, channel in used.items() if channel is not None
    ]  # fmt: skip


def _on(flag: bool) -> str:
    return "on" if flag else "off"
