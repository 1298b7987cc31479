"""Flights at walls through the real firmware, for benchmarks/filter.py: a commander in place of a policy."""

import dataclasses
import math
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import common  # noqa: F401  (finds the fault laboratory)
import numpy as np
from tests.faults.commanders import VEHICLE, Commands, Field, at
from tests.flight.command_streams import Loopback

from e2efly.flight.pilot.flight_state import Mode
from e2efly.flight.settings import Fence
from e2efly.validation import firmware_program
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rig import Rig
from e2efly.vehicles.gravity import GRAVITY

FENCE = Fence(low=(-2.5, -2.5, 0.4), high=(2.5, 2.5, 3.5), speed=5.0, tilt=1.2)
LATENCY, SECONDS = 0.08, 2.5
"""Of the poses; a flight at a wall, s. Link and firmware take 10 ms more."""
PER_RIG = 20
"""Flights of one take-off."""


def attack(random: np.random.Generator) -> Commands:
    """Lean one way, or change at random, with a thrust of its own."""
    kind = random.integers(3)
    roll, pitch = random.uniform(-0.75, 0.75, 2)
    lift = random.uniform(0.6, 1.6) if kind else 1.0
    rates = random.uniform(-2.0, 2.0, (20, 3)).tolist()

    def told(t: float) -> dict[str, Any]:
        if kind == 2:
            return {"mode": "ctbr", "thrust": GRAVITY * lift, "body_rate": rates[int(t / 0.15) % 20]}
        thrust = lift * GRAVITY / (math.cos(roll) * math.cos(pitch))
        return {"mode": "attitude", "thrust": thrust, "attitude": [roll, pitch, 0.0]}

    return told


def through_firmware(count: int) -> dict[str, Any]:
    """Fly so many, each from the middle of the room; what was seen of them."""
    gaps, ended, speeds, breaches, seed = list[float](), list[str](), list[float](), 0, -1
    settings = dataclasses.replace(rehearsal_settings(1.5), fence=FENCE)
    while len(gaps) < count:
        seed += 1
        random = np.random.default_rng(seed)
        with tempfile.TemporaryDirectory(prefix="e2efly-") as folder, ExitStack() as opened:
            rig = Rig(firmware_program.chosen(), Path(folder), VEHICLE, latency=LATENCY, seed=seed)
            link = opened.enter_context(Loopback())
            opened.enter_context(rig)
            rig.sleep(0.5)
            flight = Field(rig, link)
            flight.session.close()
            flight.session = Session(rig, settings, commands=link, filtered=True)
            opened.callback(flight.session.close)
            if not flight.session.take_off(1.0):
                raise OSError(f"the firmware does not take off: {flight.session.bridge.flight.reasons}")
            for _ in range(min(PER_RIG, count - len(gaps))):
                rig.set(mission="hover")
                flight.session.fly(2.0)
                if flight.mode is not Mode.HOVER:
                    break
                inside = np.clip(flight.position, np.add(FENCE.low, 0.3), np.subtract(FENCE.high, 0.3))
                try:
                    flight.hand_over(at(*inside.tolist()))
                except AssertionError:  # too near to a limit: from the ground again
                    break
                flight.command(2.0, at(*(0.5 * inside + [0.0, 0.0, 0.75]).tolist()))  # farther off would be refused
                flight.command(3.0, at(0.0, 0.0, 1.5))
                flown = flight.session.flown
                begun, since = len(flown.time), rig.now()
                flight.command(SECONDS, attack(random))
                places = np.array(flown.position[begun:])
                gaps.append(float(np.minimum(places - FENCE.low, np.array(FENCE.high) - places).min()))
                speeds.append(float(np.linalg.norm(flown.velocity[begun:], axis=1).max()))
                steepest = math.acos(min(flown.tilt_cosine[begun:]))
                breaches += gaps[-1] < 0 or speeds[-1] > FENCE.speed or steepest > FENCE.tilt
                if flight.mode is not Mode.POLICY:
                    ended.append(
                        next("; ".join(why) for at, mode, why in flown.changes if at > since and mode != "policy")
                    )
                    print(f"{gaps[-1]:.2f} m: {ended[-1]}", flush=True)
        print(f"{len(gaps)} flights through the firmware, nearest {min(gaps):.2f} m, {len(ended)} ended", flush=True)
    return {
        "through the firmware": len(gaps), "breaches": int(breaches), "ended in HOVER": len(ended),
        "why": "; ".join(sorted(set(ended))) or "-", "nearest to the fence": f"{min(gaps):.2f} m",
        "top speed": f"{max(speeds):.1f} m/s", "delay": f"{LATENCY + 0.01:g} s",
    }  # fmt: skip
