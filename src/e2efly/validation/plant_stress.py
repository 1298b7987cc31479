"""Fly the rows of `e2efly.validation.stress` on another plant. `e2efly validate --stress` does this."""

import dataclasses
import os
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.config.budget import check_memory
from e2efly.environment import UNSEEN, disturbance, random_key
from e2efly.environment.lost_commands import LostCommands
from e2efly.environment.pose_errors import PoseErrors
from e2efly.environment.stress_rows import ROWS, Draw, StressRow, check_seen
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.simulation.physics import State
from e2efly.validation.evaluation import SEED
from e2efly.validation.fleet import FleetFlight, FleetMission, fly_all
from e2efly.validation.law_step import BODY, LawStep
from e2efly.validation.plant import Plant
from e2efly.validation.plant_validation import SAMPLE, Pose, flyable, gate_flights, plant_name
from e2efly.validation.reality import Air, Reality, check_realities
from e2efly.validation.starts import draw_starts
from e2efly.validation.stress import Report, check_rows, draws, every_row, laws_of
from e2efly.validation.stress_laws import LAWS, LawSetting, StressLaw, steps_of
from e2efly.validation.task_verdict import Verdicts, judge
from e2efly.vehicles.vehicle import Controller, Vehicle

FLIGHTS = 10
"""Default number of starts per row and criterion. Each takes a second on MuJoCo or through the firmware."""
AIR = 45 * 8
"""Memory of the air, or of a law, in one control step, bytes."""


def stress(
    policy: str | os.PathLike[str],
    plant: str | type[Plant] = "mujoco",
    episodes: int = FLIGHTS,
    *,
    rows: tuple[str, ...] = (),
    vehicle: str | None = None,
    controller: Controller = "policy",
    seed: int = SEED,
    progress: Callable[[str, int, int], None] = lambda criterion, done, total: None,
    baseline: str | None = None,
    pose: Pose = "truth",
) -> Report:
    """Fly a policy with the bridge's runtime on a plant, in every row that the plant can simulate.

    The starts, and the draws of a row, are those of `stress.stress`. The random sequences of gusts, drift and noise in
    flight are different ones.

    Args:
        policy: a run directory, a policy.onnx, or the name of a task, which means the policy of the zoo for that task.
        plant: its name, its reference `path/to/file.py:Name` or `module:Name`, or a registered class.
        episodes: starts per row and criterion.
        rows: names of rows. If empty: all rows that the plant can simulate. The report names the others.
        vehicle: the vehicle of the nominal row, which the other rows change. If left out: the policy's own vehicle.
        controller: the vehicle to which the flight controller is tuned, in every row: policy or plant.
        seed: seed of the starts and of the rows' draws.
        progress: called as progress(criterion, number of finished flights, number of all flights).
        baseline: the hover controller that flies in place of the policy; see `e2efly.evaluate`.
        pose: who tells the policy where it is; see `e2efly.validate`.

    Raises:
        ValueError: naming the option, its value and what is accepted; or for a row that the plant cannot simulate.
        OSError: when the plant cannot be started.
    """
    if episodes <= 0:
        raise ValueError(f"--episodes is {episodes}; accepted: more than 0")
    check_rows(rows)
    compute_at_once()
    prepare("cpu")  # the plants compute on the CPU, one vehicle at a time
    found, kind, own = flyable(policy, plant, vehicle, controller, baseline=baseline)
    check_seen(rows, found.env.cameras)
    known = every_row(found.env.cameras)
    left_out = {row: lack for row in known if (lack := lacking(kind, ROWS.get(row) or LAWS[row]))}
    if refused := [row for row in rows if row in left_out]:
        raise ValueError(
            f"--rows has {refused[0]!r}, but plant {kind.name!r} cannot change {left_out[refused[0]]}; accepted: "
            + ", ".join(repr(name) for name in known if name not in left_out)
        )
    flown, believed = found.flown.body, found.flown.believed
    check_realities(kind, believed, [Reality(flown, 0.0)])
    chosen = [name for name in known if (name in rows if rows else name not in left_out)]
    suites = found.task.criteria()
    longest = max(float(suite.episode_s) for suite in suites.values()) * found.policy.contract.control_rate_hz
    check_memory({f"--episodes is {episodes}": float(episodes) * len(chosen) * len(suites) * longest * (SAMPLE + AIR)})
    report: dict[str, dict[str, Verdicts]] = {row: {} for row in chosen}
    for name, suite in suites.items():
        env = found.environment(suite)
        if env.agents > 1:
            raise ValueError(
                f"task.agents is {env.agents}; accepted for --stress: a task with one vehicle in a world (without it, "
                "`e2efly validate` flies worlds of several)"
            )
        starts = draw_starts(env, episodes, seed)
        steps = env.episode_steps
        begins = list(zip(starts.states, starts.courses, strict=True))
        asked = []
        for row in chosen:
            drawn = draws(ROWS.get(row, ROWS["nominal"]), flown, env.latency, seed, episodes)
            meets = realities(drawn, flown, seed, steps, env.control_period)
            if told := told_law(drawn, flown, seed, steps, env.control_period):
                meets = [dataclasses.replace(met, law=told.of(i)) for i, met in enumerate(meets)]
            if row in LAWS:
                meets = under_law(LAWS[row], meets, flown, seed, steps, env.control_period)
            seen = starts.sights(env, seed, drawn.camera)
            eyes = gate_flights(pose, starts.courses, seed)
            each = zip(begins, meets, seen, eyes, strict=True)
            asked += [FleetFlight(*begin, met, sees, gates) for begin, met, sees, gates in each]
        mission = FleetMission(found.file, plant_name(plant), own, believed, float(suite.episode_s), baseline=baseline)
        total = len(asked)
        flights = fly_all(mission, asked, lambda done: progress(name, done, total))  # noqa: B023
        for i, row in enumerate(chosen):
            report[row][name] = judge(env, starts, flights[i * episodes : (i + 1) * episodes], suite.settling_s)
    return Report(found, seed, report, plant=kind.name, left_out={} if rows else left_out)


