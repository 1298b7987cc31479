"""`e2efly watch`: flights in a browser, live."""

import math
import os
import select
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import tyro

from e2efly.commands.terminal import Terminal, counted
from e2efly.flight.process import be_idle
from e2efly.policy.zoo import policy_file

if TYPE_CHECKING:
    from e2efly.viewing.watch.recorded import Recording
    from e2efly.viewing.watch.report import ShownReport
    from e2efly.viewing.watch.simulation import Simulation
    from e2efly.viewing.watch.stage import Source
    from e2efly.viewing.watch.training import ShownProgress

MOST = 1024
"""Largest number of vehicles."""
WAIT_S = 600.0
"""How long to wait for the first policy of a run, s."""
USUAL = "vis_r"
"""The vehicle that is drawn for a log that does not name its vehicle."""
FILM_S, FILM_HZ = 8.0, 25.0
"""Default length of a video, s, and its pictures per second."""


@dataclass(frozen=True)
class WatchOptions:
    """Watch flights in a browser: a live policy, a training in progress, flight logs, or a validation.

    A policy flies in the simulator: drag its goal, throw it, change wind, mass, thrust and delay while it flies. See
    docs/watch.md.
    """

    what: tyro.conf.Positional[Annotated[tuple[str, ...], tyro.conf.arg(metavar="POLICY|FILE ...")]]
    """One of: a task (the zoo's policy for it), a policy.onnx, or a run directory. One or more flight logs: the first
    is followed, the others are shown as its ghosts. A report of `e2efly validate --json`, or its folder: it shows the
    policy on the plant, with its flight in the training simulator as a ghost. A pose source, as in `e2efly fly`:
    udp:PORT, ros1:/topic, ..."""
    world: str | None = None
    """For a pose source: a policy, in whose world the vehicle is shown. `--seed` draws the world, as in `e2efly
    hil`."""
    vehicle: str | None = None
    """A shipped vehicle or a .toml file. If omitted, the vehicle of the policy or the log."""
    criterion: str | None = None
    """Criterion of the task. If omitted, the first one."""
    count: int = 1
    """Number of vehicles that fly at once, or a few more for whole worlds of several."""
    seed: int = 0
    """Seed of the starts."""
    host: str = "127.0.0.1"
    """Address on which the page is served. 0.0.0.0 serves every computer of the network."""
    port: int = 8080
    """Port of the page. 0: any free port."""
    seconds: float | None = None
    """End after this time, s. If omitted, run until Ctrl-C. For a video, its length, s; if omitted, 8 s, or the length
    of the log."""
    idle: bool = False
    """For a viewer beside another program: compute only while no other program needs a core, and end when standard
    input ends."""
    video: Path | None = None
    """Write a video to this file (.gif, .mp4 or .webm), or a picture of the last moment (.png). No page is served."""
    camera: Literal["follow", "orbit", "first person"] = "follow"
    """Camera of the video."""


def run(options: WatchOptions) -> int:
    """Serve the page, or draw the video.

    Raises:
        ValueError: naming the option, its value and what is accepted.
        OSError: for an address that this machine does not have; when the video cannot be written.
    """
    o, console = options, Terminal()
    if not 1 <= o.count <= MOST:
        raise ValueError(f"--count is {o.count}; accepted: 1 to {MOST}")
    if not 0 <= o.port <= 65535:
        raise ValueError(f"--port is {o.port}; accepted: 0 to 65535")
    if o.seconds is not None and not 0 < o.seconds < math.inf:
        raise ValueError(f"--seconds is {o.seconds}; accepted: more than 0")
    logs = _logs(o.what, o.vehicle)
    if o.idle:
        be_idle()
    if o.video is not None:
        return _draw(o, o.video, logs, console)
    if o.idle:
        from e2efly.viewing.watch.waiting import asked_for

        if not asked_for(o.host, o.port, _abandoned):
            return 0
    from e2efly.viewing.watch.viewer import serve

    server = serve(o.host, o.port, f"e2efly watch {' '.join(o.what)}")

    def ready() -> None:
        console.print(f"Look at http://{server.get_host()}:{server.get_port()} (Ctrl-C ends it)")

    try:
        _serve(o, server, logs, ready)
    except KeyboardInterrupt:
        console.print("Ended.")
    finally:
        server.stop()
    return 0


