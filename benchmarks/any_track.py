"""One policy for any track: 1000 unseen ones, those that are shipped, another sampler's, and specialists beside it.

    python benchmarks/any_track.py [--policy race_any] [--specialists 50] [--parts flights specialists] [--json FILE]

Unseen tracks are those of `courses/random_tracks.py` from seeds that training does not draw. Those of another sampler
walk from gate to gate as `elsewhere` below says. A specialist begins as the one policy and goes on to learn on one of
the unseen tracks alone, in as many steps as the nominal preset of a race takes, by the rewards and options of the one
policy; all of them share a compiled program. Its best policy is kept as `train` keeps it. Times are compared over the
starts from which both succeed. Specialists that begin from nothing fly few of these tracks after so few steps.

What is not measured anew stays in the file.
"""

import dataclasses
import json
import math
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

from common import RESULTS, arguments, table, write

from e2efly.simulation.device import prepare, wide_vectors

prepare("cpu")

import jax  # noqa: E402
import numpy as np  # noqa: E402

from e2efly.courses.gates import Tracks  # noqa: E402
from e2efly.courses.random_tracks import RACING, random_tracks  # noqa: E402
from e2efly.courses.tracks import RaceTrack, track_names  # noqa: E402
from e2efly.environment import UNSEEN, Env, random_key  # noqa: E402
from e2efly.environment.episodes import Act, Episodes, run_episodes, run_stepwise, wilson  # noqa: E402
from e2efly.learning.judge import judge, score  # noqa: E402
from e2efly.learning.networks import Actor, Weights  # noqa: E402
from e2efly.learning.point import weights_of  # noqa: E402
from e2efly.learning.programs import Programs, acting  # noqa: E402
from e2efly.learning.setup import Setup  # noqa: E402
from e2efly.learning.warm_start import started_from  # noqa: E402
from e2efly.policy.zoo import policy_file  # noqa: E402
from e2efly.runs import presets  # noqa: E402
from e2efly.validation.candidate import candidate  # noqa: E402
from e2efly.validation.evaluation import act_of, evaluate  # noqa: E402

STARTS = 100
"""Of a track, where times are compared."""
RATE = 1e-3
"""Adam's step at the start of a specialist's training."""
EVERY = 62
"""Updates of a specialist between two evaluations."""
FEW = 10
"""Of a track of the other sampler."""


def elsewhere(rng: np.random.Generator) -> RaceTrack:
    """A walk from gate to gate, which shares no formula with the sampler of the training.

    A gate stands between the way to it and the way from it, turned by up to 0.3 rad; the way goes on within 1.2 rad of
    the gate's direction, for one gate in seven back over or under it; it leads 4 to 16 m far, within 1.5 m up or down.
    """
    count = rng.integers(3, 13)
    place, heading, places = np.array([0.0, 0.0, rng.uniform(1.0, 3.0)]), 0.0, []
    for _ in range(count + 1):
        places.append(place.copy())
        heading += rng.uniform(-1.2, 1.2)
        step = rng.uniform(4.0, 16.0) * np.array([math.cos(heading), math.sin(heading), 0.0])
        step[2] = rng.uniform(-1.5, 1.5)
        if rng.random() < 1 / 7:
            heading += math.pi
            step = np.array([0.5 * math.cos(heading), 0.5 * math.sin(heading), rng.choice([-1, 1]) * 2.5])
        if place[2] + step[2] < 1.2 or place[2] + step[2] > 7.0:
            step[2] = -step[2]
        place = place + step
    ways = np.diff(np.array(places), axis=0)
    to = np.arctan2(ways[:, 1], ways[:, 0])
    onward = np.append(to[1:], to[-1])
    yaw = to + np.angle(np.exp(1j * (onward - to))) / 2 + rng.uniform(-0.3, 0.3, count)
    opening = np.tile(rng.uniform(*RACING.opening, (count, 1)), 2)
    return RaceTrack("elsewhere", False, np.array(places[0]), float(to[0]), np.array(places[1:]), yaw, opening)


