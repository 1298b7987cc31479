"""Results of a policy in the rows of the stress: those that trainings draw from, and laws that none draws from.

One compiled program flies all rows of the first kind, and one all of the second.
"""

import dataclasses
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.config import CameraConfig
from e2efly.config.names import unknown
from e2efly.environment import UNSEEN, Env, random_key
from e2efly.environment.disturbance import level
from e2efly.environment.episodes import Act, Episodes, EpisodesUnderWay, run_stepwise, summary
from e2efly.environment.stress_rows import ROWS, Draw, StressRow, check_seen, rows_for, with_longer_queue
from e2efly.simulation.device import fast_compile, prepare, wide_vectors
from e2efly.simulation.physics import RateLoop
from e2efly.validation.candidate import Candidate, candidate
from e2efly.validation.evaluation import BATCH, SEED, act_of
from e2efly.validation.law_step import BODY, LawMemory, LawStep, air_of, arrived, observed
from e2efly.validation.stress_laws import LATEST, LAWS, LawSetting, StressLaw, steps_of
from e2efly.vehicles.vehicle import Controller, Vehicle

for _kind in (LawStep, LawMemory):
    jax.tree_util.register_dataclass(_kind, data_fields=[f.name for f in dataclasses.fields(_kind)], meta_fields=[])


@dataclass(frozen=True)
class Report:
    """Results of a policy in each row."""

    candidate: Candidate
    seed: int
    flown: dict[str, dict[str, Any]]
    """For each row and criterion: `Episodes`, or the verdicts on a plant; NumPy arrays."""
    plant: str = "training"
    """Where it flew: the training simulator, or a plant."""
    left_out: Mapping[str, str] = field(default_factory=dict)
    """Rows that the plant cannot reproduce, and what it cannot change."""

    @property
    def success(self) -> dict[str, float]:
        """The success rate of the worst criterion, by row."""
        return {row: min(float(np.mean(e.success)) for e in criteria.values()) for row, criteria in self.flown.items()}

    @property
    def trained(self) -> "Report":
        """The report of the rows that trainings draw from."""
        return self._only(lambda row: row not in LAWS)

    @property
    def untrained(self) -> "Report":
        """The report of the rows from laws that no training draws from."""
        return self._only(lambda row: row in LAWS)

    def _only(self, kept: Callable[[str], bool]) -> "Report":
        flown, left_out = ({row: x for row, x in of.items() if kept(row)} for of in (self.flown, self.left_out))
        return dataclasses.replace(self, flown=flown, left_out=left_out)

    @property
    def worst(self) -> str:
        """The row with the lowest success rate."""
        return min(self.success, key=lambda row: self.success[row])

    def as_json(self) -> dict[str, Any]:
        """The report that `--stress --json` writes: a summary by row and criterion, of each kind of rows."""
        blocks = {"stress": self.trained.flown, "untrained": self.untrained.flown}
        return {
            **self.candidate.as_json(),
            "plant": self.plant,
            "seed": self.seed,
            "left_out": dict(self.left_out),
            **{
                kind: {row: {name: summary(e) for name, e in found.items()} for row, found in flown.items()}
                for kind, flown in blocks.items()
            },
        }


def every_row(cameras: tuple[CameraConfig, ...]) -> tuple[str, ...]:
    """The names of all rows that apply to a policy with these cameras, in the order of the tables."""
    return (*rows_for(cameras), *LAWS)


def check_rows(rows: tuple[str, ...]) -> None:
    """Refuse a row that does not exist.

    Raises:
        ValueError: naming it, the nearest name and all known names.
    """
    for name in rows:
        if name not in ROWS and name not in LAWS:
            raise ValueError(unknown("stress", name, (*ROWS, *LAWS)))


