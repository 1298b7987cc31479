"""The configurations with which a task is learned: robust, nominal, the paper's, and variants. Imports no JAX.

A preset is a `TrainConfig`. A variant of one is made by `dataclasses.replace`.
"""

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from e2efly.config import (
    ALGORITHMS,
    AlgorithmConfig,
    DisturbanceConfig,
    EnvConfig,
    EstimateConfig,
    LinkConfig,
    NoiseConfig,
    RewardConfig,
    TaskConfig,
    TrainConfig,
)
from e2efly.config.algorithms import EXPERT
from e2efly.config.names import unknown
from e2efly.config.numbers import check_fields
from e2efly.config.registry import is_shipped
from e2efly.config.tables import LARGEST
from e2efly.policy import zoo
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.runs.paper import NAMES, authors, papers
from e2efly.runs.sizes import for_device
from e2efly.tasks import TASKS
from e2efly.vehicles import posterior
from e2efly.vehicles.family import load_family
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

ROBUST, IDENTIFIED, NOMINAL = "robust", "identified", "nominal"
PAPER, AUTHORS = NAMES
FAMILY = "any"
"""The family whose policies of the zoo are the starting points of the preset `identified`."""
OTHERS = EnvConfig(
    latency_spread=(0.04, 0.05),
    randomize={
        "mass": 0.25, "inertia": 0.5, "motor_time_constant": 0.8, "drag_linear": 0.9, "drag_quadratic": 0.9,
        "torque_ratio": 0.3, "rate_gain": 0.5,
    },
    wind=5.0,
    disturbance=DisturbanceConfig(
        gust=1.5, thrust=0.25, rotor=0.1, sag=0.2, centre_of_mass=0.006, ceiling=0.1, push=0.1
    ),
    estimate=EstimateConfig(
        position_lag=0.04, velocity_lag=0.08, attitude_lag=0.03, body_rate_lag=0.02, yaw=0.09, tilt=0.035, jump=0.1,
        hold=4.0,
    ),
    link=LinkConfig(dropped=0.1, silence=0.2),
    noise=NoiseConfig(position=0.01, velocity=0.05, attitude=0.005, body_rate=0.02),
)  # fmt: skip
"""The vehicles of the preset `robust`, the air, the state estimate and the link."""
AROUND = dataclasses.replace(
    OTHERS,
    randomize={**OTHERS.randomize, posterior.IDENTIFIED: 1.0},
    disturbance=dataclasses.replace(OTHERS.disturbance, plain_mixer=0.3),
)
"""The vehicles of the preset `identified`: the uncertainty that the file's standard deviations give, and about each of
these vehicles what the preset `robust` draws, with two kinds of mixers."""
ONE_OF_A_FAMILY = 6
"""Factor by which the preset `identified` has fewer steps than the recipe for a family. It begins with a policy of that
family."""
BESIDE_CAMERA = {"angle_spread": 0.06, "position_spread": 0.012, "fov_spread": 0.04}
"""Variations of cameras that the preset `robust` draws in addition to those of the task."""
OLDER = 0.05
"""Largest additional age of images in the preset `robust`, s."""
BESIDE_FAMILY = EnvConfig(
    latency_spread=(0.0, 0.012),
    randomize={"inertia": 0.2, "motor_time_constant": 0.2, "rate_gain": 0.2},
    wind=2.0,
    disturbance=DisturbanceConfig(gust=0.3, thrust=0.1, rotor=0.03, sag=0.1),
)
"""Effects that the preset `robust` draws for a family in addition to its vehicles, because their files do not give
them."""


def names() -> tuple[str, ...]:
    """The names of all presets. Not every task has each."""
    own = dict.fromkeys(name for task in TASKS.values() for name in task.variants)
    return ROBUST, IDENTIFIED, NOMINAL, PAPER, AUTHORS, *own


def completed(
    task: str, algo: str | None = None, name: str | None = None, given: Callable[[str], Any] = lambda option: None
) -> tuple[str, str]:
    """The algorithm and the preset of a training for which not both are named: the algorithm that learns the task best;
    robust, if the algorithm has a recipe for it, otherwise nominal.

    `given` is the function from the name of a task option to its value: some values require presets of their own.
    """
    options = TASKS.find(task)
    algo = algo or options.best
    usual = ROBUST if ALGORITHMS.find(algo).name in options.robust else NOMINAL
    asked = (preset for (option, value), preset in options.asked.items() if given(option) == value)
    return algo, name or next(asked, usual)


def starting(
    task: str, algo: str, name: str, vehicle: str | None = None, start_from: str | None = None, device: str = "cpu"
) -> TrainConfig:
    """The configuration from which the options of a training depart: a preset (`preset`), for a vehicle
    (`for_vehicle`), for a device (`for_device`) and for a policy whose weights it starts from (`gentle`).
    """
    config = preset(task, algo, name)
    config = config if vehicle is None else for_vehicle(config, vehicle)
    config = for_device(config, name, device)
    return config if start_from is None else dataclasses.replace(gentle(config), start_from=start_from)


