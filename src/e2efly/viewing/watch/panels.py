"""The panel of the page: buttons, sliders, pictures and plots. The loop receives user inputs as functions to call."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

import numpy as np

from e2efly.viewing.watch.stage import StageFrame
from e2efly.viewing.watch.viewer import CAMERAS, Viewer

if TYPE_CHECKING:
    from e2efly.viewing.watch.recorded import Recording
    from e2efly.viewing.watch.report import ShownReport
    from e2efly.viewing.watch.simulation import Simulation
    from e2efly.viewing.watch.training import ShownProgress

SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "4")
"""Speeds of the flight, relative to real time."""
PLOT_S = 5.0
"""Length of the flight that a plot shows, s."""
PLOT_EVERY, IMAGE_EVERY = 3, 2
"""Number of frames between updates of the plots, and of the images."""
LARGEST_WIND = 10.0
"""Largest wind that can be set, m/s per axis."""
PIXELS = 240
"""Width of an image in the panel, pixels."""
LONGEST = 2000
"""The longest text in the panel, characters."""


class Panel:
    """Controls of the flight and of the view."""

    def __init__(self, viewer: Viewer) -> None:
        """Add the controls to the viewer's page."""
        self.viewer, self.wishes = viewer, SimpleQueue[Callable[[], Any]]()
        self.paused, self.speed = False, 1.0
        gui = self._gui = viewer.server.gui
        self._tell = self.text()
        self._tell("Waiting for the first frame")
        self._pause = gui.add_button("Pause")
        self._pause.on_click(lambda _: self.wishes.put(self._toggle))
        speed = gui.add_dropdown("Speed", SPEEDS, initial_value="1")
        speed.on_update(lambda _: self.wishes.put(lambda: setattr(self, "speed", float(speed.value))))
        camera = gui.add_dropdown("Camera", CAMERAS, initial_value=CAMERAS[0])
        camera.on_update(lambda _: self.wishes.put(lambda: self._look(camera.value)))
        self._frames = 0
        self._time = 0.0
        self._images: dict[str, Any] = {}
        self._plots: dict[str, Any] = {}
        self._past: dict[str, deque[tuple[float, ...]]] = {}
        self._shown = ""

    def text(self) -> Callable[[str], None]:
        """Add a text, empty at first. Returns the function that changes it.

        The page is given markup here and nowhere else, because viser shows HTML in markdown as HTML.
        """
        shown = self._gui.add_markdown("")
        return lambda text: setattr(shown, "content", as_markdown(text))

    def choose_among(self, count: int) -> None:
        """Add a slider that chooses which of `count` vehicles is followed, unless there is only one."""
        if count > 1:
            followed = self._gui.add_slider("Vehicle", min=0, max=count - 1, step=1, initial_value=0)
            followed.on_update(lambda _: self.wishes.put(lambda: self.viewer.follow(int(followed.value))))

    def button(self, label: str, wish: Callable[[], Any]) -> None:
        """Add a button."""
        self._gui.add_button(label).on_click(lambda _: self.wishes.put(wish))

    def slider(
        self, label: str, low: float, high: float, step: float, value: float, wish: Callable[[float], Any]
    ) -> Any:
        """Add a slider. When it is moved, the loop calls `wish` with its value."""
        slider = self._gui.add_slider(label, min=low, max=high, step=step, initial_value=value)
        slider.on_update(lambda _: self.wishes.put(lambda: wish(float(slider.value))))
        return slider

    def folder(self, label: str) -> Any:
        """A part of the panel, as a context manager."""
        return self._gui.add_folder(label)

    def fulfil(self) -> None:
        """Carry out the user inputs since the last call."""
        while not self.wishes.empty():
            self.wishes.get()()

    def show(self, frame: StageFrame, elapsed: float) -> None:
        """Show the data of a frame other than the positions of the vehicles."""
        if frame.note != self._shown:
            self._shown = frame.note
            self._tell(frame.note)
        self._time += elapsed
        if self._frames % IMAGE_EVERY == 0:
            self._show_images(frame)
        for title, values in frame.series.items():
            room = self._past.setdefault(title, deque())
            room.append((self._time, *values))
            while room[0][0] < self._time - PLOT_S:
                room.popleft()
        if self._frames % PLOT_EVERY == 0:
            self._plot()
        self._frames += 1

    def _toggle(self) -> None:
        self.paused = not self.paused
        self._pause.label = "Go on" if self.paused else "Pause"

    def _look(self, camera: Any) -> None:
        self.viewer.camera = camera
        self.viewer.follow(self.viewer.followed)

    def _show_images(self, frame: StageFrame) -> None:
        for name, image in frame.images.items():
            picture = _enlarged(image)
            if name in self._images:
                self._images[name].image = picture
            else:
                self._images[name] = self._gui.add_image(picture, label=name)

    def _plot(self) -> None:
        from viser import uplot

        for title, room in self._past.items():
            rows = np.array(room)
            data = tuple(np.ascontiguousarray(column) for column in rows.T)
            if title in self._plots:
                self._plots[title].data = data
                continue
            names = ("commanded", "flown") if rows.shape[1] == 3 else (title,)
            colours = ("#E69F00", "#222222")[-len(names) :]
            self._plots[title] = self._gui.add_uplot(
                data,
                (
                    uplot.Series(label="s"),
                    *(uplot.Series(label=n, stroke=c, width=1.5) for n, c in zip(names, colours, strict=True)),
                ),
                title=title, aspect=2.4, scales={"x": uplot.Scale(time=False, auto=True)},
            )  # fmt: skip


