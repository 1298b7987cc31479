"""What the flight controller reports about itself, its pilot and its battery, read at each control step.

A checksum of 8 bits accepts one damaged message in 256, so a single message must not end or begin a flight. Two
messages in a row must agree before the controller counts as armed or disarmed, before the receiver counts as lost, and
before the mission switch counts as moved. Some changes count at once, because they only end the control by the policy
or by the bridge: the override switch, a stick, and a mission switch that leaves its policy position.
"""

from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from e2efly.flight.attitude import Attitude
from e2efly.flight.betaflight.allowed_modes import ANGLE, ARM, FAILSAFE, OVERRIDE, foreign, named_mode
from e2efly.flight.betaflight.client import Client
from e2efly.flight.betaflight.controller import ControllerInfo
from e2efly.flight.betaflight.messages import AttitudeReply, BatteryState, Rc, StatusEx
from e2efly.flight.betaflight.sticks import RATES_PULSE, Sticks
from e2efly.flight.pilot.flight_state import Mission, Pilot
from e2efly.flight.pilot.receiver import mission_of, pilot_of
from e2efly.flight.settings import FlightSettings

RECEIVER_LOST = frozenset({"RXLOSS", "FAILSAFE"})
"""Reasons against arming with which the controller reports that it does not hear the pilot."""
VOLTAGE_SHARE = 0.4
"""Weight of a new battery reading. A short sag under full throttle does not mean an empty battery."""
RC_PATIENCE = 1.2
"""The largest age of the pilot's channels, as a multiple of the link's time-out. It is larger than 1, so that a lost
link is reported as a lost link, whichever reply came last."""
BEHIND = 0.5
"""The longest reply time of a controller, as a share of the link's time-out. A slower one is too slow for flight."""
ARMING_S = 2.0
"""A mode that was on up to this time before arming may stay in effect after its switch has left it, s. Betaflight up to
4.5 keeps its motors reversed until it is disarmed, and delays arming by up to 1.2 s after a beep of the motors."""
BATTERY_PATIENCE_S = 3.0
"""The largest age of the battery's voltage, s."""


@dataclass(frozen=True)
class Reading:
    """What is known about the flight controller at a control step."""

    link_problem: str | None
    """Why the flight controller is not heard. None: it is."""
    armed: bool
    override: bool
    """The controller takes its stick inputs from this program."""
    pilot: Pilot | None
    """What the pilot wants. None: it is not known."""
    failsafe: bool
    """According to its last report, the controller does not hear the receiver. It then follows its own failsafe, not
    the commands that are sent."""
    voltage: float | None
    """Voltage of a cell, V. None: the controller does not know it."""
    meddling: tuple[str, ...]
    """The active modes that are not known to be harmless while the bridge flies, and a rate profile that is not the one
    whose rates were read, in words."""
    channels: Rc | None
    """The channels that the controller uses."""
    attitude: Attitude | None
    fresh: dict[int, Any]
    """The replies that came since the previous reading, by code."""
    armed_with: tuple[str, ...] = ()
    """The modes like `meddling` that were on while the vehicle was armed, and are not on now, in words."""


T = TypeVar("T")


@dataclass
class Twice(Generic[T]):
    """A value that changes only when two messages in a row report the same new value."""

    held: T
    """The value that counts."""
    _last: T | None = None

    def hear(self, value: T) -> None:
        """Process the next message, which reports `value`."""
        if value == self._last:
            self.held = value
        self._last = value


