"""What the numbers in MSP messages mean: mode boxes, features, arming-disable flags. See `versions`."""

BOXES = {
    0: "ARM", 1: "ANGLE", 2: "HORIZON", 3: "ALTHOLD", 4: "ANTI GRAVITY", 5: "MAG", 6: "HEADFREE", 7: "HEADADJ",
    8: "CAMSTAB", 11: "POS HOLD", 12: "PASSTHRU", 13: "BEEPER", 15: "LEDLOW", 17: "CALIB", 19: "OSD DISABLE",
    20: "TELEMETRY", 23: "SERVO1", 24: "SERVO2", 25: "SERVO3", 26: "BLACKBOX", 27: "FAILSAFE", 28: "AIR MODE",
    29: "3D DISABLE", 30: "FPV ANGLE MIX", 31: "BLACKBOX ERASE", 32: "CAMERA CONTROL 1", 33: "CAMERA CONTROL 2",
    34: "CAMERA CONTROL 3", 35: "FLIP OVER AFTER CRASH", 36: "PREARM", 37: "GPS BEEP SATELLITE COUNT",
    39: "VTX PIT MODE", 40: "USER1", 41: "USER2", 42: "USER3", 43: "USER4", 44: "PID AUDIO", 45: "PARALYZE",
    46: "GPS RESCUE", 47: "ACRO TRAINER", 48: "VTX CONTROL DISABLE", 49: "LAUNCH CONTROL", 50: "MSP OVERRIDE",
    51: "STICK COMMANDS DISABLE", 52: "BEEPER MUTE", 53: "READY", 54: "LAP TIMER RESET", 55: "CHIRP",
    56: "AUTOPILOT", 57: "WP CAPTURE",
}  # fmt: skip
"""Names of the modes by permanent id."""
FEATURES = {
    0: "RX_PPM", 1: "RX_UDP", 2: "INFLIGHT_ACC_CAL", 3: "RX_SERIAL", 4: "MOTOR_STOP", 5: "SERVO_TILT", 6: "SOFTSERIAL",
    7: "GPS", 8: "OPTICALFLOW", 9: "RANGEFINDER", 10: "TELEMETRY", 12: "3D", 13: "RX_PARALLEL_PWM", 14: "RX_MSP",
    15: "RSSI_ADC", 16: "LED_STRIP", 17: "DISPLAY", 18: "OSD", 20: "CHANNEL_FORWARDING", 21: "TRANSPONDER",
    22: "AIRMODE", 25: "RX_SPI", 27: "ESC_SENSOR", 28: "ANTI_GRAVITY", 29: "DYNAMIC_FILTER",
}  # fmt: skip
"""Names of the features by bit."""
ARMING_DISABLED = (
    "NOGYRO", "FAILSAFE", "RXLOSS", "NOT_DISARMED", "BOXFAILSAFE", "RUNAWAY", "CRASH", "THROTTLE", "ANGLE", "BOOTGRACE",
    "NOPREARM", "LOAD", "CALIB", "CLI", "CMS", "BST", "MSP", "PARALYZE", "GPS", "RESCUE_SW", "DSHOT_TELEM",
    "REBOOT_REQD", "DSHOT_BBANG", "NO_ACC_CAL", "MOTOR_PROTO", "FLIP_SWITCH", "ALT_HOLD_SW", "POS_HOLD_SW",
    "AUTOPILOT_SW",
)  # fmt: skip
"""Reasons against arming by bit, as the controller's `status` prints them. The last bit is always ARM_SWITCH. Its
number is 25 up to MSP 1.46, 28 in 1.47 and 29 since 1.48."""
FAILSAFE_PROCEDURES = ("AUTO-LAND", "DROP", "GPS-RESCUE")
"""What the failsafe does, by number."""
RXFAIL_MODES = ("AUTO", "HOLD", "SET")
"""What a channel becomes without the receiver, by number. AUTO: centred, or closed for the throttle. HOLD: its last
value. SET: a fixed pulse."""
FAILSAFE_SWITCHES = ("STAGE1", "KILL", "STAGE2")
"""What the failsafe switch does, by number."""


def bits(value: int, names: "dict[int, str] | tuple[str, ...]") -> frozenset[str]:
    """The names of the bits that are set. A bit without a name becomes BIT and its number."""
    known = names if isinstance(names, dict) else dict(enumerate(names))
    return frozenset(known.get(i, f"BIT{i}") for i in range(value.bit_length()) if value >> i & 1)


def named(value: int, names: tuple[str, ...]) -> str:
    """The name of a number. If it has none, the number as text."""
    return names[value] if value < len(names) else str(value)


def arming_disabled(flags: int, count: int) -> tuple[str, ...]:
    """The active reasons against arming, the most serious first, of a controller that knows `count` reasons."""
    known = ARMING_DISABLED[: count - 1]
    known = (*known, *(f"BIT{i}" for i in range(len(known), count - 1)), "ARM_SWITCH")
    return tuple(name for i, name in enumerate(known) if flags >> i & 1)
