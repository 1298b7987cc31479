"""The modes of a flight controller that may be on while the bridge flies. All others are refused.

Every fact was read in Betaflight's sources at the tags that `versions` names: the numbers in `src/main/msp/msp_box.c`,
what each mode does where `IS_RC_MODE_ACTIVE` and `FLIGHT_MODE` ask for it.
"""

from collections.abc import Set

from e2efly.flight.betaflight.msp_names import BOXES

ARM, ANGLE, FAILSAFE, OVERRIDE = 0, 1, 27, 50
"""Permanent ids of Betaflight's modes."""
HARMLESS = {
    **dict.fromkeys((
        4,  # ANTI GRAVITY: gains of the rate loop while the throttle moves; on by default, as a feature
        8,  # CAMSTAB: servos of a camera
        13, 37, 52,  # BEEPER, GPS BEEP SATELLITE COUNT, BEEPER MUTE: motors beep only while disarmed
        15,  # LEDLOW
        19,  # OSD DISABLE
        26,  # BLACKBOX
        28,  # AIR MODE
        32, 33, 34,  # CAMERA CONTROL
        36,  # PREARM
        39, 48,  # VTX PIT MODE, VTX CONTROL DISABLE
        40, 41, 42, 43,  # USER: pins of the board
        44,  # PID AUDIO
        51,  # STICK COMMANDS DISABLE
    ), (1, 44)),
    53: (1, 45),  # READY: a text of the OSD
    54: (1, 46),  # LAP TIMER RESET
}  # fmt: skip
"""The modes that change neither the motors nor what the sticks mean, by permanent id, and the first MSP version in
which the number means this mode. TELEMETRY is not among them: it can take a serial port away from MSP."""


def named_mode(box: int) -> str:
    """A mode's name, if it has one, and its permanent id."""
    return f"{BOXES[box]} (mode {box})" if box in BOXES else f"mode {box}"


def harmless(box: int, api: tuple[int, int]) -> bool:
    """Whether a mode is known to be harmless, in firmware of this MSP version."""
    return box in HARMLESS and api >= HARMLESS[box]


def foreign(active: Set[int], api: tuple[int, int]) -> frozenset[int]:
    """Those of the active modes that must not be on while the bridge flies. ARM and OVERRIDE must be on."""
    return frozenset(box for box in active - {ARM, OVERRIDE} if not harmless(box, api))
