"""Whole flights and faults over MAVLink: PX4 and ArduCopter as they document themselves, over our rigid body.

    python benchmarks/mavlink.py [--flights 20] [--faults 5] [--only NAME ...] [--seed 7000000] [--json FILE]

The autopilots are `tests/flight/mavlink_peer.py`: pymavlink's frames, a rate loop, modes and time-outs of their own, in
virtual time. No firmware flies here. Each policy of the zoo flies whole flights: take-off, hover, policy, landing. Then
each of twenty faults begins in a hover, and the flight must end as documented: by the autopilot's failsafe where it has
to act, by the bridge where not. The seeds of the tests were looked at while this was written. `--only` flies some of
the flights (`race`) and faults (`"the poses end"`).
"""

from contextlib import nullcontext
from functools import partial
from typing import Any

from link_flights import LinkBench
from tests.flight.mavlink_peer import MavlinkRig
from tests.validation.mavlink_faults import FAULTS

from e2efly.vehicles.loading import load_vehicle

POLICIES: dict[str, tuple[str, dict[str, Any]]] = {
    "hover": ("hover", {}),
    "land": ("land", {}),
    "circle": ("track", {}),
    "lemniscate": ("track", {"reference": "lemniscate"}),
    "race": ("race", {}),
}
BENCH = LinkBench("mavlink", load_vehicle("vis_r"), POLICIES, FAULTS, 1.2, 7000000)


def opened(kind: str, latency: float, seed: int, *_: Any) -> Any:
    """An autopilot of ours."""
    return nullcontext(MavlinkRig(kind, BENCH.vehicle, latency=latency, seed=seed))


if __name__ == "__main__":
    asked = BENCH.options(__doc__ or "", flights=20, faults=5)
    BENCH.measure(asked, {"PX4": partial(opened, "px4"), "ArduCopter": partial(opened, "copter")})
