"""The known versions of Betaflight, and all their differences that matter to a flight.

Every fact was read in Betaflight's sources at the tags 4.3.2, 4.4.3, 4.5.5, 2025.12.5, 2026.6.0-rc1 to rc3, 2026.6.1
and in its master of August 2026 (2026.12.0-alpha). The SITLs that are named here were flown. The facts are in these
files:

| fact | file |
| --- | --- |
| MSP version, firmware version | `src/main/msp/msp_protocol.h`, `src/main/build/version.h`, MSP_FC_VERSION in `src/main/msp/msp.c` |
| age of an override | `src/main/rx/msp.c`, `src/main/rx/msp_override.c`: since commit 61e7750523 of 27 June 2026 |
| names of settings | `src/main/cli/settings.c` |
| settings by name over MSP | MSP2_CLI_SETTING in `src/main/msp/msp.c`: since commit eb8c314da3 of 4 April 2026 |
| what the mixer gives up | `applyMixerAdjustment` and similar functions in `src/main/flight/mixer.c`; the same since 4.4 |
| modes by number, and what each does | see `modes` |
| how the slots of `aux` act together | `updateActivatedModes` in `src/main/fc/rc_modes.c` |
| packets of the SITL | `src/platform/SIMULATOR/sitl.c` (`src/main/target/SITL` up to 4.5): since commit 26524e20db of April 2026 |

The first bytes of each message in `messages` and `settings`, as far as they are read here, are the same in all
versions. Later versions append to STATUS_EX (1.46, 1.47, 1.48), BUILD_INFO (1.46), RX_CONFIG (1.45, 1.47), RC_TUNING
(1.47: the hover throttle) and FC_VERSION (1.47: the version as text). Since 1.47, MOTOR_CONFIG has no `min_throttle`.
BATTERY_STATE, PID_ADVANCED, MODE_RANGES, MODE_RANGES_EXTRA, BOXIDS, FAILSAFE_CONFIG, RXFAIL_CONFIG,
MOTOR_TELEMETRY (RPM and ESC) and SET_RAW_RC keep their layouts, and MSP OVERRIDE its permanent id, 50. New modes,
features and reasons against arming get new numbers, all in `names`.
"""  # noqa: E501

from dataclasses import dataclass

CENTURY = 20
"""If the first byte of FC_VERSION is at least this, it counts the years since 2000, and the version is a year and a
month."""


@dataclass(frozen=True)
class SitlLayout:
    """How the SITL, the firmware that is built for a computer, exchanges packets with a simulator."""

    motors: tuple[int, int, int, int]
    """The positions of motors 1 to 4 in the packet of motor outputs."""
    yaw_sign: int
    """Sign of the yaw rate about body z, FLU, in the packet of the vehicle's state."""
    hears_silence: bool
    """Whether a receiver whose packets stop counts as lost, as on a real controller."""
    settings: tuple[str, ...] = ()
    """Further lines for the command line that a flight on the rig needs."""


@dataclass(frozen=True)
class Release:
    """One release of Betaflight, with all its patch levels."""

    name: str
    """The name that its makers use."""
    api: tuple[int, int]
    """MSP version."""
    series: tuple[int, int]
    """The first two bytes of FC_VERSION."""
    override_timeout: float | None
    """The age from which the sticks of MSP override are not used any more, and those of the receiver are used, s. None:
    they are held as long as the pilot's override switch is on."""
    landing_time: tuple[str, int]
    """The setting for the time after which the failsafe stops the motors: its name, and the number of its units per
    second."""
    sitl: SitlLayout | None = None
    """The packets of its SITL. None: not known."""
    tells_settings: bool = False
    """Whether it reports any setting of its command line over MSP; see `settings_by_name`."""

    @property
    def hand_back(self) -> str:
        """What happens to the override when MSP falls silent, in words."""
        if self.override_timeout is None:
            return "held for as long as override is on"
        return f"handed back to the receiver after {self.override_timeout:g} s"

    @property
    def d_boost(self) -> str:
        """The beginning of the settings (`d_max_roll`) with which D grows in fast turns. 0: it does not."""
        return "d_max" if self.api >= (1, 47) else "d_min"

    def idle_lines(self, share: float) -> tuple[str, ...]:
        """The lines of the command line for the output of idling motors, 0 to 1, whichever protocol they speak."""
        if self.api >= (1, 47):
            return (f"set motor_idle={10_000 * share:.0f}",)
        return f"set dshot_idle_value={10_000 * share:.0f}", f"set min_throttle={1000 + 1000 * share:.0f}"


_BEFORE = SitlLayout(motors=(3, 0, 1, 2), yaw_sign=-1, hears_silence=False)
_SINCE_2026 = SitlLayout(
    motors=(0, 1, 2, 3), yaw_sign=1, hears_silence=True,
    settings=(
        "feature -GPS",  # it would interpret metres as degrees of latitude
        "set ap_hover_throttle=1600", "set alt_hold_climb_rate=8",  # its failsafe landing uses the barometer
    ),
)  # fmt: skip
_TENTHS, _SECONDS = ("failsafe_off_delay", 10), ("failsafe_landing_time", 1)

RELEASES = (
    Release("4.3", (1, 44), (4, 3), None, _TENTHS),
    Release("4.4", (1, 45), (4, 4), None, _TENTHS),
    Release("4.5", (1, 46), (4, 5), None, _TENTHS, _BEFORE),
    Release("4.6", (1, 47), (4, 6), None, _SECONDS, _BEFORE),  # never released; the package on PyPI contains it
    Release("2025.12", (1, 47), (25, 12), None, _SECONDS, _BEFORE),
    Release("2026.6", (1, 48), (26, 6), 0.3, _SECONDS, _SINCE_2026, tells_settings=True),
    Release(
        "2026.12", (1, 49), (26, 12), 0.3, _SECONDS, _SINCE_2026, tells_settings=True
    ),  # in development: as of August 2026
)
"""The known releases, oldest first."""
_UNRIPE = ("2026.6.0-alpha", "2026.6.0-beta")
"""Development builds whose override and SITL changed while they had this name."""


def version_text(version: tuple[int, int, int]) -> str:
    """A version as people write it: 4.5.2, 2026.6.1."""
    first, *rest = version
    return ".".join(map(str, (2000 + first if first >= CENTURY else first, *rest)))


def release_of(api: tuple[int, int], version: tuple[int, int, int], text: str = "") -> Release:
    """The release that a controller reports. `api` is its MSP version, and `version` its FC_VERSION. `text` is the
    version as the firmware writes it. Empty: the firmware does not write it.

    Raises:
        ValueError: the release is not known. The message names it, the known releases, and what to do.
    """
    name = text or version_text(version)
    found = next((r for r in RELEASES if r.api == api and r.series == version[:2]), None)
    if found is None:
        known = ", ".join(f"{r.name} (MSP {_dotted(r.api)})" for r in RELEASES)
        raise ValueError(
            f"controller: the firmware is Betaflight {name}, MSP {_dotted(api)}; accepted: {known}. What others mean "
            "by their numbers is not known: flash one of these, or look for a newer e2efly"
        )
    if name.startswith(_UNRIPE):
        raise ValueError(
            f"controller: the firmware is Betaflight {name}; accepted: 2026.6.0-rc1 and later, as development builds "
            "of that name treat an old override in two ways: flash 2026.6.1"
        )
    return found


def _dotted(api: tuple[int, int]) -> str:
    return f"{api[0]}.{api[1]}"
