"""The flight controller's settings that matter to a flight: their values, what is needed, and how to correct them."""

from dataclasses import replace
from math import degrees

from e2efly.flight.betaflight.controller import ControllerInfo
from e2efly.flight.betaflight.firmware_gains import axis_lines, gains_of, rate_gain_of
from e2efly.flight.betaflight.rates import AXES
from e2efly.flight.betaflight.sticks import CHANNELS
from e2efly.flight.betaflight.switches import switch_rows, where
from e2efly.flight.betaflight.throttle_curve import ThrottleCurve
from e2efly.flight.betaflight.versions import RELEASES
from e2efly.flight.pilot.throttle_map import ThrottleMap
from e2efly.flight.row import Row
from e2efly.flight.settings import FlightSettings
from e2efly.policy.contract import Contract
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

QUADX = 3
"""Betaflight's number of the mixer of a quadrotor in X."""
LARGEST_DEADBAND = 10
"""The largest deadband that does no harm, us. Commands jump over it."""
LARGEST_BOOST = 5
"""The largest throttle boost that was flown in rehearsals with the firmware. It is the firmware's default."""
ATTITUDE_FIRST = ("LEGACY", "LINEAR", "DYNAMIC")
"""Mixer types that give up collective thrust before torque. EZLANDING gives up torque while the throttle is low."""
SPEED_HZ = 50.0
"""How often the rotor speeds are requested, Hz."""
AIR_MODE = 28
"""Permanent id of the mode AIR MODE."""
SINKING = 0.97
"""The share of the weight that a throttle stick in its middle is set to hold, where it would hold more than all."""
ALIKE = 1.25
"""A rate loop is as the vehicle file says if its gain is within this factor of the file's."""
IDLE = 0.02
"""The difference between the idle of the motors and the vehicle file's that the throttle map makes up for."""
NOT_TOLD = "not told by this firmware"
"""The value that is shown for a setting that cannot be read."""


def examine(
    info: ControllerInfo, vehicle: Vehicle, settings: FlightSettings, contract: Contract | None = None
) -> tuple[Row, ...]:
    """The table of `e2efly fly --check`. The settings of the flight name the pilot's channels. The largest body rates
    that are needed are those of the contract, if its policy commands body rates, and otherwise the vehicle's.
    """
    api = ".".join(map(str, info.api))
    known = f"BTFL, {RELEASES[0].name} to {RELEASES[-1].name}"
    rows = [
        Row("firmware", f"{info.variant} {info.firmware}, MSP {api}, built {info.built.strip()}", known, True),
        Row("craft_name", info.craft or "(none)", "any", True),
        Row("map", info.rx_map.letters, "any: it is read", True),
        *_rates(info, vehicle, contract),
        *_throttle(info),
        *_mixing(info),
        *_rate_loop(info, vehicle),
        *switch_rows(info, settings),
        *_hand_back(info, vehicle),
        *_by_name(info, settings),
    ]
    for axis, band in (("deadband", info.deadband.deadband), ("yaw_deadband", info.deadband.yaw_deadband)):
        small = band <= LARGEST_DEADBAND
        rows.append(Row(axis, f"{band} us", f"at most {LARGEST_DEADBAND} us", small, (f"set {axis}=0",)))
    quad = info.mixer.mixer == QUADX
    rows.append(Row("mixer", "QUADX" if quad else f"number {info.mixer.mixer}", "QUADX", quad, ("mixer QUADX",)))
    rows.append(Row("feature 3D", _on("3D" in info.features), "off", "3D" not in info.features, ("feature -3D",)))
    rows.append(
        Row("rc_smoothing", _on(info.rx.smoothing), "off: it delays the policy", not info.rx.smoothing,
            ("set rc_smoothing=OFF",))
    )  # fmt: skip
    closed = info.failsafe.throttle <= info.rx.min_check
    mend = ("set failsafe_procedure=" + ("DROP" if closed else "AUTO-LAND"),)
    rows.append(
        Row("failsafe_procedure", info.failsafe.procedure, "DROP or AUTO-LAND", info.failsafe.procedure != "GPS-RESCUE",
            mend)
    )  # fmt: skip
    rows.append(
        Row("failsafe_throttle", f"{info.failsafe.throttle} us", "with AUTO-LAND: a little under hovering, or it "
            "falls: set your own, or DROP", not closed or info.failsafe.procedure != "AUTO-LAND", mend)
    )  # fmt: skip
    turned = [round(degrees(angle)) for angle in info.alignment.angles]
    rows.append(Row("align_board", f"{turned} deg", "any: attitudes are compared before take-off", True))
    return tuple(rows)


