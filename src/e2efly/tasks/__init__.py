"""Tasks: hover, land, track, race."""

from collections.abc import Callable

from e2efly.config import HoverConfig, LandConfig, RaceConfig, TaskConfig, TrackConfig
from e2efly.tasks.hover import Hover
from e2efly.tasks.land import Land
from e2efly.tasks.race import Race
from e2efly.tasks.task import Outcome, Shape, Task
from e2efly.tasks.track import Track

_MAKERS: dict[type, Callable[..., Task]] = {
    HoverConfig: lambda config, shape, period: Hover(config, shape, period),
    LandConfig: lambda config, shape, period: Land(config, shape),
    TrackConfig: lambda config, shape, period: Track.of(config, shape),
    RaceConfig: lambda config, shape, period: Race.of(config, shape),
}


def make_task(config: TaskConfig, shape: Shape, control_period: float) -> Task:
    """The task of a configuration, for a vehicle of this shape, at this control period in s.

    Raises:
        ValueError: when the configuration names something that does not exist or is broken.
    """
    return _MAKERS[type(config)](config, shape, control_period)


__all__ = ["Hover", "Land", "Outcome", "Race", "Shape", "Task", "Track", "make_task"]
