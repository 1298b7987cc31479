"""Conversion of collective throttle and body rates to receiver channels, with the controller's own settings, and back.

Signs, for body FLU: a positive roll rate is the roll stick above its centre. A positive pitch rate (nose down) is the
pitch stick above its centre. A positive yaw rate (left) is the yaw stick *below* its centre.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from e2efly.flight.betaflight.allowed_modes import ANGLE
from e2efly.flight.betaflight.controller import ControllerInfo
from e2efly.flight.betaflight.mode_slots import ModeRange
from e2efly.flight.betaflight.rates import (
    AXES,
    RateProfile,
    channel_to_stick,
    rate_to_stick,
    stick_to_channel,
    stick_to_rate,
)
from e2efly.flight.betaflight.throttle_curve import ThrottleCurve

CHANNELS = (1000, 2000)
"""The range of the sticks, µs."""
RATES_PULSE = 900
"""The pulse on the AUX channel of ANGLE, µs. Sticks are body rates only while the controller receives this pulse."""
TRANSMITTER = (988, 2012)
"""The range of the channels of a transmitter, µs."""
_SIGNS = (1, 1, -1)
_THROTTLE = 3
_MAPPED = 8


@dataclass(frozen=True)
class StickCommand:
    """The channels to send, and the parts of the command that they cannot reach."""

    channels: tuple[int, ...]
    """µs, in the receiver's order, for `messages.set_raw_rc`."""
    saturated: tuple[str, ...]
    """Those of throttle, roll, pitch and yaw whose commands are beyond the reach of the sticks."""


@dataclass(frozen=True)
class Sticks:
    """The conversion from commands to channels for one controller. Make it with `sticks_of`."""

    rates: RateProfile
    """The rate profile of the controller."""
    throttle: ThrottleCurve
    """The throttle curve of the controller."""
    channel: tuple[int, ...]
    """(8,) the index of the channel for roll, pitch, yaw, throttle, AUX1 to AUX4."""
    centre: int = 1500
    """Centre of the sticks, µs."""
    deadband: tuple[int, int, int] = (0, 0, 0)
    """Deadbands of roll, pitch and yaw on each side of the centre, µs."""
    angle: int | None = None
    """The AUX channel, from 0, on which `RATES_PULSE` keeps ANGLE off. None: there is no such channel."""

    def channels_of(self, throttle: float, body_rate: Sequence[float], aux: Sequence[int]) -> StickCommand:
        """The channels that command a throttle and body rates.

        Args:
            throttle: the throttle that the controller's mixer should get, 0 to 1.
            body_rate: about body x, y, z, FLU, rad/s.
            aux: AUX1, AUX2, ..., µs. Those of AUX1 to AUX4 that are left out are centred, but channel `angle` becomes
                `RATES_PULSE`.

        Raises:
            ValueError: a value is not finite, or an AUX channel is outside 1000 to 2000. The message names the value.
        """
        values = (throttle, *body_rate)
        if len(values) != 4 or not all(map(isfinite, values)):
            raise ValueError(f"stick command: throttle and body rate are {values!r}; accepted: four finite numbers")
        saturated = ["throttle"] if not 0 <= throttle <= self.throttle.largest else []
        pulses = [self.pulse(axis, rate) for axis, rate in enumerate(body_rate)]
        for axis, rate in enumerate(body_rate):
            at_end = pulses[axis] in CHANNELS and abs(self._rate(axis, pulses[axis])) < abs(rate)
            if abs(rate) > self.rates.max_rate[axis] or at_end:
                saturated.append(AXES[axis])
        return StickCommand(self.arrange((*pulses, self.throttle.channel_for(throttle)), aux), tuple(saturated))

    def pulse(self, axis: int, rate: float) -> int:
        """The pulse of an axis (0 to 2), µs, that commands a body rate, FLU, rad/s. It is limited to `CHANNELS`."""
        stick = rate_to_stick(self.rates, axis, rate) * _SIGNS[axis]
        return min(max(stick_to_channel(stick, self.centre, self.deadband[axis]), CHANNELS[0]), CHANNELS[1])

    def arrange(self, pulses: Sequence[int], aux: Sequence[int]) -> tuple[int, ...]:
        """Arrange pulses for roll, pitch, yaw, throttle and AUX1, AUX2, ... in the receiver's order, µs.

        Raises:
            ValueError: an AUX channel is not a whole number from 1000 to 2000.
        """
        for i, value in enumerate(aux):
            if not CHANNELS[0] <= value <= CHANNELS[1] or value != int(value):
                raise ValueError(f"AUX{i + 1} is {value!r}; accepted: whole µs, {CHANNELS[0]} to {CHANNELS[1]}")
        values = [*aux, *[self.centre] * (max(4, (self.angle or 0) + 1) - len(aux))]
        if self.angle is not None and self.angle >= len(aux):
            values[self.angle] = RATES_PULSE
        mapped = [*pulses, *values[:4]]
        channels = [0] * _MAPPED
        for function, index in enumerate(self.channel):
            channels[index] = int(mapped[function])
        return (*channels, *map(int, values[4:]))

    def _rate(self, axis: int, pulse: int) -> float:
        stick = channel_to_stick(pulse, self.centre, self.deadband[axis])
        return stick_to_rate(self.rates, axis, stick * _SIGNS[axis])


def sticks_of(info: ControllerInfo) -> Sticks:
    """The sticks of a controller, from its own settings.

    Raises:
        ValueError: with the controller's settings, sticks do not mean body rates and a throttle.
    """
    if "3D" in info.features:
        raise ValueError("controller: feature 3D is on; accepted: off, as the throttle stick would also reverse motors")
    bands = info.deadband.deadband, info.deadband.deadband, info.deadband.yaw_deadband
    angle = angle_range(info)
    aux = None if angle is None else angle.aux
    return Sticks(info.rates, info.throttle, info.rx_map.channel, info.rx.mid, bands, aux)


def angle_range(info: ControllerInfo) -> ModeRange | None:
    """The range with which ANGLE is on at any pulse of the transmitter, and off at `RATES_PULSE`. None: there is none.

    If the channel of this range is overridden, ANGLE is off only while the override is in effect. When the pilot takes
    the sticks back, or the controller returns them because it hears no MSP any more, the vehicle levels itself.
    """
    others = {slot.aux for slot in info.modes if slot.box != ANGLE}
    fit = (r for r in info.slots(ANGLE) if r.low > RATES_PULSE and r.covers(*TRANSMITTER) and r.aux not in others)
    return next(fit, None)