def drawn(n: int, seed: int) -> Tracks:
    """Tracks of the package's sampler."""
    return random_tracks(np.random.default_rng(seed).random((n, *RACING.numbers()), np.float32))


def one(tracks: Tracks, world: int) -> Tracks:
    """One of many, with room for as many gates as all."""
    return Tracks.of(tracks.track(world), RACING.most)


def on(env: Env, track: Tracks) -> Env:
    """The environment with a track in the place of its own."""
    return dataclasses.replace(env, task=dataclasses.replace(env.task, given=track))


def flier(act: Act, n: int, steps: int) -> Any:
    """(environment, key) -> episodes from n starts."""
    return lambda env, key: run_stepwise(env, act, key, n, steps)[0]


def told(case: str, flown: Episodes, tracks: int) -> dict[str, Any]:
    """A row of the table."""
    ok = np.asarray(flown.success)
    low, high = wilson(int(ok.sum()), len(ok))
    top = np.asarray(flown.top_speed)[ok]
    return {
        "tracks": case,
        "number": tracks,
        "laps": len(ok),
        "success, %": f"{100 * ok.mean():.1f}",
        "95 %": f"{100 * low:.1f} to {100 * high:.1f}",
        "time of a lap, s": f"{np.asarray(flown.duration)[ok].mean():.2f}",
        "top speed, m/s: median, 5 % and 95 %": f"{np.median(top):.1f}, {np.quantile(top, 0.05):.1f} to "
        f"{np.quantile(top, 0.95):.1f}",
    }


def specialists(policy: str, tracks: Tracks) -> Iterator[tuple[Weights, Setup, float]]:
    """The best policy of each track, the setup of all, and the seconds that its training took, without compilation."""
    config = presets.preset("race", "bptt", "any_track")
    steps = presets.preset("race", "bptt", presets.NOMINAL).steps
    task = dataclasses.replace(config.task, track=track_names()[0])
    algo = dataclasses.replace(config.algo, learning_rate=RATE)
    setup = Setup.of(dataclasses.replace(config, task=task, algo=algo, steps=steps, chunk=EVERY))
    config = setup.config
    first = started_from(setup.algorithm.init(setup.env, config.algo, 0), policy_file(policy), setup)
    programs = Programs.compile(setup, first)
    for world in range(len(tracks.count)):
        began, track = time.perf_counter(), one(tracks, world)
        env = on(setup.env, track)
        judges = {name: on(judged, track) for name, judged in setup.judges.items()}
        state, best, highest = programs.begin(env, first, random_key(world)), first.policy, -math.inf
        for update in range(0, setup.updates, config.chunk):
            state, _ = programs.chunk(env, config.algo, state, update, setup.updates)
            flown = judge(programs.evaluate, config.eval_episodes, weights_of(state), 1, config.eval_episodes, judges)
            if (now := score(config.task, flown)) > highest:
                best, highest = weights_of(state), now
        yield best, setup, time.perf_counter() - began


def beside(policy: str, tracks: Tracks) -> list[dict[str, Any]]:
    """The one policy and a specialist on each track."""
    found = candidate(policy, task={"track": track_names()[0]})
    (suite,) = found.task.criteria().values()
    env = found.environment(suite)
    steps, key = env.episode_steps, random_key(0, UNSEEN, 0)
    ours = flier(act_of(found.policy), STARTS, steps)
    rows = []

    @partial(jax.jit, static_argnums=0, compiler_options=wide_vectors(STARTS))
    def theirs(actor: Actor, env: Env, weights: Weights, key: Any) -> Episodes:
        return run_episodes(env, acting(actor, weights), key, STARTS, steps)

    for world, (weights, setup, seconds) in enumerate(specialists(policy, tracks)):
        track = one(tracks, world)
        judged = on(next(iter(setup.judges.values())), track)
        flown = ours(on(env, track), key), theirs(setup.actor, judged, weights, key)
        a, b = (jax.tree.map(np.asarray, x) for x in flown)
        both = a.success & b.success
        row = {
            "track": world,
            "gates": int(tracks.count[world]),
            "closed": bool(tracks.closed[world]),
            "success": float(a.success.mean()),
            "specialist": float(b.success.mean()),
            "seconds": float(a.duration[both].mean()) if both.any() else None,
            "specialist_seconds": float(b.duration[both].mean()) if both.any() else None,
            "trained_s": round(seconds, 1),
        }
        rows.append(row)
        print(row, flush=True)
    return rows


