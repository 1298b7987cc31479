"""Fly each policy of the zoo and draw it: the pictures and videos of docs/zoo.md, in docs/zoo/.

    python docs/zoo_pictures.py [VEHICLE/TASK ...] [--curves]

Every policy gets a picture of flights from unseen starts of its first criterion, and one of the curve of its training,
where that was kept. Those of the VIS-R get a video as well: one flight, seen by a camera that follows the vehicle.
With `--curves` the curves alone are drawn.
"""

import csv
import sys
import tempfile
from pathlib import Path
from typing import Any

import jax
import numpy as np
from PIL import Image

from e2efly.config import TaskConfig
from e2efly.environment import UNSEEN, Env, random_key
from e2efly.policy.zoo import USUAL, contents, curve_file, policy_file
from e2efly.simulation.device import prepare
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import SEED, act_of
from e2efly.viewing.flights import Flights, fly
from e2efly.viewing.space import plot_flights
from e2efly.viewing.style import CYCLE, figure
from e2efly.viewing.watch.film import film
from e2efly.viewing.watch.recorded import Recording
from e2efly.viewing.watch.report import flight_of
from e2efly.viewing.watch.simulation import moment
from e2efly.viewing.worlds import plot_flights_in_worlds

FOLDER = Path(__file__).parent / "zoo"
EPISODES, SEEN = 12, 6
"""Flights in a picture, and of a policy that sees."""
WIDE, COLOURS = 800, 48
"""Of a picture: columns and colours."""
FILM, QUALITY, LONGEST = (200, 320), 40, 8.0
"""Of a video: rows and columns, WebP's quality, s."""
PERIOD = 0.1
"""Seconds from frame to frame."""


def picture(flights: Flights, suite: TaskConfig, env: Env, key: Any, path: Path, title: str) -> None:
    """The plot of flights that `e2efly eval` draws, smaller."""
    with tempfile.TemporaryDirectory() as folder:
        large = Path(folder) / "flights.png"
        if env.cameras or suite.own_worlds:
            worlds = env.task.scene(env.reset(key, len(flights.length))[0].memory)
            plot_flights_in_worlds(flights, worlds, large, title)
        else:
            plot_flights(suite, flights, large, title)
        smaller(large, path)


def curve(file: Path, path: Path, title: str) -> None:
    """The success of a training's evaluations over its environment steps."""
    with file.open(newline="", encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    with tempfile.TemporaryDirectory() as folder:
        large = Path(folder) / "curve.png"
        seconds = f"{float(rows[-1]['seconds']):.0f} s from the start of the process to the last evaluation"
        with figure(large, title, 3.2, [seconds]) as fig:
            ax = fig.add_subplot()
            for name, colour in zip(
                [name for name in rows[0] if name not in ("steps", "seconds")], CYCLE, strict=False
            ):
                steps, success = ([float(row[of]) for row in rows] for of in ("steps", name))
                ax.plot([1e-6 * x for x in steps], [100 * x for x in success], color=colour, label=name)
            ax.set(xlabel="environment steps (million)", ylabel="success of evaluation (%)", ylim=(-4, 104))
            ax.set_xlim(left=0.0)
            ax.legend(loc="lower right")
        smaller(large, path)


def smaller(large: Path, path: Path) -> None:
    """A plot as the cards have it."""
    with Image.open(large) as drawn:
        size = WIDE, round(WIDE * drawn.height / drawn.width)
        small = drawn.convert("RGB").resize(size, Image.Resampling.LANCZOS)
    small.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


def video(env: Env, suite: TaskConfig, key: Any, flights: Flights, path: Path) -> None:
    """The first flight that succeeds, with all vehicles of its world, as an animated WebP."""
    row = int(np.argmax(flights.success))
    state = env.reset(key, len(flights.length))[0]
    drawn, _ = moment(env, suite, state, row)
    world = range(row, row + env.agents)
    begins = [jax.tree.map(lambda x, i=i: np.asarray(x[i]), state.vehicle) for i in world]
    flown = [flight_of("", begin, flights, i) for begin, i in zip(begins, world, strict=True)]
    recording = Recording(flown, drawn.vehicle, drawn, env.agents)
    seconds = min(recording.length * recording.period, LONGEST)
    shots = [Image.fromarray(shot) for shot in film(recording, seconds, 1 / PERIOD, size=FILM)]
    shots[0].save(
        path, save_all=True, append_images=shots[1:], duration=round(1000 * PERIOD), loop=0, quality=QUALITY, method=6
    )


def main() -> None:
    """Draw those that are named, or all."""
    prepare()
    key = random_key(SEED, UNSEEN, 0)  # the starts of `e2efly eval`
    FOLDER.mkdir(exist_ok=True)
    asked = [word for word in sys.argv[1:] if word != "--curves"]
    for name in asked or [f"{vehicle}/{task}" for vehicle, tasks in contents().items() for task in tasks]:
        vehicle, task = name.split("/")
        if (kept := curve_file(policy_file(name))).is_file():
            curve(kept, FOLDER / f"{vehicle}-{task}-training.png", f"Training of {name}")
        if "--curves" in sys.argv:
            continue
        found = candidate(name)
        suite = next(iter(found.task.criteria().values()))
        env, act = found.environment(suite), act_of(found.policy)
        n = SEEN if env.cameras else EPISODES
        flights = fly(env, act, key, n, env.episode_steps)
        title = f"{found.policy.contract.task} on {found.policy.contract.vehicle}"
        picture(flights, suite, env, key, FOLDER / f"{vehicle}-{task}.png", title)
        if vehicle == USUAL:
            video(env, suite, key, flights, FOLDER / f"{vehicle}-{task}.webp")
        print(name, f"{flights.success.mean():.0%}", flush=True)


if __name__ == "__main__":
    main()
