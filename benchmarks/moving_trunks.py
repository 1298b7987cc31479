"""The zoo's avoid, which never saw a trunk move, among trunks that swing.

    python benchmarks/moving_trunks.py [--swings 0 0.5 1 2] [--episodes 1000] [--seed 0] [--json FILE]

Success in the criteria of `e2efly eval avoid --task.swing S`, with periods of 3 to 8 s, from the same forests. At a
period of 3 s, a swing of 2 m means 4.2 m/s.
"""

from typing import Any

from common import arguments, table, with_earlier, write

import e2efly


def main() -> None:
    """Fly, print a table, write JSON."""
    options = arguments(__doc__ or "", swings=[0.0, 0.5, 1.0, 2.0], episodes=1000, seed=0)
    rows: list[dict[str, Any]] = []
    for swing in options.swings:
        found = e2efly.evaluate("avoid", options.episodes, seed=options.seed, task={"swing": swing})
        shares = {name: 100 * float(each.success.mean()) for name, each in found.flown.items()}
        rows.append({"swing, m": swing} | {f"{name}, %": f"{share:.1f}" for name, share in shares.items()})
        print(rows[-1], flush=True)
    whole = with_earlier("moving_trunks", options.json, "table", ("swing, m",), rows)
    write("moving_trunks", options.json, {"episodes": options.episodes, "seed": options.seed, "table": whole})
    print(table(whole))


if __name__ == "__main__":
    main()