def changed(defaults: TrainConfig, given: TrainConfig) -> TrainConfig:
    """The configuration for options that depart from a configuration, whichever it is.

    The reward and `env.randomize` of `given` are changes: a number is added or replaced, and 0 removes one.
    """
    own = defaults.env.randomize
    if given.env.randomize.get(posterior.IDENTIFIED):  # the preset's draws are of a vehicle that nobody has measured
        known = {entry.field for entry in posterior.load_posterior(given.env.vehicle).entries}
        own = {name: width for name, width in own.items() if name not in known}
    weights = _merged(defaults.reward.weights, given.reward.weights)
    reward = RewardConfig(weights, {**defaults.reward.parameters, **given.reward.parameters})
    env = dataclasses.replace(given.env, randomize=_merged(own, given.env.randomize))
    return begun(dataclasses.replace(given, reward=reward, env=env))


def _merged(own: Mapping[str, float], given: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in {**own, **given}.items() if value != 0}


def preset(task: str, algo: str, name: str = NOMINAL) -> TrainConfig:
    """The configuration of a task and an algorithm.

    Args:
        task: name of the task, or a reference to the user's own: `path/to/file.py:Name`, `package.module:Name`.
        algo: name of the algorithm, or a reference to the user's own.
        name: one of `names()`.

    Raises:
        ValueError: for an unknown name, with the nearest one and all names; or for a preset that the task does not
            have.
    """
    options = TASKS.find(task)
    learner = ALGORITHMS.find(algo)
    if name not in names():
        raise ValueError(unknown("preset", name, names()))
    if name == PAPER:
        return papers(options, learner.name)
    if name == AUTHORS:
        return authors(options, learner.name)
    config = _nominal(options, learner)
    if name == NOMINAL:
        return config
    if name in (ROBUST, IDENTIFIED):
        return _adaptive(options, config, name)
    if name not in options.variants:
        having = ", ".join(other for other, known in TASKS.items() if name in known.variants)
        raise ValueError(f"preset {name!r}: accepted for task {having}, not {options.name!r}")
    return options.variant(name, config)


def _nominal(task: type[TaskConfig], learner: type[AlgorithmConfig]) -> TrainConfig:
    """The task's recipe.

    For a user's own algorithm: its defaults, with the recipe of the algorithm that it resembles.
    """
    if not is_shipped(learner):
        return dataclasses.replace(task.recipe(learner.like), algo=learner())
    if learner.exact and learner.name != "bptt":
        return _with_critic(task, learner.name)
    config = task.recipe(learner.name)
    return config if isinstance(config.algo, learner) else dataclasses.replace(config, algo=learner())


def _with_critic(task: type[TaskConfig], algo: str) -> TrainConfig:
    """BPTT's preset with critics, and with rewards that suit them."""
    config = task.recipe("bptt")
    shared = ("max_grad_norm", "gradient_decay") if algo == "foppo" else (
        "max_grad_norm", "gradient_decay", "learning_rate", "learning_rate_end", "envs"
    )  # fmt: skip
    taken: dict[str, Any] = {name: getattr(config.algo, name) for name in shared} | task.with_critic(algo)
    smooth = task.smooth
    reward = task.recipe("ppo").reward if smooth is None else RewardConfig(dict(smooth), config.reward.parameters)
    return dataclasses.replace(config, algo=ALGORITHMS[algo](**taken), reward=reward)