def compared(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The comparison with specialists in a few numbers."""
    able = [row for row in rows if row["specialist"] >= 0.9 and row["seconds"]]
    slower = np.array([row["seconds"] / row["specialist_seconds"] - 1 for row in able])
    return {
        "tracks": len(rows),
        "success": float(np.mean([row["success"] for row in rows])),
        "specialists_success": float(np.mean([row["specialist"] for row in rows])),
        "specialists_that_fly_90_percent": len(able),
        "slower_mean": float(slower.mean()),
        "slower_median": float(np.median(slower)),
        "slower_worst": float(slower.max()),
    }


def beside_row(races: list[dict[str, Any]]) -> dict[str, Any]:
    """A row of the table: the one policy's times over the specialists'."""
    c, laps = compared(races), STARTS * len(races)
    low, high = wilson(round(c["success"] * laps), laps)
    seconds, theirs = (
        np.mean([row[name] for row in races if row["seconds"]]) for name in ("seconds", "specialist_seconds")
    )
    return {
        "tracks": f"{len(races)} of the unseen, beside a specialist of each",
        "number": len(races),
        "laps": laps,
        "success, %": f"{100 * c['success']:.1f} (specialists: {100 * c['specialists_success']:.1f})",
        "95 %": f"{100 * low:.1f} to {100 * high:.1f}",
        "time of a lap, s": f"{seconds:.2f} (specialists: {theirs:.2f}; slower by {100 * c['slower_mean']:.0f} %)",
        "top speed, m/s: median, 5 % and 95 %": "",
    }


def flights(policy: str) -> list[dict[str, Any]]:
    """Rows of the table: unseen tracks, those that are shipped, another sampler's."""
    rows = [told("unseen, of the sampler that it was trained with", evaluate(policy, 1000).flown["race"], 1000)]
    print(rows[-1], flush=True)
    for name in track_names():
        rows.append(told(name, evaluate(policy, 1000, task={"track": name}).flown["race"], 1))
        print(rows[-1], flush=True)
    single = candidate(policy, task={"track": track_names()[0]})
    (suite,) = single.task.criteria().values()
    env, rng = single.environment(suite), np.random.default_rng(0)
    fly = flier(act_of(single.policy), FEW, env.episode_steps)
    each = [fly(on(env, Tracks.of(elsewhere(rng), RACING.most)), random_key(i, UNSEEN)) for i in range(100)]
    rows.append(told("of another sampler", jax.tree.map(lambda *x: np.concatenate(x), *each), len(each)))
    print(rows[-1], flush=True)
    return rows


def main() -> None:
    """Fly, train the specialists, print tables, write JSON."""
    options = arguments(__doc__ or "", policy="race_any", specialists=50, parts=["flights", "specialists"])
    path = options.json or RESULTS / "any_track.json"
    content = json.loads(path.read_text()) if path.exists() else {}
    if "flights" in options.parts:
        content["table"] = flights(options.policy)
        write("any_track", path, content)
    if "specialists" in options.parts:
        races = beside(options.policy, drawn(options.specialists, 1_000_000))
        others = [row for row in content.get("table", []) if "specialist" not in row["tracks"]]
        content |= {"specialists": races, "compared": compared(races), "table": [*others, beside_row(races)]}
        print(content["compared"])
        write("any_track", path, content)
    print(table(content["table"]))


if __name__ == "__main__":
    main()