def stress(
    policy: str | os.PathLike[str],
    episodes: int = 1000,
    *,
    rows: tuple[str, ...] = (),
    vehicle: str | None = None,
    controller: Controller = "policy",
    seed: int = SEED,
    device: str | None = None,
    baseline: str | None = None,
) -> Report:
    """Fly a policy's file in every row of `ROWS` and under every law of `LAWS`, from the unseen starts of `evaluate`.

    Args:
        policy: a run directory, a policy.onnx, or the name of a task: the zoo's policy of it.
        episodes: starts per row and criterion.
        rows: names of rows. Empty: all rows; the rows of cameras only if the policy has cameras.
        vehicle: the vehicle that flies in the nominal row and that the other rows change. If omitted, the policy's own
            vehicle.
        controller: the vehicle for which the flight controller is tuned in every row: policy or plant.
        seed: the seed of the starts.
        device: cpu or gpu.
        baseline: the hover controller that flies in place of the policy; see `evaluate`.

    Raises:
        ValueError: naming the option, its value and what is accepted.
    """
    if episodes <= 0:
        raise ValueError(f"--episodes is {episodes}; accepted: more than 0")
    check_rows(rows)
    prepare(device)
    found = candidate(policy, vehicle, controller, baseline=baseline)
    if found.draws:
        raise ValueError(
            f"--vehicle is {vehicle or 'left out'}; accepted with --stress: one vehicle within the ranges of "
            f"{found.vehicle}, about which the rows lie"
        )
    check_seen(rows, found.env.cameras)
    return Report(found, seed, fly_rows(found, rows or every_row(found.env.cameras), episodes, seed))


