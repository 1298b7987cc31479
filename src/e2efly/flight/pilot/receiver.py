"""The pilot's wishes in the channels of the receiver."""

from collections.abc import Sequence

from e2efly.flight.pilot.flight_state import Mission, Pilot
from e2efly.flight.settings import PilotChannels


def mission_of(channels: Sequence[int], places: PilotChannels) -> Mission | None:
    """The position of the mission switch. None: the receiver has no such channel, so the pilot's wish is unknown."""
    if places.mission > len(channels):
        return None
    at = channels[places.mission - 1]
    return Mission.LAND if at < 1300 else Mission.POLICY if at > 1700 else Mission.HOVER


def pilot_of(channels: Sequence[int], places: PilotChannels, mission: Mission) -> Pilot:
    """What the pilot wants. `places` has the channels with the copies of the sticks."""

    def stick(channel: int | None) -> float:
        return 0.0 if channel is None or channel > len(channels) else deflection(channels[channel - 1])

    return Pilot(mission, stick(places.roll), stick(places.pitch), stick(places.throttle), stick(places.yaw))


def deflection(pulse: int) -> float:
    """The deflection of a stick, -1 to 1, from its pulse, us."""
    return max(-1.0, min(1.0, (pulse - 1500) / 500))
