"""What a flight needs of a Crazyflie's parameters, and what it does when commands end."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from e2efly.flight.row import Row

PROTOCOL = 10
"""The first version of CRTP with set-points of rates and thrust that need no parameter: firmware 2025.09 ..."""
NEWEST = 12
"""... and the last that was read: firmware 2026.08."""
LEVEL_S, OFF_S = 0.5, 2.0
"""After the last set-point it levels, and stops its motors, s: constants of the firmware's supervisor."""


@dataclass(frozen=True)
class NeededParameter:
    """What a flight needs of one parameter."""

    name: str
    good: Callable[[float], bool]
    needed: str
    """In words: what is needed, and why."""
    meaning: Callable[[float], str] = lambda value: ""
    """What a value means."""
    optional: bool = False
    """Not every version has it."""

    def row(self, parameters: Mapping[str, float]) -> Row:
        """The parameter as a row of the table. There is no command line: it is set in Bitcraze's client."""
        if self.name not in parameters:
            return Row(self.name, "not told", self.needed, self.optional, told=not self.optional)
        value = parameters[self.name]
        said = self.meaning(value)
        return Row(self.name, f"{value:g}" + (f": {said}" if said else ""), self.needed, self.good(value))


def _named(*names: str) -> Callable[[float], str]:
    return lambda value: names[int(value)] if 0 <= value < len(names) else "unknown"


NEEDS = (
    NeededParameter(
        "stabilizer.controller", lambda value: value == 1, "1, PID: it follows body rates",
        _named("chosen at the start", "PID", "Mellinger", "INDI", "Brescianini", "Lee"),
    ),
    NeededParameter(
        "stabilizer.estimator", lambda value: value in (1, 2, 3), "any; 2, Kalman, takes the poses",
        _named("chosen at the start", "complementary: takes no poses", "Kalman", "UKF"),
    ),
    NeededParameter("stabilizer.stop", lambda value: value == 0, "0: or the motors stay stopped"),
    NeededParameter(
        "supervisor.tmblChckEn", lambda value: True,
        "any; not 0: it stops its motors after 1 s with less than 0.5 g along body z, or 0.1 s with less than -0.2 g",
        lambda value: "tumbling stops the motors" if value else "tumbling does not stop the motors",
    ),
    NeededParameter(
        "supervisor.prefltTimeout", lambda value: value >= 5000,
        "at least 5000 ms: where it has to be armed, it disarms when no take-off follows in this time", optional=True,
    ),
    NeededParameter(
        "supervisor.landedTimeout", lambda value: True, "any: it disarms this long after a landing, ms", optional=True
    ),
    NeededParameter("locSrv.extPosStdDev", lambda value: 0 < value <= 0.1, "at most 0.1 m: how far it trusts a pose"),
    NeededParameter("locSrv.extQuatStdDev", lambda value: 0 < value <= 0.5, "at most 0.5 rad: the same for attitudes"),
)  # fmt: skip
"""The parameters that are read."""


def behaviour(parameters: Mapping[str, float]) -> tuple[Row, ...]:
    """What it does when program, link or poses end, as rows of the table."""
    by = {
        1: "level and by the barometer; it drifts",
        2: "by its own position: without one from on board, it drifts",
    }.get(int(parameters.get("stabilizer.estimator", 0)), "by its own position")
    return (
        Row(
            "this program dies", f"its watchdog has the firmware land it, {by}. With --no-watchdog: as below",
            "room to land below the flight", True,
        ),
        Row(
            "the link is lost",
            f"holds the last rates for {LEVEL_S:g} s, then level with the last thrust; {OFF_S:g} s after the last "
            "command its motors stop and it falls; locked until it is switched off",
            "read it: the firmware has no landing for this, so fly low, over something soft", True,
        ),
        Row("the poses end", "this program lands it by accelerometer, attitude and thrust", "any", True),
        Row(
            "the pilot", "this terminal: arm, hover, policy, off (motors stop), each with Enter; any other line lands",
            "somebody at this terminal who watches the vehicle", True,
        ),
    )  # fmt: skip


def firmware_row(protocol: int, firmware: str) -> Row:
    """The version as a row of the table. One that nobody has read is refused."""
    return Row(
        "firmware", f"{firmware}, CRTP {protocol}", f"CRTP {PROTOCOL} to {NEWEST} (firmware 2025.09 to 2026.08)",
        PROTOCOL <= protocol <= NEWEST,
    )  # fmt: skip