def fly_rows(found: Candidate, rows: tuple[str, ...], episodes: int, seed: int) -> dict[str, dict[str, Episodes]]:
    """Fly `episodes` starts per row and criterion."""
    flown: dict[str, dict[str, Episodes]] = {row: {} for row in rows}
    for name, suite in found.task.criteria().items():
        env = with_longer_queue(found.environment(suite))
        steps, settle, size = env.episode_steps, suite.settling_s, env.whole(BATCH)
        for row in rows:
            parts = []
            for i in range(-(-episodes // size)):
                draw = draw_of(ROWS.get(row, ROWS["nominal"]), env.physics.flown, env.latency, seed, i, size)
                draw = jax.tree.map(lambda x: np.asarray(x, np.float32), draw)
                key, act = random_key(seed, UNSEEN, i), act_of(found.policy)
                if row in LAWS:
                    law = law_of(LAWS[row], found.flown.body, seed, i, steps, env.control_period, size)
                    parts.append(fly_law(draw.env(env), act, key, draw, law, settle))
                else:
                    altered = partial(draw.state, env)
                    parts.append(run_stepwise(draw.env(env), act, key, size, steps, settle, altered)[0])
            flown[row][name] = jax.tree.map(lambda *x: np.concatenate(x)[:episodes], *parts)
    return flown


def fly_law(env: Env, act: Act, key: Array, draw: Draw, law: LawStep, settle: float) -> Episodes:
    """`run_stepwise` for a batch of episodes under a law, whose control steps are all of the longest episode.

    Everything else is as in the nominal row, which is `draw`.
    """
    size = env.whole(BATCH)
    begin, after = _programs(bool(env.cameras), size)
    flight, felt, sent = begin(env, key, draw, law.at(0))
    memory = act.begin(size)
    for k in range(env.episode_steps):
        seen = tuple(np.asarray(image) for image in flight.state.images)
        action, memory = act.act(np.asarray(flight.observation), seen, memory)
        flight, felt, sent = after(env, flight, action, settle, draw, (law.at(k), law.at(k + 1)), felt, sent)
        if np.all(flight.over):
            break
    return jax.tree.map(np.asarray, flight.episodes(env))


@cache
def _programs(seeing: bool, size: int) -> tuple[Callable, Callable]:
    """The compiled programs for `size` episodes under a law: their start and a step."""

    def begin(env: Env, key: Array, draw: Draw, now: LawStep) -> tuple[EpisodesUnderWay, LawMemory, Array]:
        state, _ = env.reset(key, size)
        state = draw.state(env, state)
        vehicle = dataclasses.replace(env.physics.flown, gyro_time_constant=now.gyro_time_constant)
        loop = RateLoop.at_rest(vehicle, state.vehicle.body_rate)  # with a filter, which may be none
        state = dataclasses.replace(state, vehicle=dataclasses.replace(state.vehicle, rate_loop=loop))
        felt = LawMemory.of(env.sensed(state), state.actions[:, 0], env.control_period, LATEST)
        seen, felt = observed(now, felt, env.sensed(state), env.control_period)
        return EpisodesUnderWay.of(state, env.shown(state, seen)), felt, state.actions

    def after(
        env: Env,
        flight: EpisodesUnderWay,
        action: Array,
        settle: Any,
        draw: Draw,
        steps: tuple[LawStep, LawStep],
        felt: LawMemory,
        sent: Array,
    ) -> tuple[EpisodesUnderWay, LawMemory, Array]:
        """`EpisodesUnderWay.after`, with the past actions that the policy has sent, which need not have arrived."""
        (now, then), state = steps, flight.state
        arrives, felt = arrived(now, felt, action)
        wind, share = air_of(now, state.vehicle)
        plant: dict[str, Any] = {**draw.plant, **{name: getattr(now, name) for name in BODY}}
        plant["mass"] = plant["mass"] * now.mass
        plant["rotor_position"] = plant["rotor_position"] - level(now.shift[:, None], plant["rotor_position"])
        ceiling = jnp.broadcast_to(now.ceiling[:, None], share.shape)
        disturbance = dataclasses.replace(draw.disturbance, rotor_share=share, ceiling=ceiling)
        latency = draw.latency + now.later
        state = dataclasses.replace(state, plant=plant, wind=wind, disturbance=disturbance, action_latency=latency)
        flight = dataclasses.replace(flight, state=state).after(env, arrives, settle)
        sent = jnp.concatenate([action[:, None], sent[:, :-1]], axis=1)
        state = flight.state
        seen, felt = observed(then, felt, env.sensed(state), env.control_period)
        shown = dataclasses.replace(state, actions=sent)
        if state.imu is not None:
            gyroscope = state.imu.gyroscope + then.error[:, 9:12]
            shown = dataclasses.replace(shown, imu=dataclasses.replace(state.imu, gyroscope=gyroscope))
        return dataclasses.replace(flight, observation=env.shown(shown, seen)), felt, sent

    options = wide_vectors(size) | ({} if seeing else fast_compile())
    first, further = (jax.jit(program, compiler_options=options) for program in (begin, after))
    return first, further


def laws_of(law: StressLaw, vehicle: Vehicle, seed: int, n: int, steps: int, period: float) -> LawStep:
    """The control steps of the first n flights under a law. They do not depend on the number of flights."""
    batches = [law_of(law, vehicle, seed, i, steps, period) for i in range(-(-n // BATCH))]
    return jax.tree.map(
        lambda *x: np.concatenate([part[:, : n - i * BATCH] for i, part in enumerate(x)], axis=1), *batches
    )


def law_of(
    law: StressLaw, vehicle: Vehicle, seed: int, batch: int, steps: int, period: float, size: int = BATCH
) -> LawStep:
    """The control steps of a law for a batch of the starts of a seed. The vehicle is the nominal one."""
    rng = np.random.default_rng([seed, UNSEEN, batch, len(LAWS), list(LAWS).index(law.name)])
    return steps_of(law, LawSetting(vehicle, rng, size, steps, period))


def draws(row: StressRow, vehicle: Vehicle, latency: float, seed: int, n: int) -> Draw:
    """The first n episodes of a row for the seed of the starts. They do not depend on the number of episodes."""
    batches = [draw_of(row, vehicle, latency, seed, i) for i in range(-(-n // BATCH))]
    return jax.tree.map(lambda *x: np.concatenate(x)[:n], *batches)


def draw_of(row: StressRow, vehicle: Vehicle, latency: float, seed: int, batch: int, size: int = BATCH) -> Draw:
    """A batch of episodes of a row."""
    rng = np.random.default_rng([seed, UNSEEN, batch, list(ROWS).index(row.name)])
    return Draw.of(row, vehicle, latency, rng, size)
