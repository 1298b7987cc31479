"""Tasks: what a vehicle is to do, and when it has done it."""

from collections.abc import Callable

from e2efly.config import (
    AvoidConfig,
    GapConfig,
    HoverAwareConfig,
    HoverConfig,
    LandConfig,
    LandVisualConfig,
    RaceClutterConfig,
    RaceConfig,
    TaskConfig,
    TrackConfig,
)
from e2efly.tasks.avoid import Avoid
from e2efly.tasks.gap import Gap
from e2efly.tasks.hover import Hover
from e2efly.tasks.hover_aware import HoverAware
from e2efly.tasks.land import Land
from e2efly.tasks.land_visual import LandVisual
from e2efly.tasks.race import Race
from e2efly.tasks.race_clutter import RaceClutter
from e2efly.tasks.task import Outcome, Shape, Task
from e2efly.tasks.track import Track

_MAKERS: dict[type, Callable[..., Task]] = {
    HoverConfig: lambda config, shape, period, substeps: Hover(config, shape, period),
    LandConfig: lambda config, shape, period, substeps: Land(config, shape),
    LandVisualConfig: lambda config, shape, period, substeps: LandVisual(config, shape),
    TrackConfig: lambda config, shape, period, substeps: Track.of(config, shape),
    RaceConfig: lambda config, shape, period, substeps: Race.of(config, shape),
    RaceClutterConfig: RaceClutter.of,
    AvoidConfig: Avoid,
    GapConfig: Gap.of,
    HoverAwareConfig: lambda config, shape, period, substeps: HoverAware(config, shape, period),
}


def make_task(config: TaskConfig, shape: Shape, control_period: float, substeps: int = 1) -> Task:
    """The task of a configuration, for a vehicle of this shape, at this control period in s.

    Collisions with obstacles are checked `substeps` times a control step.

    Raises:
        ValueError: when the configuration names something that does not exist or is broken.
    """
    return _MAKERS[type(config)](config, shape, control_period, substeps)


__all__ = [
    "Avoid",
    "Gap",
    "Hover",
    "HoverAware",
    "Land",
    "LandVisual",
    "Outcome",
    "Race",
    "RaceClutter",
    "Shape",
    "Task",
    "Track",
    "make_task",
]