def _rates(info: ControllerInfo, vehicle: Vehicle, contract: Contract | None) -> list[Row]:
    wanted = [float(rate) for rate in vehicle.body_rate_max]
    if contract is not None and contract.action.mode == "ctbr":
        wanted = [max(abs(a), abs(b)) for a, b in zip(contract.action.low[1:], contract.action.high[1:], strict=True)]
    rows = [Row("rates_type", info.rates.rates_type, "any: its curve is inverted", True)]
    tens = {axis: -(-degrees(need) // 10) for axis, need in zip(AXES, wanted, strict=True)}
    for axis, have, need in zip(AXES, info.rates.max_rate, wanted, strict=True):
        lines = [  # with another type, the numbers of all axes get another meaning
            f"set {name}_{part}={value:.0f}"
            for name in (AXES if info.rates.rates_type != "ACTUAL" else (axis,))
            for part, value in (("rc_rate", tens[name]), ("srate", tens[name]), ("expo", 0))
        ]
        rows.append(
            Row(f"{axis} rate at full stick", f"{degrees(have):.0f} deg/s", f"at least {degrees(need):.0f} deg/s",
                have >= need * (1 - 1e-6), ("set rates_type=ACTUAL", *lines))
        )  # fmt: skip
    return rows


def _throttle(info: ControllerInfo) -> list[Row]:
    largest = info.throttle.largest
    return [
        Row("throttle_limit_type", f"largest throttle {largest:.0%}", "100 %: no limit", largest > 0.999,
            ("set throttle_limit_type=OFF",)),
        Row("min_check", f"{info.rx.min_check} us", "1010 to 1100 us: the throttle begins there",
            1010 <= info.rx.min_check <= 1100, ("set min_check=1050",)),
    ]  # fmt: skip


def _mixing(info: ControllerInfo) -> list[Row]:
    """The settings of the mixing from throttle and torques to the motors.

    Policies have learned to fly with a mixing that gives up thrust before torque. Without AIRMODE, the firmware scales
    all torques down while the throttle is below half (4.3: it clips each rotor).
    """
    air = "AIRMODE" in info.features
    modes = info.slots(AIR_MODE)
    value = "on" if air else f"off, mode AIR MODE on {where(*modes)}" if modes else "off"
    always = any(slot.covers(*CHANNELS) for slot in modes)
    pid = info.pid_advanced
    limit = pid.motor_output_limit
    rows = [
        Row("feature AIRMODE", value, "on: torque goes before thrust at any throttle", air or always,
            ("feature AIRMODE",)),
        Row("motor_output_limit", f"{limit} %", "100 %: no limit", limit == 100,
            ("set motor_output_limit=100",)),
        Row("throttle_boost", str(pid.throttle_boost), f"at most {LARGEST_BOOST}: it overdoes what the policy commands",
            pid.throttle_boost <= LARGEST_BOOST, ("set throttle_boost=0",)),
    ]  # fmt: skip
    for name, have in (("thrust_linear", pid.thrust_linear), ("vbat_sag_compensation", pid.vbat_sag_compensation)):
        needed = "0: the bridge learns the throttle map itself"
        rows.append(Row(name, str(have), needed, have == 0, (f"set {name}=0",)))
    return rows


def _rate_loop(info: ControllerInfo, vehicle: Vehicle) -> list[Row]:
    """The rate loop beside the vehicle file's. The file may be wrong about a real vehicle, so none of it forbids a
    flight.
    """
    file, have = gains_of(vehicle), rate_gain_of(vehicle, info.gains.pid)
    rows = [
        Row(f"P, I, D of {name}", f"{_joined(pid)}: rate_gain about {gain:.0f} 1/s",
            f"{_joined(own)}, by the vehicle file's rate_gain {need:g} 1/s", True,
            axis_lines(name, own, info.release), told=need / ALIKE < gain < need * ALIKE)
        for name, pid, own, gain, need in zip(
            AXES, info.gains.pid, file.pid, have, map(float, vehicle.rate_gain), strict=True
        )
    ]  # fmt: skip
    swell, idle = info.pid_advanced.anti_gravity_gain, info.motors.motor_idle
    return [
        *rows,
        Row("anti_gravity_gain", str(swell), "0: gains grow while a policy moves the throttle", True,
            ("set anti_gravity_gain=0",), told=swell == 0),
        Row("idle of the motors", f"{idle:.1%}", f"{file.idle:.1%}, by the vehicle file's rotor_speed_min", True,
            info.release.idle_lines(file.idle), told=abs(idle - file.idle) <= IDLE),
    ]  # fmt: skip


def _joined(pid: tuple[int, int, int]) -> str:
    return ", ".join(map(str, pid))


def _by_name(info: ControllerInfo, settings: FlightSettings) -> list[Row]:
    """Settings that firmware before 2026.6 does not report over MSP. With such firmware, the pilot must check them."""
    c = settings.channels
    used = max(n for n in (c.mission, c.roll, c.pitch, c.throttle, c.yaw) if n is not None)
    asked = (
        ("mixer_type", "LEGACY, LINEAR or DYNAMIC: torque goes before thrust", lambda v: v in ATTITUDE_FIRST, "LEGACY"),
        ("msp_override_failsafe", "OFF, or not there: MSP must not hide a lost receiver", lambda v: v == "OFF", "OFF"),
        ("max_aux_channels", f"at least {used - 4}: channels to {used} are read", lambda v: _least(v, used - 4), "14"),
        ("serial_update_rate_hz", "at least 1000: or sticks queue up", lambda v: _least(v, 1000), "1000"),
    )  # fmt: skip
    rows = []
    for name, needed, good, mend in asked:
        value, line = info.named(name), (f"set {name}={mend}",)
        if value is None:
            rows.append(Row(name, NOT_TOLD, needed, True, line, told=False))
        else:
            rows.append(Row(name, value, needed, good(value), line))
    return rows


def _hand_back(info: ControllerInfo, vehicle: Vehicle) -> list[Row]:
    """What acts after the link has failed: the receiver's sticks in a level flight, with the throttle stick in its
    middle.
    """
    share, mend = _held(info.throttle, info, vehicle), tuple[str, ...]()
    verb = "climbs" if share > 1 else "sinks"
    taken = info.release.override_timeout is not None
    if bad := taken and share > 1:
        curves = ((h, replace(info.throttle, hover=h)) for h in range(100, -1, -1))
        mend = (f"set thr_hover={next(h for h, curve in curves if _held(curve, info, vehicle) <= SINKING)}",)
    weigh = "at most 1, where it is handed back by itself: weigh the vehicle with its battery"
    return [
        Row("override without MSP", info.release.hand_back, "any: docs/hardware.md says what follows", True),
        Row("throttle stick in its middle", f"{share:.2f} of the weight: {verb}",
            weigh if taken else "any: only the pilot's switch hands it back", not bad, mend),
    ]  # fmt: skip


def _held(curve: ThrottleCurve, info: ControllerInfo, vehicle: Vehicle) -> float:
    """The share of the weight that a throttle stick in its middle holds."""
    return ThrottleMap.of(vehicle).nominal(curve.throttle_of(info.rx.mid)) / GRAVITY


def _least(value: str, least: int) -> bool:
    return value.isdigit() and int(value) >= least


def _on(flag: bool) -> str:
    return "on" if flag else "off"