def _logs(what: Sequence[str], vehicle: str | None) -> list[Path]:
    """The flight logs, if flight logs are to be watched; otherwise none."""
    from e2efly.logs.readers import is_log

    logs = [Path(text) for text in what if is_log(Path(text))]
    if len(what) > 1 and len(logs) < len(what):
        raise ValueError(f"WHAT is {' '.join(what)}; accepted: one policy or run, or several flight logs")
    if not logs and not _is_source(first := what[0]):
        try:
            policy_file(first, vehicle)
        except ValueError as error:
            raise ValueError(f"{error}, a flight log, or a report of `e2efly validate --json`") from None
    return logs


def _serve(o: WatchOptions, server: Any, logs: list[Path], ready: Callable[[], None]) -> None:
    """Show what is asked for, and call `ready` once it is known to exist."""
    from e2efly.viewing.watch.loop import run as loop
    from e2efly.viewing.watch.panels import Panel, hands_on, policies_on, starts_on, times_on
    from e2efly.viewing.watch.viewer import Viewer

    end = time.monotonic() + (np.inf if o.seconds is None else o.seconds)

    def over() -> bool:
        return time.monotonic() > end or (o.idle and _abandoned())

    report = _report(o.what)
    if logs or report:
        recording, starts = _reported(o, report) if report else (_recording(o, logs), ())
        panel = Panel(Viewer(server, recording.together))
        panel.choose_among(len(recording.flights))
        if starts:
            starts_on(panel, recording, starts)
        between = times_on(panel, recording)
        ready()
        loop(recording, panel.viewer, panel, over, between)
        return
    panel = Panel(Viewer(server))
    if _is_source(o.what[0]):
        with _poses(o) as poses:
            ready()
            loop(poses, panel.viewer, panel, over)
        return

    def watched() -> bool:
        return not o.idle or bool(server.get_clients())

    if may_wait := (Path(o.what[0]) / "config.json").is_file():
        ready()
    simulation, progress = _flown(o, Terminal())
    if not may_wait:
        ready()
    panel.choose_among(simulation.count)
    hands_on(panel, simulation)
    between = (lambda: None) if progress is None else policies_on(panel, progress)
    loop(simulation, panel.viewer, panel, over, between, watched)


def _abandoned() -> bool:
    """Whether standard input has ended. It ends together with the program that started this one."""
    return bool(select.select([sys.stdin], [], [], 0)[0]) and not os.read(sys.stdin.fileno(), 1)


def _is_source(text: str) -> bool:
    """Whether the argument names a pose source and nothing else."""
    from e2efly.flight.pose.sources import SOURCES

    return text.partition(":")[0] in SOURCES and ":" in text


@contextmanager
def _poses(o: WatchOptions) -> "Iterator[Any]":
    """A vehicle at the poses of a pose source."""
    from e2efly.flight.pose.sources import open_source
    from e2efly.simulation.scenes.faces import bodies
    from e2efly.vehicles.loading import load_vehicle
    from e2efly.viewing.watch.poses import Poses

    stands = ()
    if o.world is not None:
        from e2efly.simulation.device import prepare

        prepare("cpu")
        from e2efly.simulation.scenes.scene import Scene
        from e2efly.validation.candidate import candidate
        from e2efly.validation.scenery import Scenery

        found = candidate(o.world, o.vehicle)
        suites = found.task.criteria()
        scenery = Scenery.draw(found.environment(suites[_criterion(o.criterion, suites)]), o.seed)
        if scenery is not None and isinstance(scenery.scene, Scene):
            stands = tuple(bodies(scenery.scene, 0, ceilings=True))
    source = open_source(o.what[0])
    try:
        yield Poses(source, load_vehicle(o.vehicle or USUAL), stands)
    finally:
        source.close()


