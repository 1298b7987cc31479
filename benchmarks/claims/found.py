"""What was measured of an experiment, and how to find it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Found:
    """What was measured of an experiment."""

    runs: Sequence[Mapping[str, Any]]
    """As `e2efly`'s processes left them, see `benchmarks/claims/running.py`."""
    results: Callable[[str], dict[str, Any] | None] = lambda name: None
    """The results of another benchmark by the name of its file; None: there are none."""

    def of(self, **wanted: Any) -> list[Mapping[str, Any]]:
        """The runs with these values, by seed."""
        fits = (one for one in self.runs if all(one[name] == value for name, value in wanted.items()))
        return sorted(fits, key=lambda one: one["seed"])

    def flown(self, flight: str, figure: str = "success", **wanted: Any) -> list[float]:
        """A figure of a flight of each run: of its worst criterion."""
        least = min if figure == "success" else max
        runs = (one["flights"][flight] for one in self.of(**wanted) if flight in one["flights"])
        return [least(criterion[figure] for criterion in of.values()) for of in runs]
