"""What the flight controller says of itself, its pilot and its battery, read at each control step.

A checksum of 8 bits passes one damaged message in 256, so one message alone must not end or begin a flight. Two in a
row must agree before the controller counts as armed or disarmed, before the receiver counts as lost, and before the
mission switch counts as moved. What only takes the vehicle out of the policy's hands or the bridge's is believed at
once: the override switch, a stick, and the mission switch's leaving of its policy position.
"""

from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from e2efly.deploy.attitude import Attitude
from e2efly.deploy.betaflight.client import Client
from e2efly.deploy.betaflight.controller import ControllerInfo
from e2efly.deploy.betaflight.messages import AttitudeReply, BatteryState, Rc, StatusEx
from e2efly.deploy.betaflight.sticks import RATES_PULSE, Sticks
from e2efly.deploy.pilot.flight_state import Mission, Pilot
from e2efly.deploy.settings import FlightSettings, PilotChannels

ARM, ANGLE, FAILSAFE, OVERRIDE = 0, 1, 27, 50
"""Permanent ids of Betaflight's modes."""
MEDDLING = {
    ANGLE: "ANGLE", 2: "HORIZON", 3: "ALTHOLD", 6: "HEADFREE", 11: "POS HOLD", 46: "GPS RESCUE", 47: "ACRO TRAINER",
    56: "AUTOPILOT",
}  # fmt: skip
"""Modes in which sticks do not mean body rates, by permanent id."""
RECEIVER_LOST = frozenset({"RXLOSS", "FAILSAFE"})
"""Reasons against arming by which the controller tells that it does not hear the pilot."""
VOLTAGE_SHARE = 0.4
"""Weight of a new battery reading: a moment's sag under full throttle is no empty battery."""
RC_PATIENCE = 1.2
"""The pilot's channels may be so much older than the link's time-out: a lost link is to be told as one, whichever
answer came last."""
BEHIND = 0.5
"""Share of the link's time-out. A controller that takes longer to answer is too slow to fly by."""
BATTERY_PATIENCE_S = 3.0
"""The battery's voltage may be so old, s."""


@dataclass(frozen=True)
class Reading:
    """What was known of the flight controller at a control step."""

    link_problem: str | None
    """Why the flight controller is not heard. None: it is."""
    armed: bool
    override: bool
    """The controller takes its stick inputs from this program."""
    pilot: Pilot | None
    """What the pilot wants. None: it is not known."""
    failsafe: bool
    """By its last word it does not hear the receiver: it flies by a failsafe of its own, not by what it is sent."""
    voltage: float | None
    """Voltage of a cell, V. None: the controller does not know it."""
    meddling: tuple[str, ...]
    """The modes in which the sticks that are sent would be no body rates, in words."""
    channels: Rc | None
    """The channels that the controller uses."""
    attitude: Attitude | None
    fresh: dict[int, Any]
    """The replies that came since the reading before, by code."""


T = TypeVar("T")


@dataclass
class Twice(Generic[T]):
    """A value that changes when two messages in a row say so."""

    held: T
    """What counts."""
    _last: T | None = None

    def hear(self, value: T) -> None:
        """The next message says `value`."""
        if value == self._last:
            self.held = value
        self._last = value


