"""Scenarios of a campaign: named ones, and those that chance makes of a seed."""

import json
from pathlib import Path

import numpy as np

from e2efly.flight.pilot.flight_state import Mode
from tests.faults.campaign import STRUCK_IN, Scenario
from tests.faults.injection import Flier, Parameters
from tests.faults.injections import KINDS, Strike

HEIGHTS = (0.7, 2.5)
"""Of drawn hovers, m."""
LATER_S = 3.0
"""The second and third fault begin within so long of the one before, s."""
FIRST_S = {Mode.TAKEOFF: 1.5, Mode.LAND: 1.5}
"""In these modes the first strikes within so long, s; in the others at once."""
WITH_FLIER = (Mode.HOVER, Mode.POLICY)
"""Where those strike that need another flier than the policy that hovers."""
FOR_EVER = 0.1
"""Chance that what usually ends does not."""


FLIERS = {Flier.POLICY: 0.8, Flier.SIGHT: 0.08, Flier.COMMANDS: 0.06, Flier.FILTER: 0.06}
"""Chances of who flies."""


def drawn(seed: int) -> Scenario:
    """Two or three kinds of faults, when and how, and a flight for them."""
    random = np.random.default_rng(seed)
    flier = list(FLIERS)[int(random.choice(len(FLIERS), p=list(FLIERS.values())))]
    modes = STRUCK_IN if flier is Flier.POLICY else WITH_FLIER
    mode = modes[int(random.integers(len(modes)))]
    own, anybodys = ([name for name, kind in KINDS.items() if kind.flier is who] for who in (flier, Flier.POLICY))
    first = [] if flier is Flier.POLICY else [str(random.choice(own))]
    left = [name for name in dict.fromkeys([*own, *anybodys]) if name not in first]
    names = [*first, *random.choice(left, int(random.integers(2, 4)) - len(first), replace=False)]
    at, strikes = float(random.uniform(0, FIRST_S.get(mode, 0.0))), []
    for name in map(str, names):
        kind = KINDS[name]
        lasts = None
        if kind.limited is not None and random.random() >= FOR_EVER:
            lasts = round(float(random.uniform(*kind.limited)), 2)
        strikes.append(Strike(name, round(at, 2), lasts, kind.draw(random)))
        at += float(random.uniform(0, LATER_S)) if random.random() < 0.5 else 0.0
    return Scenario(f"seed {seed}", str(mode), tuple(strikes), round(float(random.uniform(*HEIGHTS)), 2), seed)


def _case(name: str, mode: Mode, height: float, *strikes: Strike, seed: int = 0) -> Scenario:
    return Scenario(name, str(mode), strikes, height, seed)


def _pose(kind: str, at: float = 0.0, **parameters: object) -> Strike:
    return Strike(f"poses: {kind}", at, None, parameters)


def _without(seconds: float) -> Strike:
    return Strike("poses: none", seconds)


def _told(factor: float) -> Strike:
    parameters: Parameters = {"factor": factor}
    return Strike("accelerometer as told: z scaled", 0.0, None, parameters)


_ABSENT = _pose("velocity", how="absent")
CASES = (
    *(
        _case(f"accelerometer z times {factor:g}, poses lost {word}", Mode.HOVER, 2.5, _told(factor), _without(later))
        for factor in (0.98, 0.97, 0.95, 0.93, 0.9, 1.1, 1.15, -1.0, 0.0)
        for later, word in ((0.0, "with it"), (3.0, "3 s later"))
    ),
    *(
        _case(f"accelerometer z times {factor:g} on the ground, poses lost in flight", Mode.INIT, 1.5, _told(factor),
              _without(6.0))
        for factor in (-1.0, 0.0)
    ),
    *(
        _case(f"poses: {word} from the ground, {how}", Mode.INIT, 1.0, strike, *more)
        for word, strike in (
            ("NED and FRD", _pose("NED and FRD")),
            *((f"{axis} mirrored", _pose("mirrored", axis=axis)) for axis in ("x", "y", "z", "yaw")),
            ("quaternion xyzw", _pose("quaternion xyzw")),
            ("quaternion conjugated", _pose("quaternion conjugated")),
        )
        for how, more in (("with velocity", ()), ("pose only", (_ABSENT,)))
    ),
    _case("poses: velocity negated from the ground", Mode.INIT, 1.0, _pose("velocity", how="negated")),
    _case("poses: velocity zero from the ground", Mode.INIT, 1.0, _pose("velocity", how="zero")),
    _case("poses: velocity negated in hover", Mode.HOVER, 1.0, _pose("velocity", how="negated")),
    _case("poses: velocity zero in hover", Mode.HOVER, 1.0, _pose("velocity", how="zero")),
    _case("poses: 5 Hz from the ground", Mode.INIT, 1.0, _pose("slow", rate=5)),
    _case("poses: gaps of 0.12 s twice a second from the ground", Mode.INIT, 1.0, _pose("gaps", gap=0.12, period=0.5)),
    *(
        _case(f"link: silent for {seconds:g} s in a quiet hover", Mode.HOVER, 0.8, Strike("link: silent", 2.0, seconds))
        for seconds in (1.0, 2.2, 3.0, 4.0, 5.0)
    ),
    *(
        _case(f"poses: {delay:g} s late from the ground{', again' * seed}", Mode.INIT, 1.0, _pose("late", delay=delay),
              seed=seed)
        for delay in (0.05, 0.1, 0.15, 0.2, 0.3)
        for seed in range(2 if delay == 0.15 else 1)
    ),
    *(
        _case(f"poses: {delay:g} s late in hover", Mode.HOVER, 1.0, _pose("late", delay=delay))
        for delay in (0.05, 0.15, 0.3)
    ),
    _case("receiver silent for good", Mode.HOVER, 1.0, Strike("receiver: silent")),
    _case("battery sags to 0.8 within 3 s", Mode.HOVER, 1.0,
          Strike("battery: sag", 0.0, None, {"share": 0.8, "within": 3.0})),
    _case("controller reboots", Mode.HOVER, 1.0, Strike("controller: reboots", 0.0, 1.0)),
    _case("link: 55 ms late, poses lost", Mode.HOVER, 2.4,
          Strike("link: late", 0.0, 2.0, {"value": 0.055}), _without(0.0)),
    _case("link: seven answers of ten spoilt, poses lost", Mode.HOVER, 1.2,
          Strike("link: spoilt", 0.0, 8.0, {"value": 0.7}), _without(0.5)),
    _case("link: silent for 0.7 s, poses lost with it", Mode.HOVER, 1.4,
          Strike("link: silent", 0.0, 0.7), _without(0.0)),
    _case("accelerometer frozen, receiver silent for 0.5 s with it", Mode.POLICY, 1.4,
          Strike("accelerometer as told: frozen"), Strike("receiver: silent", 0.0, 0.5)),
    _case("accelerometer frozen in the take-off", Mode.TAKEOFF, 1.5, Strike("accelerometer as told: frozen", 0.3)),
    _case("one motor at 0.85", Mode.HOVER, 1.0, Strike("motor: weak", 0.0, None, {"motor": 1, "share": 0.85})),
    *map(Scenario.of, json.loads(Path(__file__).with_name("found.json").read_text(encoding="utf-8"))),
)  # fmt: skip
"""Single faults, what an adversary found first, and what chance found: as data, because a seed's flight changes with
the list of kinds."""
