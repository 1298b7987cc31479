"""The response of policies: commands and body rates over time, in the training simulator and through the real firmware.

    python benchmarks/policy_response.py [--tasks hover race] [--json FILE]

The policies are the zoo's on VIS-R. One start of each criterion is flown in both places with the same runtime.
"""

from typing import Any

import numpy as np
from common import arguments, table, write

import e2efly
from e2efly.viewing.flights import Flights
from e2efly.viewing.validation import flown_again

PLANT = "betaflight"


def columns(flights: Flights) -> dict[str, str]:
    """The first flight: time in s, the command, and the body rate in rad/s, one line of numbers each."""
    k = int(flights.length[0])
    names = ("command thrust", "command roll", "command pitch", "command yaw", "roll", "pitch", "yaw")
    values = np.concatenate([flights.command[:k, 0], flights.body_rate[:k, 0]], axis=1).T
    told = zip(("time", *names), (flights.time[:k], *values), strict=True)
    return {name: " ".join(f"{x:.4g}" for x in of) for name, of in told}


def difference(simulator: dict[str, str], plant: dict[str, str], name: str) -> str:
    """The root mean square of the difference of two curves over the time that both have."""
    one, other = (np.array(flown[name].split(), float) for flown in (simulator, plant))
    k = min(len(one), len(other))
    return f"{np.sqrt(np.mean((one[:k] - other[:k]) ** 2)):.3g}"


def main() -> None:
    """Fly, print the table, write the figures."""
    options = arguments(__doc__ or "", tasks=["hover", "race"])
    rows: list[dict[str, str]] = []
    flown: dict[str, Any] = {}
    for task in options.tasks:
        found = e2efly.validate(task, PLANT, 1)
        for name, pair in flown_again(found).items():
            both = [columns(flights) for flights in pair.flown.values()]
            flown[name] = dict(zip(("simulator", PLANT), both, strict=True))
            ends = [f"{float(of['time'].split()[-1]):.2f}" for of in both]
            rows.append(
                {"criterion": name, "ends after, s, simulator": ends[0], "firmware": ends[1]}
                | {f"difference of {of}, rad/s": difference(*both, of) for of in ("roll", "pitch", "yaw")}
            )
    print(table(rows))
    write("policy_response", options.json, {"table": rows, "flown": flown})


if __name__ == "__main__":
    main()
