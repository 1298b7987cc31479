"""What the benchmarks of autopilots share: whole flights, faults in a hover, their options and their figures."""

import argparse
import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import Any

from common import arguments, table, with_earlier, write
from tests.validation.link_faults import Fault, flown

from e2efly.flight.pilot.hovering import hover_controller
from e2efly.policy.loader import load_policy
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.tasks.route import Route, route_of
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rehearsal import LINK_S, parked, whole_course, whole_flight
from e2efly.validation.world import FlownBody, World
from e2efly.vehicles.vehicle import Vehicle

Place = Callable[[World], FlownBody]
"""Where the vehicle stands when its autopilot starts."""
Opens = Callable[[float, int, Place | None, Fault | None], AbstractContextManager[Any]]
"""Makes a vehicle under an autopilot, from the latency of its poses, s, seed, place, and the fault that will strike."""


@dataclass(frozen=True)
class LinkBench:
    """What is flown."""

    name: str
    """Of the results."""
    vehicle: Vehicle
    policies: Mapping[str, tuple[str, Mapping[str, Any]]]
    """Policy and goal of each row."""
    faults: Sequence[Fault]
    height: float
    """Of the hover in which faults strike, m."""
    seed: int

    @property
    def names(self) -> list[str]:
        """Of flights and faults, in the order of the tables."""
        return [*self.policies, *(fault.name for fault in self.faults)]

    def options(self, about: str, *, flights: int, faults: int, **more: Any) -> argparse.Namespace:
        """The command line: how often each is flown, which of them, and from which seed on."""
        asked = arguments(about, only=self.names, flights=flights, faults=faults, seed=self.seed, **more)
        if unknown := set(asked.only) - set(self.names):
            raise SystemExit(f"--only is {unknown}; accepted: {self.names}")
        return asked

    def measure(self, asked: argparse.Namespace, autopilots: Mapping[str, Opens], **about: Any) -> None:
        """Fly what is asked for, print each row, and write the figures after each. Rows of others stay in the file."""
        compute_at_once()
        prepare("cpu")
        for part, key, rows in (
            ("table", "flight", self._flights(asked, autopilots)), ("faults", "fault", self._faults(asked, autopilots)),
        ):  # fmt: skip
            other = "faults" if part == "table" else "table"
            for row in rows:
                print(table([row]), flush=True)
                every = {one[key]: one for one in with_earlier(self.name, asked.json, part, (key,), [row])}
                found = {part: [every[name] for name in self.names if name in every]}
                found[other] = with_earlier(self.name, asked.json, other, (), [])
                write(self.name, asked.json, {**about, **found})

    def _flights(self, asked: argparse.Namespace, autopilots: Mapping[str, Opens]) -> Iterator[dict[str, Any]]:
        for name, (policy_name, goal) in self.policies.items():
            if name not in asked.only:
                continue
            policy = load_policy(policy_name)
            usual: Route = route_of(policy.contract)()
            route = dataclasses.replace(usual, outside=True, **usual.whole, **goal) if goal else None
            course = whole_course(policy, self.vehicle, route)
            late = max(policy.contract.latency_of(self.vehicle) - LINK_S, 0.0)
            row: dict[str, Any] = {"flight": name, "seed": asked.seed}
            for who, opens in autopilots.items():
                ends = []
                for seed in range(asked.seed, asked.seed + asked.flights):
                    with opens(late, seed, partial(parked, course=course, seed=seed), None) as rig:
                        flight = whole_flight(rig, policy, course, seed, None, [], None)
                    good = flight.complete and flight.success
                    ends.append((good, flight.told if good else f"{flight.told}: {flight.reasons}"))
                row |= _columns(who, ends)
            yield row

    def _faults(self, asked: argparse.Namespace, autopilots: Mapping[str, Opens]) -> Iterator[dict[str, Any]]:
        settings = dataclasses.replace(rehearsal_settings(self.height), battery_unknown=False)
        for fault in self.faults:
            if fault.name not in asked.only:
                continue
            row: dict[str, Any] = {"fault": fault.name, "seed": asked.seed}
            row["acts"] = "autopilot" if fault.autopilot_acts else "bridge"
            for who, opens in autopilots.items():
                ends = []
                for i in range(asked.faults):
                    with opens(0.02, asked.seed + i, None, fault) as rig:
                        session = Session(rig, settings, hover=hover_controller("geometric", self.vehicle, 0.03))
                        if session.take_off(1.0 + 0.2 * i):
                            end = flown(rig, session, fault)
                            ends.append((end.good, end.told))
                        else:
                            ends.append((False, f"no take-off: {session.bridge.flight.reasons}"))
                        session.close()
                row |= _columns(who, ends)
            yield row


def _columns(who: str, ends: list[tuple[bool, str]]) -> dict[str, str]:
    """What a table says of flights: how many were good, how the last went, and how those that failed."""
    return {
        who: f"{sum(good for good, _ in ends)} of {len(ends)}",
        f"{who}, the last": ends[-1][1],
        f"{who}, what failed": "; ".join(told for good, told in ends if not good),
    }
