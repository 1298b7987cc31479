"""The viewer: when its first picture is there, how many frames of many vehicles it shows, what it costs a training.

    python benchmarks/watch.py [--vehicles 256] [--seconds 10] [--runs 3] [--pairs 10] [--task race] [--json FILE]

The browser is Debian's Chromium, headless, which draws by software on the same cores: a desktop's draws elsewhere.
Let the machine be quiet.
"""

import json
import math
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from common import arguments, table, write

UNBUFFERED = {**os.environ, "PYTHONUNBUFFERED": "1"}
SHOWN = "document.body.innerText.includes('from its goal')"


@contextmanager
def browser() -> Iterator[Any]:
    """A page of a browser."""
    from tests.browser import chromium

    with chromium() as opened:
        yield opened.new_page(viewport={"width": 1000, "height": 700})


def first_picture(task: str) -> float:
    """Seconds from the start of the command to the first frame in a browser that waits for the page."""
    with browser() as page:
        began = time.perf_counter()
        command = [sys.executable, "-m", "e2efly", "watch", task, "--port", "0"]
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
        )
        try:
            assert process.stdout is not None
            found = next(found for line in process.stdout if (found := re.search(r"http://[\d.:]+", line)))
            page.goto(found[0])
            page.wait_for_function(SHOWN, timeout=120_000)
            return time.perf_counter() - began
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(20)


def frames(task: str, count: int, seconds: float, looks: bool) -> float:
    """Frames of so many vehicles per second, with or without a browser that looks."""
    from e2efly.simulation.device import prepare

    prepare("cpu")
    from e2efly.validation.candidate import candidate
    from e2efly.validation.evaluation import act_of
    from e2efly.viewing.watch.loop import run
    from e2efly.viewing.watch.panels import Panel, hands_on
    from e2efly.viewing.watch.simulation import Simulation
    from e2efly.viewing.watch.viewer import Viewer, serve

    found = candidate(task)
    suite = next(iter(found.task.criteria().values()))
    source = Simulation(found.environment(suite), found.flown.body, suite, act_of(found.policy), count)
    server = serve("127.0.0.1", 0, task)
    panel = Panel(Viewer(server))
    hands_on(panel, source)
    shown, show = [0], panel.viewer.show

    def counted(*told: Any) -> None:
        shown[0] += 1
        show(*told)

    panel.viewer.show = counted  # type: ignore[method-assign]

    def during(length: float) -> None:
        end = time.monotonic() + length
        run(source, panel.viewer, panel, lambda: time.monotonic() > end)

    during(2.0)
    if looks:
        where = f"http://127.0.0.1:{server.get_port()}"
        eyes = subprocess.Popen(
            [sys.executable, __file__, "--look", where], stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        assert eyes.stdout is not None
        os.set_blocking(eyes.stdout.fileno(), False)
        for _ in range(120):
            during(0.5)
            if eyes.stdout.readline():
                break
    shown[0] = 0
    during(seconds)
    if looks:
        os.killpg(eyes.pid, signal.SIGKILL)
    server.stop()
    return shown[0] / seconds


def look(where: str) -> None:
    """Look at a page until killed, and say when it shows frames."""
    with browser() as page:
        page.goto(where)
        page.wait_for_function(SHOWN, timeout=120_000)
        print("there", flush=True)
        time.sleep(600)


def trained(task: str, watched: bool, folder: Path) -> float:
    """Seconds of a training from the start of its process."""
    command = [sys.executable, "-m", "e2efly", "train", task, "--no-plots", "--out", str(folder)]
    process = subprocess.Popen([*command, *(["--watch", "0"] if watched else [])], stdout=subprocess.DEVNULL)
    try:
        summary = folder / "summary.json"
        while not summary.is_file() and process.poll() is None:
            time.sleep(0.2)
        return float(json.loads(summary.read_text())["seconds_trained_from_process_start"])
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)


def main() -> None:
    """Measure, print the table, write the figures."""
    args = arguments(__doc__ or "", vehicles=256, seconds=10.0, runs=3, pairs=10, task="race", look="")
    if args.look:
        return look(args.look)
    first_picture(args.task)  # compiles
    first = [first_picture(args.task) for _ in range(args.runs)]
    alone = frames(args.task, args.vehicles, args.seconds, looks=False)
    seen = frames(args.task, args.vehicles, args.seconds, looks=True)
    times: dict[bool, list[float]] = {False: [], True: []}
    with tempfile.TemporaryDirectory() as text:
        trained(args.task, False, Path(text) / "first")
        for i in range(args.pairs):
            for watched in (False, True):
                times[watched].append(trained(args.task, watched, Path(text) / f"{i}-{watched}"))
    more = [100 * (beside / plain - 1) for plain, beside in zip(times[False], times[True], strict=True)]
    error = statistics.stdev(more) / math.sqrt(len(more)) if len(more) > 1 else math.nan
    rows = [
        {"figure": "first picture, warm", "measured": f"{statistics.median(first):.1f} s", "asked": "4 s"},
        {"figure": f"frames, {args.vehicles} vehicles, nobody looks", "measured": f"{alone:.1f} per s", "asked": "30"},
        {"figure": "the same, a browser draws by software", "measured": f"{seen:.1f} per s", "asked": "30"},
        {
            "figure": f"training of {args.task} with --watch", "asked": "3 %",
            "measured": f"{statistics.mean(more):+.1f} % ± {error:.1f} %, {len(more)} pairs of runs",
        },
    ]  # fmt: skip
    print(table(rows))
    write("watch", args.json, {"table": rows, "first": first, "trainings": {str(k): v for k, v in times.items()}})


if __name__ == "__main__":
    main()
