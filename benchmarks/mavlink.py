"""Whole flights and faults over MAVLink: PX4 and ArduCopter as they document themselves, over our rigid body.

    python benchmarks/mavlink.py [--flights 20] [--faults 5] [--json FILE]

The autopilots are `tests/flight/mavlink_peer.py`: pymavlink's frames, a rate loop, modes and time-outs of their own, in
virtual time. No firmware flies here. Each policy of the zoo flies whole flights: take-off, hover, policy, landing. Then
each of twenty faults begins in a hover, and the flight must end as documented: by the autopilot's failsafe where it has
to act, by the bridge where not. Seeds 7000000 and following; those of the tests were looked at while this was written.
"""

import dataclasses
from collections.abc import Iterator
from typing import Any

from common import arguments, table, write
from tests.flight.mavlink_peer import MavlinkRig
from tests.validation.link_faults import flown
from tests.validation.mavlink_faults import FAULTS

from e2efly.flight.pilot.hovering import hover_controller
from e2efly.policy.loader import load_policy
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.tasks.route import Route, route_of
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rehearsal import LINK_S, whole_course, whole_flight
from e2efly.vehicles.loading import load_vehicle

SEED = 7000000
KINDS = {"px4": "PX4", "copter": "ArduCopter"}
VEHICLE = load_vehicle("vis_r")
POLICIES: dict[str, tuple[str, dict[str, Any]]] = {
    "hover": ("hover", {}),
    "land": ("land", {}),
    "circle": ("track", {}),
    "lemniscate": ("track", {"reference": "lemniscate"}),
    "race": ("race", {}),
}
"""Policy and goal of each row."""


def flights(count: int) -> Iterator[dict[str, Any]]:
    """A row for each policy."""
    for name, (policy_name, goal) in POLICIES.items():
        policy = load_policy(policy_name)
        row: dict[str, Any] = {"flight": name}
        for kind, called in KINDS.items():
            good, told = 0, []
            for i in range(count):
                rig = MavlinkRig(kind, VEHICLE, latency=max(policy.contract.latency_of(VEHICLE) - LINK_S, 0.0),
                                 seed=SEED + i)  # fmt: skip
                usual: Route = route_of(policy.contract)()
                route = dataclasses.replace(usual, outside=True, **usual.whole, **goal) if goal else None
                flight = whole_flight(rig, policy, whole_course(policy, VEHICLE, route), SEED + i, None, [], None)
                good += flight.complete and flight.success
                told.append(flight.told if flight.complete and flight.success else f"{flight.told}: {flight.reasons}")
            row |= {called: f"{good} of {count}", f"{called}, the last": told[-1]}
            row[f"{called}, what failed"] = "; ".join(text for text in told if ": (" in text)
        yield row


def faults(count: int) -> Iterator[dict[str, Any]]:
    """A row for each fault."""
    settings = dataclasses.replace(rehearsal_settings(1.2), battery_unknown=False)
    for fault in FAULTS:
        row: dict[str, Any] = {"fault": fault.name, "acts": "autopilot" if fault.autopilot_acts else "bridge"}
        for kind, called in KINDS.items():
            ends = []
            for i in range(count):
                rig = MavlinkRig(kind, VEHICLE, latency=0.02, seed=SEED + i)
                session = Session(rig, settings, hover=hover_controller("geometric", VEHICLE, 0.03))
                session.take_off(1.0 + 0.2 * i)
                ends.append(flown(rig, session, fault))
                session.close()
            row |= {called: f"{sum(end.good for end in ends)} of {count}", f"{called}, the last": ends[-1].told}
        yield row


def main() -> None:
    """Fly, print the tables, write the figures."""
    args = arguments(__doc__ or "", flights=20, faults=5)
    compute_at_once()
    prepare("cpu")
    found = {"flights": list(flights(args.flights)), "faults": list(faults(args.faults))}
    for rows in found.values():
        print(table(rows))
    write("mavlink", args.json, {"table": found["flights"], "faults": found["faults"], "seed": SEED})


if __name__ == "__main__":
    main()
