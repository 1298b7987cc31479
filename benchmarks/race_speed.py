"""Racing at a commanded speed: each policy of the zoo on each track, at each speed.

    python benchmarks/race_speed.py [--policies vis_r/race_speed ...] [--tracks room_4 ...] [--speeds 2 3 5 8 12]

Percent of the starts whose race succeeds: two laps, one of an open track. The gates are where the track's file has
them, the vehicle is that of its file (of *any quadrotor* a random one), in still air; `random vehicles` are those of
the policy's training, in its winds and gusts, on half of as many starts. Speeds are means along the way from the first
gate on, of the races that succeed, and the highest of all. `to the wall` is the smallest distance of any race's path to
the walls of the track's room, and `under the ceiling` that to its ceiling: these are of the vehicle of the file. Where
a track allows no more than two or more of the speeds, it is flown at the lowest of them. Rows that are not measured
anew stay.

The starts have a seed of their own (`JUDGED`), by which no recipe and no policy was chosen.
"""

import dataclasses
import json
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from common import arguments, table, with_earlier, write

from e2efly.courses.defaults import ROOMS, TRACKS
from e2efly.courses.gates import STRAIGHT_ON
from e2efly.courses.tracks import load_track
from e2efly.environment import UNSEEN, Env, random_key
from e2efly.policy.zoo import config_file, contents
from e2efly.runs.inputs import from_json
from e2efly.simulation.device import prepare
from e2efly.tasks.race_speed.goal import QUICKEST
from e2efly.validation.candidate import Candidate, candidate
from e2efly.validation.evaluation import act_of

BATCH = 250
"""Starts that are flown at once."""
LAPS = 2
"""Laps of a closed track."""
JUDGED = 6_000_000
"""Seed of the starts."""


def flown_at(name: str, speeds: list[float]) -> list[float]:
    """The speeds that a track allows, and the lowest of those that are more than it allows."""
    track = load_track(name)
    ways = np.linalg.norm(np.diff(track.position, axis=0, append=track.position[:1]), axis=1)
    most = QUICKEST * max(ways if track.closed else [*ways[:-1], STRAIGHT_ON])
    return [*sorted(v for v in speeds if v < most), *sorted(v for v in speeds if v >= most)[:1]]


def on(env: Env, name: str, speed: float) -> Env:
    """The environment of one track, its gates in their places, at one speed. It shares its program with all others."""
    row, task = TRACKS.index(name), env.task
    given = jax.tree.map(lambda x: x[row : row + 1], task.given)
    laps = LAPS if given.closed.all() else 1
    config = dataclasses.replace(
        task.config, speed=(speed, speed), gate_position=0.0, gate_yaw=0.0, laps=laps, episode_s=60.0
    )
    return dataclasses.replace(env, task=dataclasses.replace(task, config=config, given=given))


@jax.jit
def begun(env: Env, key: Any) -> Any:
    """Starts."""
    return env.reset(key, BATCH)


@jax.jit
def stepped(env: Env, state: Any, action: Any) -> Any:
    """A step: state, what the policy is shown, and what is recorded."""
    reached, out = env.step(state, action, restart=False)
    vehicle, memory = reached.vehicle, reached.memory
    speed = jnp.linalg.norm(vehicle.velocity, axis=-1)
    return reached, out.final_observation, (vehicle.position, speed, memory.passed, out.done, out.success)


def flown(found: Candidate, env: Env, key: Any) -> tuple[np.ndarray, ...]:
    """Position (t, n, 3), speed (t, n), gates passed, whether it is still racing, and the success (n,)."""
    act = act_of(found.policy)
    (state, observation), memory, rows = begun(env, key), act.begin(BATCH), []
    over, success = np.zeros(BATCH, bool), np.zeros(BATCH, bool)
    for _ in range(int(60.0 / float(env.control_period))):
        action, memory = act.act(np.asarray(observation), (), memory)
        state, observation, told = stepped(env, state, action)
        position, speed, passed, done, succeeded = map(np.asarray, told)
        rows.append((position, speed, passed, ~over))
        success |= succeeded & ~over
        over = over | done
        if over.all():
            break
    return *(np.stack(x) for x in zip(*rows, strict=True)), success


def measured(found: Candidate, still: Env, drawn: Env, name: str, speed: float, starts: int) -> dict[str, Any]:
    """The figures of one track at one speed."""

    def parts(env: Env, n: int) -> list[tuple[np.ndarray, ...]]:
        return [flown(found, on(env, name, speed), random_key(JUDGED, UNSEEN, i)) for i in range(-(-n // BATCH))]

    along, far, high, top, success = [], 0.0, 0.0, 0.0, []
    for position, fast, passed, live, succeeded in parts(still, starts):
        way = live & (passed > 0)
        along.append((fast * way).sum(0)[succeeded] / way.sum(0)[succeeded])
        far = max(far, np.abs(position[live][:, :2]).max())
        high, top = max(high, position[live][:, 2].max()), max(top, fast[live].max())
        success.append(succeeded)
    others = np.concatenate([succeeded for *_, succeeded in parts(drawn, starts // 2)])
    share, speeds = float(np.concatenate(success).mean()), np.concatenate(along)
    row = {"track": name, "commanded, m/s": speed, "starts": BATCH * len(success)}
    row |= {"success, %": round(100 * share, 1), "random vehicles, %": round(100 * float(others.mean()), 1)}
    mean = round(float(speeds.mean()), 2) if len(speeds) else None
    row |= {"mean speed, m/s": mean, "top speed, m/s": round(float(top), 1)}
    side, ceiling = ROOMS.get(name, (np.nan, np.nan))
    walls = {"to the wall, m": side / 2 - far, "under the ceiling, m": ceiling - high}
    return row | {what: round(float(x), 2) if np.isfinite(x) else "-" for what, x in walls.items()}


def main() -> None:
    """Fly, print a table, write the figures."""
    every = [f"{vehicle}/race_speed" for vehicle, tasks in contents().items() if "race_speed" in tasks]
    options = arguments(
        __doc__ or "", policies=every, tracks=[*ROOMS, "four_gates"], speeds=[2.0, 3.0, 5.0, 8.0, 12.0], starts=500
    )
    prepare("cpu")
    rows, whole = [], []
    for policy in options.policies:
        found = candidate(policy, task={"track": TRACKS})
        (suite,) = found.task.criteria().values()
        trained = from_json(json.loads(config_file(found.file).read_text()), policy)
        envs = [dataclasses.replace(found, env=env).environment(suite) for env in (found.env, trained.env)]
        for name in options.tracks:
            for speed in flown_at(name, options.speeds):
                rows.append({"policy": policy, **measured(found, *envs, name, speed, options.starts)})
                print(rows[-1], flush=True)
        earlier = with_earlier("race_speed", options.json, "table", ("policy", "track", "commanded, m/s"), rows)
        whole = sorted(earlier, key=lambda row: row["policy"])
        write("race_speed", options.json, {"table": whole})
    print(table(whole))


if __name__ == "__main__":
    main()