def lacking(kind: type[Plant], row: StressRow | StressLaw) -> str:
    """The changes that a row requires and a plant cannot make. Empty: there are none."""
    return ", ".join(sorted(row.alters - kind.alters))


def realities(drawn: Draw, vehicle: Vehicle, seed: int, steps: int, period: float) -> list[Reality]:
    """The conditions of the flights of a row, which last at most `steps` periods, s. The vehicle is the nominal one."""
    key, n = random_key(seed, UNSEEN, 0), len(drawn.latency)
    gust, drift, share = (np.asarray(x, np.float64) for x in _tracks(drawn.disturbance, key, steps, period))
    noise = np.stack([np.asarray(x, np.float64)[:, 0] for x in vars(drawn.noise).values()], axis=1)  # (n, 4)
    white = np.random.default_rng([seed, UNSEEN, n]).standard_normal((steps, n, 12))
    error = white * np.repeat(noise, 3, axis=1)
    error[..., 6:9] /= 2
    error[..., 0:3] += drift
    wind = gust + drawn.wind
    calm = not (wind.any() or error.any() or (share != 1).any())
    return [
        Reality(
            drawn.vehicle(vehicle, i),
            float(drawn.latency[i]),
            bool(drawn.disturbance.plain_mixer[i]),
            None if calm else Air(wind[:, i], share[:, i], error[:, i]),
        )
        for i in range(n)
    ]


def told_law(drawn: Draw, vehicle: Vehicle, seed: int, steps: int, period: float) -> LawStep | None:
    """The errors of the poses and the lost commands of the flights of a row; None: there are none.

    What happens when is another random sequence than that of the training simulator.
    """
    told, lost, n = drawn.estimate, drawn.link, len(drawn.latency)
    if not any(np.any(x) for x in (*told.values(), lost["dropped"], lost["silence"])):
        return None
    place = jnp.zeros((n, 3))
    errors = PoseErrors.of(**told, seen=State(place, place, jnp.zeros((n, 4)), place, jnp.zeros((n, 4))))
    link, key = LostCommands(**lost, arrived=jnp.zeros((n, 1, 4))), random_key(seed, UNSEEN, 1)
    held, wrong, lacks = (np.asarray(x, np.float64) for x in _told(errors, link, key, steps, period))
    error = np.zeros((steps, n, 12))
    error[..., 0:3], error[..., 6:8] = wrong[..., None] * told["jump"], told["turned"][:, 1:] / 2
    still = steps_of(None, LawSetting(vehicle, np.random.default_rng(0), n, steps, period))
    lag, heading = (np.broadcast_to(x, (steps, *x.shape)) for x in (told["lag"], told["turned"][:, 0]))
    return dataclasses.replace(still, lag=lag, error=error, heading=heading, held=held, lost=lacks)


def under_law(
    law: StressLaw, meets: list[Reality], vehicle: Vehicle, seed: int, steps: int, period: float
) -> list[Reality]:
    """The same flights under a law. The vehicle is the nominal one."""
    whole = laws_of(law, vehicle, seed, len(meets), steps, period)
    first = whole.at(0)
    largest = first.ceiling * vehicle.thrust_range[1]
    of_body = {name: getattr(first, name) for name in BODY} | {"rotor_thrust_max": largest}
    of_body = {name: values for name, values in of_body.items() if name in law.alters}
    return [
        dataclasses.replace(
            met, body=dataclasses.replace(met.body, **{name: x[i] for name, x in of_body.items()}), law=whole.of(i)
        )
        for i, met in enumerate(meets)
    ]


@partial(jax.jit, static_argnums=2)
def _tracks(d: disturbance.Disturbance, key: jax.Array, steps: int, period: float) -> tuple[jax.Array, ...]:
    """Gusts (t, n, 3), m/s; drift (t, n, 3), m; shares of thrust (t, n, 4): at the start of each control step."""

    def step(d: disturbance.Disturbance, k: jax.Array) -> tuple[disturbance.Disturbance, tuple[Any, ...]]:
        now = d.gust, d.drift, d.share(jnp.full(d.sag.shape, k / steps))
        return disturbance.advance(d, jax.random.fold_in(key, k), period), now

    return jax.lax.scan(step, jax.tree.map(jnp.asarray, d), jnp.arange(steps))[1]


@partial(jax.jit, static_argnums=3)
def _told(errors: PoseErrors, link: LostCommands, key: jax.Array, steps: int, period: float) -> tuple[jax.Array, ...]:
    """Whether a pose is repeated, whether it jumps, and whether the command is lost: (t, n), in each control step."""

    def step(errors: PoseErrors, k: jax.Array) -> tuple[PoseErrors, tuple[Any, ...]]:
        pose, command = jax.random.split(jax.random.fold_in(key, k))
        time = jnp.full(errors.hold.shape, k * period)
        return errors.counted(pose, period), (errors.left > 0, errors.wrong, link.loses(command, time))

    return jax.lax.scan(step, errors, jnp.arange(steps))[1]
