"""The loop of `e2efly watch`: it shows frames at the right time and handles user inputs between them."""

import time
from collections.abc import Callable

from e2efly.viewing.watch.panels import Panel
from e2efly.viewing.watch.stage import Source
from e2efly.viewing.watch.viewer import Viewer

FASTEST = 1 / 33
"""Minimum mean time between frames, s. If a step is late, the next one is not delayed by it."""
IDLE_S = 0.05
"""Time between two checks of the user inputs while the flight is paused or nobody is watching, s."""


def run(
    source: Source,
    viewer: Viewer,
    panel: Panel,
    until: Callable[[], bool] = lambda: False,
    between: Callable[[], None] = lambda: None,
    watched: Callable[[], bool] = lambda: True,
) -> None:
    """Show a source until Ctrl-C.

    Args:
        source: the source of the frames.
        viewer: shows the vehicles.
        panel: shows the controls.
        until: returns whether the loop must end; called before every frame.
        between: called before every frame.
        watched: returns whether anybody is watching. The source pauses while nobody is.
    """  # fmt: skip
    due, turn, elapsed = time.monotonic(), 0.0, 0.0
    while not until():
        panel.fulfil()
        between()
        if panel.paused or not watched():
            time.sleep(IDLE_S)
            due = time.monotonic()
            continue
        frame = source.step(viewer.followed)
        elapsed += source.period
        now = time.monotonic()
        if now >= turn or frame.fresh:
            viewer.show(source.stage_of(viewer.followed), source.origin, frame, elapsed)
            panel.show(frame, elapsed)
            turn, elapsed = max(turn + FASTEST, now), 0.0
        due = max(due + source.period / panel.speed, now - 0.25)
        time.sleep(max(due - time.monotonic(), 0.0))
