"""The identity and the settings of a flight controller, read once, before flight, into one frozen dataclass."""

from dataclasses import dataclass, replace
from typing import Any

from e2efly.flight.betaflight import messages, mode_slots, settings_by_name, settings_messages
from e2efly.flight.betaflight.client import Client, ask
from e2efly.flight.betaflight.rates import RateProfile
from e2efly.flight.betaflight.throttle_curve import ThrottleCurve
from e2efly.flight.betaflight.versions import Release, release_of, version_text
from e2efly.flight.clock import MONOTONIC, Clock

VARIANT = "BTFL"
"""The only accepted firmware: Betaflight."""


@dataclass(frozen=True)
class ControllerInfo:
    """A flight controller and its settings."""

    variant: str
    """`BTFL`."""
    version: tuple[int, int, int]
    """Version of the firmware: the bytes of FC_VERSION."""
    api: tuple[int, int]
    """MSP version."""
    built: str
    """Day and time of the build, and its revision."""
    craft: str
    """Name of the craft. May be empty."""
    features: frozenset[str]
    """Features that are on."""
    rate_profile: int
    """Index of the active rate profile, from 0."""
    rates: RateProfile
    """The active rate profile."""
    throttle: ThrottleCurve
    """The active throttle curve."""
    rx: settings_messages.RxConfig
    """How channels are read."""
    rx_map: settings_messages.RxMap
    """Which channel has which function."""
    deadband: settings_messages.RcDeadband
    """Deadbands of the sticks."""
    failsafe: settings_messages.FailsafeConfig
    """What it does when the receiver's signal is lost."""
    rx_fail: settings_messages.RxFailConfig
    """What each channel becomes in that case."""
    modes: tuple[mode_slots.ModeRange, ...]
    """Which switches make which modes active: the slots of `aux` that are in use."""
    box_ids: tuple[int, ...]
    """Permanent ids of the modes that the controller knows, in the order of the bits of `StatusEx.boxes`."""
    motor: settings_messages.MotorConfig
    """Motor outputs."""
    pid_advanced: settings_messages.PidAdvanced
    """Settings that act between throttle and motors."""
    mixer: settings_messages.MixerConfig
    """Kind of vehicle."""
    gains: settings_messages.PidGains
    """Gains of the rate loop."""
    motors: settings_messages.AdvancedConfig
    """How the motors are driven."""
    alignment: settings_messages.BoardAlignment
    """How the board is rotated in the airframe."""
    by_name: tuple[tuple[str, str], ...] = ()
    """(name, value) of the settings of `settings_by_name` that the controller reports."""

    @property
    def release(self) -> Release:
        """What is known about its firmware. Raises `ValueError` if nothing is known."""
        return release_of(self.api, self.version)

    @property
    def firmware(self) -> str:
        """Its firmware's version as people write it: 2026.6.1."""
        return version_text(self.version)

    def named(self, setting: str) -> str | None:
        """The value of a setting by its name in the command line. None: this controller does not report it."""
        return dict(self.by_name).get(setting)

    def slots(self, box: int) -> tuple[mode_slots.ModeRange, ...]:
        """The slots of `aux` that make a mode active, by its permanent id."""
        return tuple(slot for slot in self.modes if slot.box == box)


def identify(client: Client, timeout_s: float = 1.0, clock: Clock = MONOTONIC) -> ControllerInfo:
    """Read everything from a controller, and wait for its replies. This is not for flight.

    Raises:
        ValueError: the firmware is not known, or its settings cannot be read.
        TimeoutError: a reply is missing after `timeout_s` seconds.
    """

    def get(kind: Any) -> Any:
        return ask(client, kind.CODE, timeout_s, clock=clock)

    variant = get(messages.FcVariant).variant
    if variant != VARIANT:
        raise ValueError(f"controller: the firmware is {variant!r}; accepted: {VARIANT!r} (Betaflight)")
    api = get(messages.ApiVersion).version
    version = get(messages.FcVersion)
    release = release_of(api, version.version, version.text)
    build, tuning, rx = get(messages.BuildInfo), get(settings_messages.RcTuning), get(settings_messages.RxConfig)
    return ControllerInfo(
        variant=variant,
        version=version.version,
        api=api,
        built=f"{build.built} {build.revision}",
        craft=get(messages.Name).name,
        features=get(settings_messages.FeatureConfig).features,
        rate_profile=get(messages.StatusEx).rate_profile,
        rates=tuning.rates,
        throttle=replace(tuning.throttle, min_check=rx.min_check),
        rx=rx,
        rx_map=get(settings_messages.RxMap),
        deadband=get(settings_messages.RcDeadband),
        failsafe=get(settings_messages.FailsafeConfig),
        rx_fail=get(settings_messages.RxFailConfig),
        modes=mode_slots.mode_ranges(get(mode_slots.ModeRanges), get(mode_slots.ModeLogic)),
        box_ids=get(mode_slots.BoxIds).ids,
        motor=get(settings_messages.MotorConfig),
        pid_advanced=get(settings_messages.PidAdvanced),
        mixer=get(settings_messages.MixerConfig),
        gains=get(settings_messages.PidGains),
        motors=get(settings_messages.AdvancedConfig),
        alignment=get(settings_messages.BoardAlignment),
        by_name=settings_by_name.read(client, timeout_s, clock) if release.tells_settings else (),
    )