def as_markdown(text: str) -> str:
    """Markdown that shows a text as it is. Each character becomes a reference to its number, which is never markup.

    Line ends stay. A text of more than `LONGEST` characters is cut, and ends with dots.
    """
    cut = text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
    return "  \n".join("".join(f"&#{ord(character)};" for character in line) for line in cut.splitlines())


def _enlarged(image: np.ndarray) -> np.ndarray:
    """The image enlarged, uint8. A grey image is scaled from its smallest to its largest value."""
    x = np.asarray(image, np.float32)
    if x.ndim == 2:
        low, high = float(np.nanmin(x)), float(np.nanmax(x))
        x = np.repeat(((x - low) / max(high - low, 1e-6))[..., None], 3, axis=-1)
    times = max(1, PIXELS // x.shape[1])
    return np.repeat(np.repeat(np.rint(255 * np.clip(x, 0, 1)).astype(np.uint8), times, 0), times, 1)


def hands_on(panel: Panel, simulation: "Simulation") -> None:
    """Add the controls of a simulation: new starts, throws, wind, mass, thrust, delay, and a goal that can be dragged.

    Args:
        panel: the panel of the page.
        simulation: a `Simulation`.
    """
    from e2efly.viewing.watch.simulation import LATEST

    panel.button("Start anew", simulation.begin)
    panel.button("Throw", simulation.throw)

    def change(**values: Any) -> None:
        simulation.hands = replace(simulation.hands, **values)

    def blow(axis: int, speed: float) -> None:
        wind = np.nan_to_num(np.asarray(simulation.hands.wind, np.float32))
        wind[axis] = speed
        change(wind=wind)

    with panel.folder("Disturb"):
        for axis, name in enumerate(("x", "y")):
            panel.slider(f"Wind {name} (m/s)", -LARGEST_WIND, LARGEST_WIND, 0.5, 0.0, partial(blow, axis))
        panel.slider("Mass (%)", 50, 200, 5, 100, lambda x: change(mass=x / 100))
        panel.slider("Thrust (%)", 50, 150, 5, 100, lambda x: change(thrust=x / 100))
        nominal = 1e3 * simulation.env.latency
        panel.slider("Delay (ms)", 0, 1e3 * LATEST, 5, 5 * round(nominal / 5), lambda x: change(delay=x / 1e3))
    _drag(panel, simulation)


def _drag(panel: Panel, simulation: "Simulation") -> None:
    """Add arrows that move the goal and, with it, the task's world."""
    arrows = panel.viewer.server.scene.add_transform_controls(
        "/world/move", 0.5, active_axes=(True, True, not simulation.levels), disable_rotations=True,
        disable_sliders=True, position=tuple(map(float, simulation.goal_now(0))),
    )  # fmt: skip
    last = np.array(arrows.position, float)

    def move(place: np.ndarray) -> None:
        simulation.move(place - last)
        last[:] = place

    arrows.on_update(lambda _: panel.wishes.put(partial(move, np.array(arrows.position, float))))


def policies_on(panel: Panel, progress: "ShownProgress") -> Callable[[], None]:
    """Add the controls of a run's policies: always the newest, or one of the older ones.

    Args:
        panel: the panel of the page.
        progress: the `Progress` of the run.

    Returns:
        A function to call between frames. It looks for new policies.
    """
    gui = panel.viewer.server.gui
    with panel.folder("Policies of the run"):
        newest = gui.add_checkbox("Newest as it comes", True)
        told = panel.text()
        slider = gui.add_slider("Policy", min=0, max=max(len(progress.updates) - 1, 1), step=1, initial_value=0)

    def tell() -> None:
        told(f"Update {progress.update} of {progress.setup.updates}, {len(progress.updates)} policies")

    def choose(place: float) -> None:
        if progress.newest or not progress.updates:
            return
        progress.fly(progress.updates[min(int(place), len(progress.updates) - 1)])
        tell()

    def follow(value: bool) -> None:
        progress.newest = value
        if value and progress.updates:
            progress.fly(progress.updates[-1])
            tell()
        else:
            choose(slider.value)

    newest.on_update(lambda _: panel.wishes.put(lambda: follow(bool(newest.value))))
    slider.on_update(lambda _: panel.wishes.put(lambda: choose(slider.value)))
    tell()

    def between() -> None:
        if progress.look():
            slider.max = max(len(progress.updates) - 1, 1)
            tell()

    return between


def times_on(panel: Panel, recording: "Recording") -> Callable[[], None]:
    """Add a slider for the time of a recording.

    Args:
        panel: the panel of the page.
        recording: a `Recording`.

    Returns:
        A function to call between frames. It moves the slider forward.
    """

    def end() -> float:
        return max(round(recording.length * recording.period, 2), 0.1)

    slider = panel.viewer.server.gui.add_slider("Time (s)", min=0.0, max=end(), step=0.05, initial_value=0.0)
    moved = [0.0]

    def seek(event: Any) -> None:
        if event.client is None:  # moved by the flight itself
            return
        time = float(slider.value)
        panel.wishes.put(lambda: setattr(recording, "at", min(int(time / recording.period), recording.length - 1)))

    slider.on_update(seek)

    def between() -> None:
        now = recording.at * recording.period
        if abs(now - moved[0]) > 0.25:
            moved[0] = now
            slider.value = min(now, slider.max)
        if slider.max != end():  # another start
            slider.value = min(now, end())
            slider.max = end()

    return between


def starts_on(panel: Panel, recording: "Recording", starts: "Sequence[ShownReport]") -> None:
    """Add a menu to choose the start of a report whose flights are shown.

    Args:
        panel: the panel of the page.
        recording: the recording of the first start.
        starts: the starts of the report.
    """
    by_name = {start.name: start for start in starts}
    choice = panel.viewer.server.gui.add_dropdown("Start", tuple(by_name), initial_value=starts[0].name)

    def choose(name: str) -> None:
        recording.fly(by_name[name].flights, by_name[name].stage)

    choice.on_update(lambda _: panel.wishes.put(partial(choose, choice.value)))