@dataclass
class Instruments:
    """Reads one flight controller."""

    client: Client
    settings: FlightSettings
    statuses: int = 0
    """Number of messages so far that tell whether the controller is armed."""
    _armed: Twice[bool] = field(default_factory=lambda: Twice(False))
    _heard: Twice[bool] = field(default_factory=lambda: Twice(False))
    """Whether the controller hears the pilot's receiver."""
    _mission: Twice[Mission | None] = field(default_factory=lambda: Twice(None))
    _seen: dict[int, float] = field(default_factory=dict)
    _voltage: float | None = None
    _foreign: dict[int, float] = field(default_factory=dict)
    """When each mode that is not known to be harmless was last on, s: since arming, and just before."""
    _last: frozenset[int] = frozenset()
    """Those of the last message."""

    def read(self, now: float, info: ControllerInfo, *, land: bool, sends: bool = True) -> Reading:
        """Evaluate the replies that have come until `now`. `now` is in s on the client's clock. The settings of the
        controller are needed to decode the active modes. `land`: the operator asks for a landing, as the pilot does
        with the mission switch. While sticks are not sent, or have no effect, ANGLE is on, as it should be.
        """
        fresh = self._fresh()
        if (battery := fresh.get(BatteryState.CODE)) is not None:
            self._measure(battery.message)
        patience = self.settings.link_timeout
        status: StatusEx | None = self.client.message(StatusEx.CODE, now, patience)
        active = status.active(info.box_ids) if status is not None else frozenset()
        channels: Rc | None = self.client.message(Rc.CODE, now, RC_PATIENCE * patience)
        idle = {FAILSAFE} if sends and OVERRIDE in active else {FAILSAFE, ANGLE}  # `failsafe` tells of FAILSAFE
        on = foreign(active - idle, info.api)
        meddling = [f"{named_mode(box)} is on; accepted: off while the bridge flies" for box in sorted(on)]
        if status is not None and status.rate_profile != info.rate_profile:
            read = f"{info.rate_profile}, whose rates were read: switch back, or start again"
            meddling.append(f"rateprofile is {status.rate_profile}; accepted: {read}")
        if status is not None and StatusEx.CODE in fresh:
            self.statuses += 1
            self._armed.hear(ARM in active)
            self._heard.hear(FAILSAFE not in active and not RECEIVER_LOST & set(status.arming_disabled))
            kept = {box: last for box, last in self._foreign.items() if ARM in active or now - last < ARMING_S}
            self._foreign = kept | dict.fromkeys(on & self._last - {ANGLE}, now)
            self._last = on
        battery_known = self.client.message(BatteryState.CODE, now, BATTERY_PATIENCE_S) is not None
        return Reading(
            link_problem=self._link_problem(status),
            armed=self._armed.held and status is not None,
            override=OVERRIDE in active,
            pilot=self._pilot(channels, fresh=Rc.CODE in fresh, land=land),
            failsafe=not self._heard.held,
            voltage=self._voltage if battery_known else None,
            meddling=tuple(meddling),
            armed_with=tuple(
                f"{named_mode(box)} was on while arming; accepted: disarm, switch it off, arm again"
                for box in sorted(self._foreign.keys() - on)
                if self._armed.held
            ),
            channels=channels,
            attitude=self.client.message(AttitudeReply.CODE, now, patience),
            fresh=fresh,
        )

    def _pilot(self, channels: Rc | None, *, fresh: bool, land: bool) -> Pilot | None:
        if channels is None:
            return None
        at = mission_of(channels.channels, self.settings.channels)
        if fresh:
            self._mission.hear(at)
        mission = self._mission.held
        if mission is None or not self._heard.held:
            return None
        if mission is Mission.POLICY and at is not Mission.POLICY:
            mission = Mission.HOVER  # the policy stops at once; the next message shows whether to land
        return pilot_of(channels.channels, self.settings.channels, Mission.LAND if land else mission)

    def _fresh(self) -> dict[int, Any]:
        fresh = {}
        for code, reply in self.client.latest.items():
            if self._seen.get(code) != reply.time:
                self._seen[code] = reply.time
                fresh[code] = reply
        return fresh

    def _link_problem(self, status: StatusEx | None) -> str | None:
        patience, link = self.settings.link_timeout, self.client.link
        late = self.client.latency > BEHIND * patience
        if (status is None or late) and not link.alive:
            return link.reason
        if status is None:
            return f"no answer within {patience:g} s"
        if late:
            return f"it answers {1e3 * self.client.latency:.0f} ms late (set serial_update_rate_hz=1000)"
        return None

    def _measure(self, battery: BatteryState) -> None:
        """Smooth the voltage of a cell."""
        if not (battery.cells and battery.voltage):
            self._voltage = None
            return
        cell = battery.voltage / battery.cells
        self._voltage = cell if self._voltage is None else self._voltage + VOLTAGE_SHARE * (cell - self._voltage)


PROBE = (20, 40, 60)
"""Before arming, roll, pitch and yaw are sent with these offsets from the centre, to see where each arrives, us."""
CLOSED = 1000
"""The value of the throttle channel with which the controller can be armed, us."""
PROBE_S = 0.5
"""The longest time after the override is switched on until the sticks must be seen where they were sent, s."""


@dataclass
class ChannelProbe:
    """Checks before arming whether the controller assigns each channel to the right stick. The sticks are sent with the
    different offsets of `PROBE`.
    """

    seen: bool = False
    """Whether each stick was seen where it was sent."""
    _since: float | None = None
    """When the check began, s."""

    def look(self, now: float, reading: Reading, sticks: Sticks, *, grounded: bool) -> tuple[str, ...]:
        """What is wrong with the channels, in words. `now` is in s. While `grounded`, no flight has begun. When the
        override is switched off in this state, the check starts again.
        """
        if self.seen or not reading.override:
            self.seen = self.seen and (reading.override or not grounded)
            self._since = None
            return ()
        self._since = now if self._since is None else self._since
        sent, names = [sticks.centre + offset for offset in PROBE] + [CLOSED], "roll, pitch, yaw, throttle"
        places = [0, 1, 2, 3]
        if sticks.angle is not None:
            sent, names = [*sent, RATES_PULSE], f"{names} and AUX{sticks.angle + 1}"
            places.append(4 + sticks.angle)
        heard = reading.channels.channels if reading.channels is not None else ()
        got = [heard[place] for place in places if place < len(heard)]
        self.seen = [abs(a - b) <= 1 for a, b in zip(sent, got, strict=False)] == [True] * len(sent)
        if self.seen or now - self._since < PROBE_S:
            return ()
        return (
            f"{names} were sent as {sent} us and taken as {got}; needed: the same "
            "(msp_override_channels_mask, rxrange as it comes; switch override on before arming)",
        )
