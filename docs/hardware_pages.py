"""Put the parts, their sums and the drawings into docs/hardware-vis-r.md and docs/hardware-vis-h.md: `make docs`.

They are made of the vehicle files and of the lists of parts beside them, `src/e2efly/vehicles/parts`.
"""

import dataclasses
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from vehicle_drawing import Mounted, drawing

from e2efly.alignment.parts import Part, prototype, read_on_the_ground, read_parts
from e2efly.alignment.purchases import Purchase
from e2efly.commands.terminal import markdown
from e2efly.flight.pilot.throttle_map import ThrottleMap
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

DOCS = Path(__file__).parent
BEGIN, END = "<!-- parts: written by `make docs` -->", "<!-- end of the parts -->"
PUBLISHED = {"vis_r": 630, "vis_h": 280}
"""The paper's prices, USD. Its masses are those of the vehicle files."""
LOW, HIGH = 1050, 2000
"""Betaflight's `min_check` and `max_check`, us: a linear curve is 0 at the first, and 1 at the second."""
MIDDLE = (1500 - LOW) / (HIGH - LOW)
"""The throttle of a stick in its middle."""
TITLES = {"vis_r": "VIS-R, computer on board", "vis_h": "VIS-H, computer on the ground"}
CAMERAS = {
    "vis_r": (
        ("camera ahead: RealSense D435i", "race_clutter", "avoid and race_clutter see"),
        ("camera down: ELP-USB500W05G-L180", "land_visual", "land_visual sees"),
    ),
    "vis_h": (("camera ahead: RunCam Phoenix 2 Nano", "race_clutter", "virtual images see"),),
}
"""For each camera of a drawing: its part, the policy whose contract has its mount, and words for the legend."""


def lists(name: str) -> tuple[tuple[Part, ...], tuple[Purchase, ...]]:
    """The parts of a vehicle, and what stays on the ground."""
    path = Path(str(files("e2efly.vehicles"))) / "parts" / f"{name}.toml"
    return read_parts(path), read_on_the_ground(path)


def page(name: str) -> str:
    """The page of a vehicle, with its parts and sums as its files say."""
    text = where(name).read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n{made(name)}\n{END}{rest.split(END)[1]}"


def where(name: str) -> Path:
    """The page of a vehicle."""
    return DOCS / f"hardware-{name.replace('_', '-')}.md"


def picture(name: str) -> str:
    """The drawing of a vehicle, as SVG."""
    mounted = []
    for part, task, words in CAMERAS[name]:
        image = load_policy(policy_file(f"{name}/{task}")).contract.images[0]
        mounted.append(Mounted(part, image.pitch_rad, (image.fov_rad[0], image.fov_rad[1]), words))
    return drawing(load_vehicle(name), TITLES[name], lists(name)[0], tuple(mounted))


def made(name: str) -> str:
    """What stands between the marks of a page."""
    (parts, ground), vehicle = lists(name), load_vehicle(name)
    rows = [{"": i, **bought(part.purchase, part.mass)} for i, part in enumerate(parts, 1)]
    lines = [f"![{TITLES[name]}, from above and from the right]({where(name).stem}.svg)", ""]
    lines += [*markdown(rows), "", "What stays on the ground:", ""]
    lines += [*markdown([{"": chr(ord("a") + i), **bought(thing)} for i, thing in enumerate(ground)]), ""]
    lines += ["How the numbers with ~ were estimated:", ""]
    things = [*((str(i), part.purchase) for i, part in enumerate(parts, 1)), *zip("abcdefgh", ground, strict=False)]
    lines += [f"- **{mark}** {note}" for mark, thing in things if (note := notes(thing))]
    lines += ["", "### Sums", "", *markdown(sums(name, parts, ground)), "", "### With the battery", ""]
    return "\n".join([*lines, *markdown(flown(vehicle, parts)), "", *building(name, prototype(parts).mass)])


def building(name: str, mass: float) -> list[str]:
    """How the list becomes a vehicle file and policies."""
    return [
        "### From parts to policies",
        "",
        f"    cp src/e2efly/vehicles/parts/{name}.toml parts.toml    # with the masses of your own scale",
        f"    e2efly build parts.toml --vehicle {name} --mass {mass:.3f} 0.002 --out mine",
        "",
        "`--mass` is that of the whole vehicle with its battery, kg, and the scale's standard deviation.",
        "The masses of the parts set the inertia. The command writes `mine/vehicle.toml`, takes or trains",
        "a policy for each of the six tasks, and says how often each succeeds on that vehicle",
        "([more](vehicles.md#from-parts-to-policies)).",
    ]


