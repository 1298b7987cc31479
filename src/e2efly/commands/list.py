"""`e2efly list`."""

from dataclasses import dataclass

from rich.table import Table

from e2efly import presets
from e2efly.config import ALGORITHMS
from e2efly.courses.tracks import track_names
from e2efly.device import prepare
from e2efly.registry import load_installed
from e2efly.tasks import TASKS
from e2efly.terminal import Terminal
from e2efly.vehicles import family_names, load_family, load_vehicle, vehicle_names


@dataclass(frozen=True)
class List:
    """List tasks, algorithms, vehicles, tracks, command modes, hover controllers, plants and reward terms."""


def run(options: List) -> int:
    """Print the lists."""
    del options
    load_installed()
    prepare("cpu")
    from e2efly.control import COMMAND_MODES
    from e2efly.deploy.pilot.hovering import HOVERS
    from e2efly.physics import INTEGRATORS
    from e2efly.rewards import TERMS
    from e2efly.tasks.race import ANY
    from e2efly.validation.plants import PLANTS

    console = Terminal()
    for kind, names in (
        ("tasks", TASKS),
        ("algorithms", ALGORITHMS),
        ("presets", presets.names()),
        ("race tracks", [*track_names(), f"{ANY} (another in every episode)"]),
        ("references", ["polynomial", "circle", "lemniscate", "FILE.csv"]),
        ("command modes", COMMAND_MODES),
        ("integrators", INTEGRATORS),
        ("hover controllers", HOVERS),
        ("plants", PLANTS),
    ):
        console.print(kind, style="bold", end=": ")
        console.print(", ".join(names))
    vehicles = Table("vehicle", "mass, kg", "thrust/weight", "latency, s", "hash", box=None, header_style="bold")
    for name in vehicle_names():
        v = load_vehicle(name)
        vehicles.add_row(name, f"{v.mass:g}", f"{v.thrust_to_weight:.2f}", f"{v.latency:g}", v.hash)
    console.print(vehicles)
    families = Table("family", "mass, kg", "thrust/weight", "latency, s", "hash", box=None, header_style="bold")
    for name in family_names():
        family = load_family(name)
        assert family is not None
        r = family.ranges
        spans = ("{:g} to {:g}".format(*pair) for pair in (r.mass, r.thrust_to_weight, r.latency))
        families.add_row(name, *spans, r.hash)
    console.print(families)
    terms = Table("reward term", "gradient", "what it is (unweighted)", box=None, header_style="bold")
    for name, term in TERMS.items():
        terms.add_row(name, term.kind, (term.function.__doc__ or "").split("\n")[0])
    console.print(terms)
    return 0