def _draw(o: WatchOptions, path: Path, logs: list[Path], console: Terminal) -> int:
    from e2efly.simulation.scenes.meshes.engine import needed
    from e2efly.viewing.video import check_film, write_film
    from e2efly.viewing.watch.film import film

    check_film(path)
    with needed("mesh"):
        import embreex  # noqa: F401
    if _is_source(o.what[0]):
        raise ValueError(f"--video is {path}, of {o.what[0]}; accepted: of a policy, a run, a report or logs")
    report = _report(o.what)
    if logs or report:
        recording = _reported(o, report)[0] if report else _recording(o, logs)
        source: Source = recording
        seconds = o.seconds or recording.length * recording.period
    else:
        source, _ = _flown(o, console)
        seconds = o.seconds or FILM_S
    rate = 1 / seconds if path.suffix == ".png" else FILM_HZ  # of a still, the last moment alone
    shots = film(source, seconds, rate, o.camera)
    write_film(counted(console, f"Drawing {seconds:g} s of flight", shots, round(seconds * rate)), path, 1 / rate)
    console.print(f"Video: {path}")
    return 0


def _recording(o: WatchOptions, logs: list[Path]) -> Any:
    from e2efly.vehicles.loading import load_vehicle
    from e2efly.viewing.watch.recorded import Recording, read_flight, vehicle_of

    vehicle = load_vehicle(o.vehicle) if o.vehicle else vehicle_of(logs[0]) or load_vehicle(USUAL)
    return Recording([read_flight(path, vehicle) for path in logs], vehicle)


def _report(what: tuple[str, ...]) -> Path | None:
    """The validation report that is to be watched. None: something else is to be watched."""
    path = Path(what[0])
    if path.suffix != ".json" and not path.is_dir():
        return None
    from e2efly.simulation.device import prepare

    prepare("cpu")
    from e2efly.viewing.watch.report import report_of

    return report_of(path)


def _reported(o: WatchOptions, report: Path) -> "tuple[Recording, list[ShownReport]]":
    """The first start of a report in the requested criterion, and all starts."""
    if o.vehicle is not None:
        raise ValueError(f"--vehicle is {o.vehicle!r}; accepted: left out, as {report} says what flew")
    from e2efly.viewing.watch.recorded import Recording
    from e2efly.viewing.watch.report import read_report

    starts, vehicle = read_report(report)
    criterion = _criterion(o.criterion, dict.fromkeys(start.criterion for start in starts))
    first = next(start for start in starts if start.criterion == criterion)
    starts.sort(key=lambda start: start.criterion != criterion)
    return Recording(first.flights, vehicle, first.stage, first.together), starts


def _flown(o: WatchOptions, console: Terminal) -> "tuple[Simulation, ShownProgress | None]":
    """The simulation of a policy, and the progress of its run if it belongs to one."""
    from e2efly.simulation.device import prepare

    prepare("cpu")
    from e2efly.runs.rundir import RunDirectory
    from e2efly.validation.candidate import candidate
    from e2efly.validation.evaluation import act_of
    from e2efly.viewing.watch.simulation import Simulation

    what = Path(o.what[0])
    if (what / "config.json").is_file() and o.vehicle is None:
        from e2efly.viewing.watch.training import of_run

        progress = of_run(RunDirectory(what))
        if not progress.wait(0):
            console.print("There is no policy yet; waiting for the first.")
        if not progress.wait(WAIT_S):
            raise ValueError(f"{what} has no policy after {WAIT_S:g} s; accepted: a run that trains, or has trained")
        suites = progress.setup.config.task.criteria()
        name = _criterion(o.criterion, suites)
        env, act = progress.setup.judges[name], progress.act
    else:
        progress, found = None, candidate(o.what[0], o.vehicle)
        for note in found.notes:
            console.print(note, style="dim")
        suites = found.task.criteria()
        name = _criterion(o.criterion, suites)
        env, act = found.environment(suites[name]), act_of(found.policy)
    return Simulation(env, env.physics.flown, suites[name], act, o.count, o.seed), progress


def _criterion(asked: str | None, there: Any) -> str:
    """The criterion that is flown."""
    if asked is not None and asked not in there:
        raise ValueError(f"--criterion is {asked!r}; accepted: {', '.join(there)}")
    return asked or next(iter(there))
