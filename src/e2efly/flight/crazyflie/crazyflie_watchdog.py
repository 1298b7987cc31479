"""The watchdog of a flight with a Crazyflie: its own high-level commander lands it when the bridge dies or hangs.

The firmware holds the last rates for 0.5 s after the last set-point, and stops the motors after 2 s. So the link
belongs to a small process (`watched_link.py`), which asks the high-level commander for a landing. That one lands on
board, by the firmware's own estimate of its position, also when the radio is gone by then. Its answer to a request
for a landing is waited for before priority is handed over to it: without a landing, it stops the motors at once.
"""

import json
import math
import time
from dataclasses import dataclass

from e2efly.flight.crazyflie.crtp import HIGH_LEVEL, LAND, PacketReader, landing, set_points_end
from e2efly.flight.crazyflie.crtp_link import open_crtp
from e2efly.flight.link import Link
from e2efly.flight.watched_link import watch_over

PROGRAM = "e2efly.flight.crazyflie.crazyflie_watchdog"
"""This module, which runs as a process."""
TIMEOUT_S = 0.2
"""Silence of the bridge in flight after which this process takes over, s. The firmware levels after 0.5 s."""
PERIOD_S = 0.02
"""Time between two requests, s."""
SPEED = 0.5
"""Mean speed of the landing, m/s: the firmware's own default. The highest is 2.2 times that."""
BELOW = 0.3
"""So far under the ground the landing ends, m: its motors stop there, and its height may be wrong by so much."""
SETTLE_S = 1.0
"""Requests go on for this time after the landing, s."""
DEAF_S = 10.0
"""Without an answer it is given up after this time, s."""


@dataclass(frozen=True)
class LandingPlan:
    """What to do without the bridge."""

    flying: bool
    """The vehicle is in flight, so silence of the bridge leads to a landing."""
    height: float
    """Over the ground, m."""

    @property
    def descent(self) -> float:
        """How far the landing goes down, m."""
        return max(self.height, 0.0) + BELOW


@dataclass
class CommanderLander:
    """Lands by the high-level commander, from where the vehicle is."""

    plan: LandingPlan | None = None

    @property
    def flying(self) -> bool:
        """Whether silence of the bridge leads to a landing."""
        return self.plan is not None and self.plan.flying

    def passed(self, data: bytes) -> None:
        """Bytes of the bridge have been passed on. The firmware keeps what it needs of them."""
        del data

    def follow(self, content: bytes) -> None:
        """Take a new plan. One that cannot be read leaves the last one."""
        try:
            told = json.loads(content)
            plan = LandingPlan(bool(told["flying"]), float(told["height"]))
        except (ValueError, TypeError, KeyError):
            return
        self.plan = plan if math.isfinite(plan.height) else self.plan

    def land(self, link: Link) -> None:
        """Ask for the landing until it is acknowledged, then hand priority over until it must be over.

        A request that is repeated changes nothing: the firmware refuses a second landing.
        """
        descent = BELOW if self.plan is None else self.plan.descent
        reader, lands, now = PacketReader(), False, time.monotonic()
        end = now + DEAF_S
        while now < end:
            link.poll(now)
            for packet in reader.feed(link.receive()):
                if not lands and packet.port == HIGH_LEVEL and packet.data[:1] == bytes([LAND]) and _taken(packet.data):
                    lands, end = True, now + descent / SPEED + SETTLE_S
            link.send((set_points_end() if lands else landing(descent, SPEED)).framed())
            time.sleep(PERIOD_S)
            now = time.monotonic()
        link.close()


def _taken(answer: bytes) -> bool:
    """Whether an answer says that it lands: 0, or 1 if it was landing already."""
    return len(answer) > 3 and answer[3] in (0, 1)


if __name__ == "__main__":
    watch_over(open_crtp, CommanderLander())