def bought(thing: Purchase, mass: float | None = None) -> dict[str, Any]:
    """A row of the table of parts. A number leads to the page that says it, and has a ~ if it is an estimate."""
    cells: dict[str, Any] = {"part": thing.name, "pieces": thing.count}
    if mass is not None:
        cells["g each"] = told(thing, "mass", f"{1e3 * mass:.3g}")
    usd = "" if thing.price is None else f"{thing.price:.2f}" if thing.price % 1 else f"{thing.price:g}"
    return {**cells, "USD each": told(thing, "price_usd", usd), "price as of": thing.date or ""}


def told(thing: Purchase, number: str, words: str) -> str:
    """A number with its page, or with the mark of an estimate, or both."""
    words = f"~{words}" if number in thing.estimate else words
    page = thing.source.get(number)
    return f"[{words}]({page})" if page else words


def notes(thing: Purchase) -> str:
    """How the numbers of a row were estimated."""
    said = (f"{what.removesuffix('_usd')}: {text}" for what, text in thing.estimate.items())
    return re.sub(r"\((https://[^)]+)\)", r"([page](\1))", ". ".join(said))


def sums(name: str, parts: tuple[Part, ...], ground: tuple[Purchase, ...]) -> list[dict[str, str]]:
    """Masses and prices beside the paper's, and how much of them no page says as it stands here."""
    vehicle, body = load_vehicle(name), tuple(part for part in parts if not part.battery)
    weight, usd = (sum(one(part) * len(part.places) for part in body) for one in (lambda p: p.mass, price))
    whole, paid = (sum(one(part) * len(part.places) for part in parts) for one in (lambda p: p.mass, price))
    paper, published = float(vehicle.mass), PUBLISHED[name]
    guessed = [sum(len(p.places) * p.mass for p in body if "mass" not in p.purchase.source) / weight]
    guessed.append(sum(len(p.places) * price(p) for p in body if "price_usd" not in p.purchase.source) / usd)
    return [
        {"": "without battery", "mass, g": f"{1e3 * weight:.0f}", "price, USD": f"{usd:.0f}"},
        {"": "of it by no page", "mass, g": f"{guessed[0]:.0%}", "price, USD": f"{guessed[1]:.0%}"},
        {
            "": "the paper, which says without battery",
            "mass, g": f"{1e3 * paper:.0f}",
            "price, USD": f"about {published}",
        },
        {"": "difference", "mass, g": f"{1e3 * (weight - paper):+.0f}", "price, USD": f"{usd - published:+.0f}"},
        {"": "with battery", "mass, g": f"{1e3 * whole:.0f}", "price, USD": f"{paid:.0f}"},
        {"": "on the ground", "mass, g": "", "price, USD": f"{sum(g.count * (g.price or 0) for g in ground):.0f}"},
    ]


def price(part: Part) -> float:
    """Price of one, USD; nothing where the list does not say."""
    return part.purchase.price or 0.0


def flown(vehicle: Vehicle, parts: tuple[Part, ...]) -> list[dict[str, str]]:
    """What the vehicle file and the list say of the flight, without and with the battery."""
    battery = sum(part.mass for part in parts if part.battery)
    listed = prototype(parts)
    loaded = dataclasses.replace(vehicle, mass=vehicle.mass + battery)
    ours = dataclasses.replace(vehicle, mass=listed.mass, inertia=np.diag(listed.inertia))
    columns = {
        f"`{vehicle.name}`": vehicle,
        f"`{vehicle.name}` and the battery": loaded,
        "this list, with battery": ours,
    }
    rows = {
        "mass, g": lambda v: f"{1e3 * v.mass:.0f}",
        "inertia, 1e-3 kg m^2": lambda v: "as it" if v is loaded else ", ".join(f"{1e3 * j:.2f}" for j in v.inertia),
        "full thrust over weight": lambda v: f"{v.thrust_to_weight:.2f}",
        "throttle in hover": hover,
        "middle throttle stick over weight": lambda v: f"{ThrottleMap.of(v).nominal(MIDDLE) / GRAVITY:.2f}",
    }
    return [{"": what, **{name: one(v) for name, v in columns.items()}} for what, one in rows.items()]


def hover(vehicle: Vehicle) -> str:
    """The throttle in hover, and its pulse by a linear curve."""
    idle = vehicle.rotor_speed_min
    share = (vehicle.hover_rotor_speed - idle) / (vehicle.full_rotor_speed - idle)
    return f"{share:.2f} ({LOW + (HIGH - LOW) * share:.0f} us)"


if __name__ == "__main__":
    for vehicle in TITLES:
        where(vehicle).write_text(page(vehicle), encoding="utf-8")
        where(vehicle).with_suffix(".svg").write_text(picture(vehicle), encoding="utf-8")
