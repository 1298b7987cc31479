"""The plan that a flight of a Crazyflie gives to its watchdog: how far it is to the ground."""

from dataclasses import dataclass

from e2efly.flight.bridge import Bridge
from e2efly.flight.crazyflie.crazyflie_watchdog import LandingPlan
from e2efly.flight.watched_link import WatchedLink


@dataclass(frozen=True)
class LandingWatchdog:
    """The watchdog of a flight of a Crazyflie."""

    link: WatchedLink

    @property
    def taken_over(self) -> str:
        """Why the watchdog has taken over. Empty: it has not."""
        return self.link.taken_over

    def follow(self, bridge: Bridge) -> None:
        """Give it a new plan."""
        self.link.plan(landing_plan(bridge))


def landing_plan(bridge: Bridge) -> LandingPlan:
    """What the watchdog has to do from now on if the bridge falls silent. A vehicle whose motors may not turn is never
    landed: the landing would start them.
    """
    moves = bridge.estimate.inertial.reckoned
    height = bridge.height if moves is None else moves.height - bridge.flight.home
    return LandingPlan(bridge.flying and bridge.inputs.armed, float(height))
