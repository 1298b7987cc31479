"""`e2efly benchmark`: score anybody's policy. How fast this machine is tells `e2efly bench`."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import tyro

from e2efly.commands.benchmark_card import in_short, page
from e2efly.commands.terminal import Terminal, console_table
from e2efly.config.storage import held, read_json, write_atomically, write_json
from e2efly.policy.onnx_file import file_content, is_sealed
from e2efly.policy.zoo import policy_file
from e2efly.vehicles.vehicle import Controller


@dataclass(frozen=True)
class Benchmark:
    """Score policies on a card: by latency, under stress, on other plants. (`e2efly bench` times this machine instead.)

    The starts are the same for everybody, and no training draws them. What is finished stays when it is interrupted;
    the same command goes on.
    """

    policies: tyro.conf.Positional[Annotated[tuple[str, ...], tyro.conf.arg(metavar="POLICY [POLICY ...]")]]
    """Run directories, names of the zoo (hover, any/hover), policy.onnx files, or an ONNX file of another program with
    its contract beside it, NAME.contract.json. A model of Stable-Baselines3 is exported first. See
    docs/benchmark.md."""
    baseline: str | None = None
    """Controller that flies in place of each policy, under its contract: pid, geometric, indi, mpc, or your own,
    path/to/file.py:Name. For hover, hover_aware, land, track and race."""
    vehicle: str | None = None
    """The vehicle that flies: a name or a .toml file. If omitted, each policy's own; a policy of a family needs one."""
    controller: Controller = "policy"
    """The vehicle for which the flight controller is tuned. policy: the policy's own vehicle, whatever flies. plant:
    the vehicle that flies."""
    plants: tuple[str, ...] = ("mujoco",)
    """Plants that fly eleven of the rows: simulator, mujoco, betaflight, or your own, path/to/plant.py:Name."""
    episodes: int = 100
    """Starts per row and criterion in the training simulator. A card of hover takes a minute on two cores, and with 25
    and --flights 1 two thirds of that; one of track, with two criteria, three minutes."""
    flights: int = 5
    """Starts per row and criterion on each plant, a quarter to one second each."""
    out: Path | None = None
    """Folder for card.md, card.json and the files that were scored. If omitted, runs/benchmark-NAMES. Parts that its
    card.json has of the same policy and scale are not flown again."""


def run(options: Benchmark) -> int:
    """Score every policy; write the card after each part.

    Raises:
        ValueError: naming what is wrong and what is accepted, before anything flies.
        OSError: when the folder cannot be written, or a plant cannot be started.
    """
    from e2efly.simulation.device import prepare
    from e2efly.validation.scorecard import CardScale, about, score

    scale = CardScale(options.episodes, options.flights, options.plants)
    scale.check()
    labels = _labels(options.policies)
    prepare("cpu")  # as the plants do, so that a card is the same on every machine
    out, console = options.out or _folder(options, labels), Terminal()
    with held(out):
        entered = {name: _entered(options, policy, out / f"{name}.onnx") for name, policy in labels.items()}
        known, cards = _known(out / "card.json"), dict[str, dict[str, Any]]()
        for name, found in entered.items():
            told = about(found)
            same = next((old["parts"] for old in known if told.items() <= old.items()), [])
            cards[name] = {"policy": name, **told, "notes": found.notes, "parts": same}
        for name, found in entered.items():
            for note in found.notes:
                console.print(f"{name}: {note}", style="dim")
            keep, tell = partial(_keep, out, cards, name), partial(_tell, console, name)
            keep(score(found, scale, cards[name]["parts"], keep, tell))
    for each in cards.values():
        console.print(console_table([in_short(each)]))
    console.print(f"Card: {out / 'card.md'} and card.json")
    return 0


def _keep(out: Path, cards: dict[str, dict[str, Any]], name: str, parts: list[dict[str, Any]]) -> None:
    """Write the card with the parts of a policy that there are now."""
    from e2efly.validation.scorecard import SEED, VERSION

    cards[name]["parts"] = parts
    content = {"benchmark": VERSION, "seed": SEED, "cards": [*cards.values()]}
    write_json(out / "card.json", content)
    write_atomically(out / "card.md", page(content).encode())


def _tell(console: Terminal, name: str, part: str) -> None:
    console.print(f"{name}: {part}", style="dim")


def _labels(policies: tuple[str, ...]) -> dict[str, str]:
    """The policies by the name that each has on the card."""
    labels: dict[str, str] = {}
    for policy in policies:
        path = Path(policy)
        path = path.parent if path.name == "policy.onnx" else path
        name = path.resolve().name if path.exists() else path.as_posix().replace("/", "-")
        name = name.removesuffix(".onnx")
        if name in labels:
            raise ValueError(
                f"POLICY is {policy}, and {labels[name]} has the name {name!r}, too; accepted: each name once"
            )
        labels[name] = policy
    return labels


def _folder(options: Benchmark, labels: dict[str, str]) -> Path:
    beside = (Path(options.vehicle).stem if options.vehicle else None, options.baseline)
    extra = [Path(text).name.replace(":", "-") for text in beside if text]
    return Path("runs") / "-".join(["benchmark", *labels, *extra])


def _entered(options: Benchmark, policy: str, file: Path) -> Any:
    """The candidate that the benchmark judges, by a copy of its file outside of its run."""
    from e2efly.runs.rundir import run_of
    from e2efly.validation.scorecard import entrant

    path, vehicle = Path(policy), options.vehicle
    if path.suffix == ".zip":
        raise ValueError(
            f"POLICY is {policy}; accepted: what `e2efly.export(model, 'policy.onnx')` writes of a model of "
            "Stable-Baselines3, as loading its own file runs the code in it"
        )
    contract = path.with_suffix(".contract.json")
    if path.suffix == ".onnx" and contract.is_file():
        from e2efly.adapters.onnx_policy import adopt

        said = adopt(path, contract, file)
        return entrant(file, vehicle or said.vehicle, options.controller, options.baseline)
    found = policy_file(path, vehicle)
    content = file_content(found)
    if not is_sealed(content):
        raise ValueError(
            f"{found}: is no policy.onnx of e2efly, which has its contract in it; accepted: one as `e2efly export` "
            f"writes it, or a file with its contract beside it, {contract}"
        )
    if vehicle is None and (ran := run_of(found)) is not None:
        vehicle = ran.config().env.vehicle
    write_atomically(file, content)
    return entrant(file, vehicle, options.controller, options.baseline)


def _known(path: Path) -> list[dict[str, Any]]:
    """The cards that a file has, or none."""
    if not path.is_file():
        return []
    try:
        cards = read_json(path)["cards"]
        return [card for card in cards if isinstance(card["parts"], list)]
    except (KeyError, TypeError):
        raise ValueError(f"{path} is no card of `e2efly benchmark`; accepted: another --out") from None
