"""Cards of `e2efly benchmark` of the zoo's policies, and of the hover controllers in their place.

    python benchmarks/scorecards.py [--policies hover land track race] [--flown policy pid geometric indi mpc]
        [--vehicle vis_r] [--out runs/scorecards] [--episodes 100] [--flights 5]

`--flown`: the policy itself, and controllers. The folder keeps the cards: a script that was stopped goes on where it
was. `--policies any/hover` is measured about one vehicle, too. So is `raptor`, RAPTOR's published checkpoint (see
`raptor.py`), about `crazyflie`: VIS-R's latency is none of those that it takes. What is not measured anew stays in the
file.
"""

from pathlib import Path
from typing import Any

from common import RESULTS, arguments, table, with_earlier, write
from raptor import raptor

from e2efly.commands.benchmark import Benchmark, run
from e2efly.commands.benchmark_card import in_short
from e2efly.config.storage import read_json
from e2efly.validation.scorecard import SEED, VERSION, worst_criterion

KEYS = ("policy", "task", "vehicle")
"""What names a line of the table."""


def card_of(policy: str, flown: str, vehicle: str, out: Path, episodes: int, flights: int) -> dict[str, Any]:
    """The card of a policy, or of a controller in its place."""
    out.mkdir(parents=True, exist_ok=True)
    folder = out / f"{policy.replace('/', '-')}-{flown}-{vehicle}"
    controller = None if flown == "policy" else flown
    file = str(raptor(out)) if policy == "raptor" else policy
    status = run(Benchmark((file,), controller, vehicle, episodes=episodes, flights=flights, out=folder))
    if status:
        raise RuntimeError(f"{policy}, {flown}: status {status}")
    return read_json(folder / "card.json")["cards"][0]


def successes(card: dict[str, Any]) -> dict[str, Any]:
    """The success in each row of a card, of the worst criterion."""
    return {
        f"{part['kind']} rows, {part['place']}": {
            row: worst_criterion(criteria)["success"] for row, criteria in part["rows"].items()
        }
        for part in card["parts"]
        if "rows" in part
    }


def main() -> None:
    """Measure every card that is asked for; write the table after each."""
    options = arguments(
        __doc__ or "", policies=["hover", "land", "track", "race"], flown=["policy", "pid", "geometric", "indi", "mpc"],
        vehicle="vis_r", out="runs/scorecards", episodes=100, flights=5,
    )  # fmt: skip
    scale = {"episodes": options.episodes, "flights": options.flights}
    for policy in options.policies:
        for flown in options.flown:
            card = card_of(policy, flown, options.vehicle, Path(options.out), **scale)
            row = in_short(card)
            rows = with_earlier("scorecards", options.json, "table", KEYS, [row])
            last = card["parts"][-1]
            about = {key: row[key] for key in KEYS} | {
                "sha256": card["sha256"], "date": last["date"], "cpu": last["cpu"], "rows": successes(card),
            }  # fmt: skip
            rows_of = with_earlier("scorecards", options.json, "cards", KEYS, [about])
            write(
                "scorecards", options.json, {"version": VERSION, "seed": SEED, **scale, "table": rows, "cards": rows_of}
            )
    print(table(read_json(options.json or RESULTS / "scorecards.json")["table"]))


if __name__ == "__main__":
    main()
