"""Whole flights and faults of a Crazyflie: its firmware as it documents itself, over our rigid body.

    python benchmarks/crazyflie.py [--flights 10] [--faults 2] [--json FILE]

The firmware is `tests/flight/crazyflie_peer.py`: packets, supervisor, time-outs, a rate loop and a mixer without
airmode of their own, in virtual time. No firmware flies here. Each of the zoo's Crazyflie policies flies whole flights:
take-off, hover, policy, landing. Then each of twenty faults begins in a hover, and the flight must end as documented.
Seeds 7000000 and following; those of the tests were looked at while this was written.
"""

import dataclasses
from collections.abc import Iterator
from typing import Any

from common import arguments, table, write
from tests.flight.crazyflie_peer import CrazyflieRig
from tests.validation.crazyflie_faults import FAULTS
from tests.validation.link_faults import flown

from e2efly.flight.pilot.hovering import hover_controller
from e2efly.policy.loader import load_policy
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rehearsal import LINK_S, whole_course, whole_flight
from e2efly.vehicles.loading import load_vehicle

SEED = 7000000
VEHICLE = load_vehicle("crazyflie")
POLICIES = ("hover", "land", "race", "race_speed", "gap")


def flights(count: int) -> Iterator[dict[str, Any]]:
    """A row for each policy."""
    for name in POLICIES:
        policy = load_policy(f"crazyflie/{name}")
        late = max(policy.contract.latency_of(VEHICLE) - LINK_S, 0.0)
        good, told = 0, list[str]()
        for i in range(count):
            rig = CrazyflieRig(VEHICLE, latency=late, seed=SEED + i)
            flight = whole_flight(rig, policy, whole_course(policy, VEHICLE), SEED + i, None, [], None)
            fine = flight.complete and flight.success
            good += fine
            told.append(flight.told if fine else f"{flight.told}: {flight.reasons}")
        yield {
            "flight": name, "good": f"{good} of {count}", "the last": told[-1],
            "what failed": "; ".join(text for text in told if ": (" in text),
        }  # fmt: skip


def faults(count: int) -> Iterator[dict[str, Any]]:
    """A row for each fault."""
    settings = dataclasses.replace(rehearsal_settings(1.0), battery_unknown=False)
    for fault in FAULTS:
        ends = []
        for i in range(count):
            rig = CrazyflieRig(VEHICLE, latency=0.02, seed=SEED + i)
            session = Session(rig, settings, hover=hover_controller("geometric", VEHICLE, 0.03))
            session.take_off(1.0 + 0.2 * i)
            ends.append(flown(rig, session, fault))
            session.close()
        acts = "firmware" if fault.autopilot_acts else "bridge"
        yield {
            "fault": fault.name, "acts": acts, "as documented": f"{sum(end.good for end in ends)} of {count}",
            "the last": ends[-1].told,
        }  # fmt: skip


def main() -> None:
    """Fly, print the tables, write the figures."""
    args = arguments(__doc__ or "", flights=10, faults=2)
    compute_at_once()
    prepare("cpu")
    found = {"flights": list(flights(args.flights)), "faults": list(faults(args.faults))}
    for rows in found.values():
        print(table(rows))
    write("crazyflie", args.json, {"table": found["flights"], "faults": found["faults"], "seed": SEED})


if __name__ == "__main__":
    main()
