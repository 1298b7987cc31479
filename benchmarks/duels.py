"""Races of policies against each other: wins, touches, lap times, and Elo ratings with intervals.

    python benchmarks/duels.py --policies race runs/race_duel-bptt-0 runs/another [--races 500] [--seed 3000000]

Each policy races against each other, and policies that see no others against themselves, too, from starts of a seed
that no training draws. A rating is that of Bradley and Terry on Elo's scale, of 0 on average, where a race that nobody
wins counts half for both; its 95 % interval is by 500 draws of the same number of races.
"""

from itertools import combinations
from pathlib import Path

import numpy as np
from common import arguments, table, write

from e2efly.validation.candidate import candidate
from e2efly.validation.duels import Duels, duel

DRAWS = 500
"""Number of draws for an interval."""


def ratings(points: np.ndarray) -> np.ndarray:
    """Elo ratings (k,) from points (k, k), those of the row against the column, by the iteration of Zermelo."""
    played, gained = points + points.T, points.sum(1) + 0.5  # half a point against nobody: a rating stays finite
    strength = np.ones(len(points))
    for _ in range(1000):
        pairs = played / (strength[:, None] + strength[None])
        strength = gained / (pairs.sum(1) + 1.0 / (strength + 1.0))
        strength /= np.exp(np.mean(np.log(strength)))
    return 400 * np.log10(strength)


def drawn_points(results: dict[tuple[int, int], np.ndarray], count: int, rng: np.random.Generator | None) -> np.ndarray:
    """Points of results by pair: 1 a win of the first, 0 of the second, 1/2 neither. With rng, drawn again."""
    points = np.zeros((count, count))
    for (i, j), each in results.items():
        some = each if rng is None else rng.choice(each, len(each))
        points[i, j], points[j, i] = some.sum(), (1 - some).sum()
    return points


def main() -> None:
    """Race all pairs, rate them, print, write JSON."""
    args = arguments(__doc__ or "", policies=[""], races=500, seed=3_000_000)
    names, rows, results = list(args.policies), [], dict[tuple[int, int], np.ndarray]()
    blind = [i for i, name in enumerate(names) if not candidate(name).policy.contract.neighbours]
    for i, j in [*combinations(range(len(names)), 2), *((i, i) for i in blind)]:
        found: Duels = duel(names[i], names[j], args.races, seed=args.seed)
        if i != j:
            results[i, j] = np.where(found.won, 1.0, np.where(found.lost, 0.0, 0.5))
        rows.append({"policy": Path(names[i]).name, "rival": Path(names[j]).name} | found.as_json())
        print(rows[-1], flush=True)
    rng = np.random.default_rng(0)
    best = ratings(drawn_points(results, len(names), None))
    spread = np.array([ratings(drawn_points(results, len(names), rng)) for _ in range(DRAWS)])
    low, high = np.percentile(spread, [2.5, 97.5], axis=0)
    elo = [
        {"policy": Path(name).name, "Elo": round(float(b)), "95 %": f"{a:.0f} to {c:.0f}"}
        for name, b, a, c in zip(names, best, low, high, strict=True)
    ]
    print(table(rows), table(elo), sep="\n\n")
    write("duels", args.json, {"races": rows, "table": elo, "seed": args.seed})


if __name__ == "__main__":
    main()