def _adaptive(task: type[TaskConfig], config: TrainConfig, name: str) -> TrainConfig:
    """A different vehicle in every episode, and a policy with a memory that senses it."""
    algo = config.algo.name
    given = (task.identified if name == IDENTIFIED else {}).get(algo, task.robust.get(algo))
    if name == IDENTIFIED and (other := task.family.get(algo)):
        # the zoo's policy for any quadrotor also flies this vehicle, and adapts to it in a few steps
        given = dataclasses.replace(given or other, steps=other.steps // ONE_OF_A_FAMILY, eased=None)
        if task.name in zoo.contents().get(FAMILY, {}):
            config = dataclasses.replace(config, start_from=f"{FAMILY}/{task.name}")
    if given is None:
        raise ValueError(
            f"preset {name!r}: accepted for {_having('robust')}; not for {task.name} by {config.algo.name}"
        )
    cameras = tuple(
        dataclasses.replace(c, latency=(c.latency[0], c.latency[1] + OLDER), **BESIDE_CAMERA)
        for c in config.env.cameras
    )
    env = AROUND if name == IDENTIFIED else OTHERS
    env = dataclasses.replace(env, cameras=cameras, payload=config.env.payload)
    return given.into(dataclasses.replace(config, env=env))


def _having(recipes: str) -> str:
    """The tasks that have a recipe, with the algorithms of each recipe."""
    found = {name: getattr(known, recipes) for name, known in TASKS.items()}
    return ", ".join(f"{name} by {' or '.join(by)}" for name, by in found.items() if by)


def for_vehicle(config: TrainConfig, vehicle: str) -> TrainConfig:
    """A configuration for another vehicle or a family, given by name or .toml file.

    If the weakest vehicle of the preset `robust` or `identified` could not hover, the ranges of mass and thrust are all
    reduced by the same factor. The centre of mass is drawn no farther off than the rate loop can hold (`_held`). For a
    family the preset draws `BESIDE_FAMILY`, and learns as the task specifies for families.

    Raises:
        ValueError: for a vehicle that does not exist.
    """
    env = dataclasses.replace(config.env, vehicle=vehicle)
    robust = any((env.randomize, env.disturbance) == (drawn.randomize, drawn.disturbance) for drawn in (OTHERS, AROUND))
    if robust and load_family(vehicle) is not None:
        given = config.task.family.get(config.algo.name)
        if given is None:
            raise ValueError(
                f"--vehicle is {vehicle}, a family; accepted by preset 'robust' for {_having('family')}; not for "
                f"{config.task.name} by {config.algo.name}"
            )
        env = dataclasses.replace(BESIDE_FAMILY, vehicle=vehicle, cameras=env.cameras)
        return given.into(dataclasses.replace(_nominal(type(config.task), type(config.algo)), env=env))
    if robust:
        known, sure = load_vehicle(vehicle), 1.0
        if posterior.IDENTIFIED in env.randomize:
            sure -= posterior.WIDEST * posterior.load_posterior(vehicle).thrust_sigma
        shares = (_narrower(env, percent / 100) for percent in range(100, -1, -1))
        enough = (drawn for drawn in shares if sure * known.thrust_to_weight * drawn.weakest >= 1)
        env = next(enough, _narrower(env, 0.0))
        off = min(env.disturbance.centre_of_mass, _held(known, env.randomize["rate_gain"]))
        env = dataclasses.replace(env, disturbance=dataclasses.replace(env.disturbance, centre_of_mass=off))
    return dataclasses.replace(config, env=env)


def _held(vehicle: Vehicle, spread: float) -> float:
    """The largest offset of the centre of mass that the rate loop can hold, m, along the worse of the two axes.

    An offset c turns the body by the torque T c, where T is the thrust. A rate loop without an integral part then turns
    faster than commanded by T c / (J K), where J is the inertia and K the gain. At full thrust, and with the smallest
    gain that is drawn, this must not exceed the largest rate that the policy can command against it.
    """
    most = (1 - spread) * vehicle.inertia * vehicle.rate_gain * vehicle.body_rate_max / (4 * vehicle.thrust_range[1])
    return float(most[:2].min())


def _narrower(env: EnvConfig, share: float) -> EnvConfig:
    d = env.disturbance
    return dataclasses.replace(
        env,
        randomize={**env.randomize, "mass": share * env.randomize["mass"]},
        disturbance=dataclasses.replace(
            d, **{name: share * getattr(d, name) for name in ("thrust", "rotor", "sag", "ceiling")}
        ),
    )


def begun(config: TrainConfig) -> TrainConfig:
    """A configuration with the files of its teacher and its initial policy, and with the latter's observations and
    commands.

    It has the same number of past actions as that policy, unless the configuration gives another number. The actions of
    a policy of many vehicles keep their meaning as commands. Those of another policy are shares of the vehicle's own
    command range.

    Raises:
        ValueError: for a policy that does not exist, or cannot be read.
    """
    teacher = getattr(config.algo, "teacher", EXPERT)
    if teacher != EXPERT:
        file = policy_file(teacher or config.task.name, config.env.vehicle)
        algo: Any = dataclasses.replace(config.algo, teacher=str(file.absolute()))
        config = dataclasses.replace(config, algo=algo)
    if config.start_from is None:
        return config
    file = policy_file(config.start_from, config.env.vehicle)
    contract, env = load_policy(file).contract, config.env
    if env.past_actions is None:
        env = dataclasses.replace(env, past_actions=contract.past_actions)
    if contract.vehicle_ranges is not None and env.command_range is None and contract.action.mode == env.command_mode:
        env = dataclasses.replace(env, command_range=contract.action.command_range)
    return dataclasses.replace(config, env=env, start_from=str(file.absolute()))


def gentle(config: TrainConfig) -> TrainConfig:
    """A configuration for a run that starts from a policy's weights.

    Its learning rate is that with which other runs end. It imitates nobody, and takes the other part of the steps.
    """
    if not hasattr(config.algo, "learning_rate_end"):
        return config
    algo: Any = config.algo
    share = getattr(algo, "imitated", None) or 0.0
    changes = {"learning_rate": algo.learning_rate_end} | ({"imitated": None} if share else {})
    return dataclasses.replace(
        config, algo=dataclasses.replace(algo, **changes), steps=round(config.steps * (1 - share))
    )


def check(config: TrainConfig) -> None:
    """Check the numbers of a run.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    check_fields("", config)
    config.algo.check()
    if not config.network.hidden:
        raise ValueError("network.hidden is (); accepted: one or more sizes")
    for name, value in (*config.reward.weights.items(), *config.reward.parameters.items()):
        if not abs(value) <= LARGEST:  # true for NaN
            raise ValueError(f"reward {name} is {value}; accepted: a number, -{LARGEST:g} to {LARGEST:g}")
    if not config.reward.weights:
        raise ValueError("reward.weights is empty; accepted: at least one term (see `e2efly list rewards`)")
