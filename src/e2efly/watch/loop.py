"""The loop of `e2efly watch`: frames at their time, wishes in between."""

import time
from collections.abc import Callable

from e2efly.watch.frames import Source
from e2efly.watch.panels import Panel
from e2efly.watch.viewer import Viewer

FASTEST = 1 / 33
"""Frames are shown no more often than this on average, s: a step that came late makes the next one no later."""
IDLE_S = 0.05
"""Between two looks at the wishes while the flight is paused, or while nobody looks at it, s."""


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
        source: of the frames.
        viewer: of the vehicles.
        panel: of the controls.
        until: whether it is to end; asked before every frame.
        between: called before every frame.
        watched: whether anybody looks; the source rests while nobody does.
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
