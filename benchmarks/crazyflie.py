"""Whole flights and faults of a Crazyflie: its firmware as it documents itself, over our rigid body.

    python benchmarks/crazyflie.py [--flights 10] [--faults 5] [--only NAME ...] [--seed 7000000] [--json FILE]

The firmware is `tests/flight/crazyflie_peer.py`: packets, supervisor, time-outs, a rate loop and a mixer without
airmode of their own, in virtual time. No firmware flies here. Each of the zoo's Crazyflie policies flies whole flights:
take-off, hover, policy, landing. Then each of 24 faults begins in a hover, and the flight must end as documented: by
firmware and watchdog where they have to act, by the bridge where not. The seeds of the tests were looked at while this
was written. `--only` flies some of the flights (`race`) and faults (`"the poses end"`).
"""

from contextlib import nullcontext
from typing import Any

from link_flights import LinkBench
from tests.flight.crazyflie_peer import CrazyflieRig
from tests.validation.crazyflie_faults import FAULTS
from tests.validation.link_faults import Fault

from e2efly.vehicles.loading import load_vehicle

POLICIES: dict[str, tuple[str, dict[str, Any]]] = {
    name: (f"crazyflie/{name}", {}) for name in ("hover", "land", "race", "race_speed", "gap")
}
BENCH = LinkBench("crazyflie", load_vehicle("crazyflie"), POLICIES, FAULTS, 1.0, 7000000)


def opened(latency: float, seed: int, place: Any, fault: Fault | None) -> Any:
    """A Crazyflie of ours, with the watchdog for faults."""
    del place
    watched = fault is not None and fault.watched
    return nullcontext(CrazyflieRig(BENCH.vehicle, latency=latency, seed=seed, watched=watched))


if __name__ == "__main__":
    asked = BENCH.options(__doc__ or "", flights=10, faults=5)
    BENCH.measure(asked, {"Crazyflie": opened})
