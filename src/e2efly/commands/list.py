"""`e2efly list`."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from e2efly.commands.terminal import Terminal, console_table
from e2efly.config import ALGORITHMS
from e2efly.config.names import unknown
from e2efly.config.registry import load_installed
from e2efly.courses.tracks import track_names
from e2efly.policy import zoo
from e2efly.runs import presets
from e2efly.simulation.device import prepare
from e2efly.tasks import TASKS
from e2efly.vehicles.family import family_names, load_family
from e2efly.vehicles.loading import load_vehicle, vehicle_names

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class List:
    """List what there is by name, on one screen; or one catalogue in full, as in `e2efly list zoo`."""

    what: tyro.conf.Positional[Annotated[str | None, tyro.conf.arg(metavar="[CATALOGUE]")]] = None
    """The catalogue: tasks, algorithms, presets, vehicles, families, zoo, rewards, scenes, cameras, or rest (tracks,
    references, command modes, integrators, hover controllers, plants)."""


def run(options: List) -> int:
    """Print the overview, or one catalogue.

    Raises:
        ValueError: for a catalogue that does not exist.
    """
    if options.what not in (None, *_CATALOGUES):
        raise ValueError(unknown("catalogue", options.what, _CATALOGUES))
    load_installed()
    prepare("cpu")
    console = Terminal()
    if options.what is not None:
        console.print(console_table(_CATALOGUES[options.what]()))
        return 0
    overview: dict[str, Iterable[str]] = {
        "tasks": TASKS,
        "vehicles": [*vehicle_names(), *family_names()],
        "presets": presets.names(),
        "algorithms": ALGORITHMS,
        "zoo": (f"{name}/{'|'.join(tasks)}" for name, tasks in zoo.contents().items()),
    }
    for kind, names in overview.items():
        console.print(kind, style="bold", end=": ")
        console.print(", ".join(names))
    console.print(f"In full, with what each is: e2efly list {'|'.join(_CATALOGUES)}", style="dim")
    return 0


def _described(kind: str, things: Iterable[tuple[str, Any]]) -> Rows:
    """Things with the first paragraph of their documentation."""
    return [{kind: name, "what it is": " ".join(thing.__doc__.split("\n\n")[0].split())} for name, thing in things]


def _presets() -> Rows:
    field = {presets.ROBUST: "robust", presets.IDENTIFIED: "family", presets.PAPER: "paper", presets.AUTHORS: "paper"}

    def has(task: Any, name: str) -> bool:
        return name == presets.NOMINAL or name in task.variants or bool(getattr(task, field.get(name, ""), None))

    return [{"preset": n, "tasks": ", ".join(t for t, kind in TASKS.items() if has(kind, n))} for n in presets.names()]


def _vehicles() -> Rows:
    loaded = [(name, load_vehicle(name)) for name in vehicle_names()]
    return [
        {"vehicle": name, "rotors": str(v.rotor_count), "mass, kg": f"{v.mass:g}",
         "thrust/weight": f"{v.thrust_to_weight:.2f}", "latency, s": f"{v.latency:g}", "hash": v.hash}
        for name, v in loaded
    ]  # fmt: skip


def _families() -> Rows:
    loaded = [(name, family.ranges) for name in family_names() if (family := load_family(name)) is not None]
    return [
        {"family": name, "mass, kg": _span(r.mass), "thrust/weight": _span(r.thrust_to_weight),
         "latency, s": _span(r.latency), "hash": r.hash}
        for name, r in loaded
    ]  # fmt: skip


def _span(ends: tuple[float, float]) -> str:
    return "{:g} to {:g}".format(*ends)


def _zoo() -> Rows:
    return [
        {"policy": f"{whose}/{task}"} | {"success": ", ".join(f"{n} {s:.1%}" for n, s in about["success"].items())}
        for whose, tasks in zoo.contents().items()
        for task, about in tasks.items()
    ]


def _rewards() -> Rows:
    from e2efly.simulation.rewards import TERMS

    rows = _described("reward term", ((name, term.function) for name, term in TERMS.items()))
    return [row | {"gradient": TERMS[row["reward term"]].kind} for row in rows]


def _scenes() -> Rows:
    from e2efly.simulation.scenes.meshes.load import FORMATS, mesh_scene_names
    from e2efly.viewing.places import GENERATED

    kinds = {"random": GENERATED, "race track": track_names(), "mesh": mesh_scene_names(), "file": (".toml", *FORMATS)}
    return [{"scene": name, "kind": kind} for kind, names in kinds.items() for name in names]


def _cameras() -> Rows:
    from e2efly.simulation.scenes.camera import PRESETS

    return [
        {"camera": name, "image": c.sees, "columns x rows": f"{c.width} x {c.height}", "projection": c.projection}
        for name, c in PRESETS.items()
    ]


def _rest() -> Rows:
    from e2efly.control import COMMAND_MODES
    from e2efly.courses.random_tracks import ANY
    from e2efly.flight.pilot.hovering import HOVERS
    from e2efly.simulation.physics import INTEGRATORS
    from e2efly.validation.plants import PLANTS

    kinds: dict[str, Iterable[str]] = {
        "race tracks": [*track_names(), f"{ANY} (another in every episode)"],
        "references": ["polynomial", "circle", "lemniscate", "FILE.csv"],
        "command modes": COMMAND_MODES,
        "integrators": INTEGRATORS,
        "hover controllers": HOVERS,
        "plants": PLANTS,
    }
    return [{"kind": kind, "names": ", ".join(names)} for kind, names in kinds.items()]


_CATALOGUES: dict[str, Callable[[], Rows]] = {
    "tasks": lambda: _described("task", TASKS.items()),
    "algorithms": lambda: _described("algorithm", ALGORITHMS.items()),
    "presets": _presets,
    "vehicles": _vehicles,
    "families": _families,
    "zoo": _zoo,
    "rewards": _rewards,
    "scenes": _scenes,
    "cameras": _cameras,
    "rest": _rest,
}
