"""One setting of the flight controller, as `e2efly fly --check` reports it."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One setting, as one row of the table."""

    setting: str
    """Its name in the controller's command line, or a description."""
    value: str
    """Its value."""
    needed: str
    """The value that the flight needs."""
    good: bool
    """Whether the value is as needed."""
    mend: tuple[str, ...] = ()
    """Whole lines for the controller's command line that correct it."""
    told: bool = True
    """Whether the controller reports the setting, and the report decides. If not, the pilot should look, and type
    `mend` unless it is better as it is."""

    @property
    def problem(self) -> str:
        """What is wrong, in words."""
        how = f" ({'; '.join(self.mend)})" if self.mend else ""
        return f"{self.setting} is {self.value}; needed: {self.needed}{how}"


def problems(rows: Iterable[Row]) -> tuple[str, ...]:
    """The problems that forbid a take-off."""
    return tuple(row.problem for row in rows if not row.good)


def command_lines(rows: Iterable[Row]) -> tuple[str, ...]:
    """The lines of `mend`, each of them once."""
    return tuple(dict.fromkeys(line for row in rows for line in row.mend))