@dataclass
class Instruments:
    """Reads one flight controller."""

    client: Client
    settings: FlightSettings
    _armed: Twice[bool] = field(default_factory=lambda: Twice(False))
    _heard: Twice[bool] = field(default_factory=lambda: Twice(False))
    """Whether the controller hears the pilot's receiver."""
    _mission: Twice[Mission | None] = field(default_factory=lambda: Twice(None))
    _seen: dict[int, float] = field(default_factory=dict)
    _voltage: float | None = None

    def read(self, now: float, info: ControllerInfo, *, land: bool, sends: bool = True) -> Reading:
        """What the answers say that have come until `now` s.

        Args:
            now: on the client's clock, s.
            info: of the controller: it tells which modes are on.
            land: the operator asks for a landing, as the pilot does by the mission switch.
            sends: sticks are sent; without them ANGLE is on, as it is to be.
        """
        fresh = self._fresh()
        if (battery := fresh.get(BatteryState.CODE)) is not None:
            self._measure(battery.message)
        patience = self.settings.link_timeout
        status: StatusEx | None = self.client.message(StatusEx.CODE, now, patience)
        active = status.active(info.box_ids) if status is not None else frozenset()
        channels: Rc | None = self.client.message(Rc.CODE, now, RC_PATIENCE * patience)
        on = MEDDLING.keys() & active if sends else MEDDLING.keys() & active - {ANGLE}
        meddling = tuple(f"{MEDDLING[box]} is on: sticks are no body rates" for box in on)
        if status is not None and StatusEx.CODE in fresh:
            self._armed.hear(ARM in active)
            self._heard.hear(FAILSAFE not in active and not RECEIVER_LOST & set(status.arming_disabled))
        battery_known = self.client.message(BatteryState.CODE, now, BATTERY_PATIENCE_S) is not None
        return Reading(
            link_problem=self._link_problem(status),
            armed=self._armed.held and status is not None,
            override=OVERRIDE in active,
            pilot=self._pilot(channels, fresh=Rc.CODE in fresh, land=land),
            failsafe=not self._heard.held,
            voltage=self._voltage if battery_known else None,
            meddling=meddling if OVERRIDE in active else (),
            channels=channels,
            attitude=self.client.message(AttitudeReply.CODE, now, patience),
            fresh=fresh,
        )

    def _pilot(self, channels: Rc | None, *, fresh: bool, land: bool) -> Pilot | None:
        if channels is None:
            return None
        at = mission_of(channels, self.settings.channels)
        if fresh:
            self._mission.hear(at)
        mission = self._mission.held
        if mission is None or not self._heard.held:
            return None
        if mission is Mission.POLICY and at is not Mission.POLICY:
            mission = Mission.HOVER  # the policy stops at once; whether to land is told by the next message
        return pilot_of(channels, self.settings.channels, Mission.LAND if land else mission)

    def _fresh(self) -> dict[int, Any]:
        fresh = {}
        for code, reply in self.client.latest.items():
            if self._seen.get(code) != reply.time:
                self._seen[code] = reply.time
                fresh[code] = reply
        return fresh

    def _link_problem(self, status: StatusEx | None) -> str | None:
        patience, link = self.settings.link_timeout, self.client.link
        if status is None:
            return link.reason if not link.alive else f"no answer within {patience:g} s"
        if self.client.latency > BEHIND * patience:
            return f"it answers {1e3 * self.client.latency:.0f} ms late (set serial_update_rate_hz=1000)"
        return None

    def _measure(self, battery: BatteryState) -> None:
        """Smooth the voltage of a cell."""
        if not (battery.cells and battery.voltage):
            self._voltage = None
            return
        cell = battery.voltage / battery.cells
        self._voltage = cell if self._voltage is None else self._voltage + VOLTAGE_SHARE * (cell - self._voltage)


def mission_of(rc: Rc, places: PilotChannels) -> Mission | None:
    """Where the mission switch is; None where the receiver has no such channel: nobody's will is known."""
    if places.mission > len(rc.channels):
        return None
    at = rc.channels[places.mission - 1]
    return Mission.LAND if at < 1300 else Mission.POLICY if at > 1700 else Mission.HOVER


def pilot_of(rc: Rc, places: PilotChannels, mission: Mission) -> Pilot:
    """What the pilot wants.

    Args:
        rc: the receiver's channels.
        places: where the copies of the sticks are.
        mission: what the mission switch asks for.
    """

    def stick(channel: int | None) -> float:
        if channel is None or channel > len(rc.channels):
            return 0.0
        return max(-1.0, min(1.0, (rc.channels[channel - 1] - 1500) / 500))

    return Pilot(mission, stick(places.roll), stick(places.pitch), stick(places.throttle), stick(places.yaw))


PROBE = (20, 40, 60)
"""How far off centre roll, pitch and yaw are sent before arming, to see where each goes, us."""
CLOSED = 1000
"""The throttle channel that lets the controller arm, us."""
PROBE_S = 0.5
"""So long after the override has come on the sticks must be seen where they were sent, s."""


@dataclass
class ChannelProbe:
    """Until it is armed, the sticks are sent apart by `PROBE`: does the controller take each for what it is?"""

    seen: bool = False
    """Whether it does."""
    _since: float | None = None
    """When they were first looked for."""

    def look(self, now: float, reading: Reading, sticks: Sticks, *, grounded: bool) -> tuple[str, ...]:
        """What is wrong with the channels, in words.

        Args:
            now: s.
            reading: of this control step.
            sticks: that were sent.
            grounded: no flight has begun; the override going off then asks for a new look.
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
