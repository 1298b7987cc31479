"""A good configuration for every task and algorithm, and the paper's. Imports no JAX.

A preset is a function that returns a `TrainConfig`; a variant of one is `dataclasses.replace`.
"""

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any

from e2efly.config import (
    ABPTConfig,
    AlgorithmConfig,
    AvoidConfig,
    BPTTConfig,
    CameraConfig,
    EnvConfig,
    FOPPOConfig,
    GapConfig,
    HoverAwareConfig,
    HoverConfig,
    ImageNoiseConfig,
    LandConfig,
    LandVisualConfig,
    NetworkConfig,
    PPOConfig,
    RaceClutterConfig,
    RaceConfig,
    RewardConfig,
    SHACConfig,
    StageConfig,
    TaskConfig,
    TrackConfig,
    TrainConfig,
)
from e2efly.vehicles.names import unknown

TASKS: dict[str, TaskConfig] = {
    "hover": HoverConfig(),
    "land": LandConfig(),
    "track": TrackConfig(),
    "race": RaceConfig(laps=0),
    "hover_aware": HoverAwareConfig(),
    "gap": GapConfig(collisions_end=False),
    "land_visual": LandVisualConfig(),
    "avoid": AvoidConfig(collisions_end=False),
    "race_clutter": RaceClutterConfig(laps=0, collisions_end=False),
}
"""The task that each name trains on. Races go on for lap after lap; evaluation ends after one."""

ALGORITHMS: dict[str, AlgorithmConfig] = {
    "ppo": PPOConfig(), "bptt": BPTTConfig(), "shac": SHACConfig(), "abpt": ABPTConfig(),
    "foppo": FOPPOConfig(),
}  # fmt: skip
"""Algorithms by name, with the defaults of their presets."""

FIRST_ORDER = ("land_visual", "avoid", "race_clutter", "gap")
"""Tasks that BPTT learns better than PPO does (docs/training.md)."""

D435I = CameraConfig(fov=(math.radians(87), math.radians(58)), reach=(0.28, 10.0))
"""Depth of an Intel RealSense D435i."""
_NOISY = dataclasses.replace(D435I, noise=ImageNoiseConfig(d435i=True))
_EYES: dict[str, tuple[CameraConfig, ...]] = {
    "land_visual": (CameraConfig("mask", 16, 16, fov=(math.pi / 2, math.pi / 2), pitch=math.pi / 2),),
    "race_clutter": (dataclasses.replace(_NOISY, width=48, height=24, pitch=-0.35, noise_share=0.5),),
    "avoid": (dataclasses.replace(_NOISY, width=32, height=12),),
}
"""What the policies of the visual tasks see."""

_PAPER_WEIGHTS: dict[str, dict[str, float]] = {
    "hover": {"prog2": 0.01, "ori2": 0.0001, "v1": 0.002, "anglev": 0.002},
    "land": {"progxy": 0.04, "vz": 0.1, "anglev": 0.001},
    "track": {"prog2": 0.02, "ori2": 0.001, "v1": 0.002, "anglev": 0.002},
    "race": {"prog1": 0.9, "ori2": 0.001, "v1": 0.002, "anglev": 0.002},
    "land_visual": {"progxy": 0.04, "ori2": 0.003, "vz": 0.1, "anglev": 0.001},
    "race_clutter": {"prog1": 0.9, "act3": 1.0, "ori1": 0.04, "avoid1": 0.01},
    "avoid": {"prog1": 0.9, "ori1": 0.04, "v3": 0.002, "anglev": 0.002, "avoid2": 0.01},
}
_PAPER_PPO_EXTRA: dict[str, dict[str, float]] = {
    "hover": {"act3": 1.0, "goal": 1.0, "crash": 1.0},
    "land": {"act3": 1.0, "goal": 1.0, "crash": 1.0},
    "track": {"act3": 1.0, "crash": 1.0},
    "race": {"act3": 1.0, "goal": 5.0, "crash": 4.0},
    "land_visual": {"act3": 1.0, "goal": 1.0, "crash": 1.0},
    "race_clutter": {"goal": 5.0, "crash": 4.0},
    "avoid": {"goal": 5.0, "crash": 4.0},
}
_PAPER_STEPS: dict[str, tuple[int, int]] = {
    "hover": (50, 10), "land": (100, 10), "track": (50, 20), "race": (100, 50), "land_visual": (100, 1),
    "race_clutter": (100, 50), "avoid": (100, 50),
}  # fmt: skip
"""Millions of environment steps by PPO and by BPTT."""
CURRICULA: dict[str, tuple[StageConfig, ...]] = {
    "avoid": (
        StageConfig({"forest.density": 0.0, "speed": (2.0, 4.0)}, success=0.9, steps=1_000_000),
        StageConfig({"forest.density": 0.03, "speed": (2.0, 5.0)}, success=0.8, steps=2_000_000),
    ),
    "race_clutter": (
        StageConfig({"clutter.obstacles": 0.0}, success=0.8, steps=2_000_000),
        StageConfig({"clutter.obstacles": 5.0}, success=0.7, steps=2_000_000),
    ),
}
"""The paper's curricula: no obstacles, few, and then the task itself. Its table gives no numbers."""


def _hover(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {"near": 1.0, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02}
        return TrainConfig(HoverConfig(), PPOConfig(), RewardConfig(weights), steps=2_500_000)
    weights = {"prog2": 1.0, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
    return TrainConfig(HoverConfig(), BPTTConfig(), RewardConfig(weights), steps=1_000_000, chunk=10)


def _hover_aware(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {"near": 1.0, "ori1": 1.0, "ori3": 1.0, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02}
        return TrainConfig(HoverAwareConfig(), PPOConfig(), RewardConfig(weights), steps=3_000_000)
    weights = {"prog2": 1.0, "ori1": 1.0, "ori3": 1.0, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
    return TrainConfig(HoverAwareConfig(), BPTTConfig(), RewardConfig(weights), steps=1_000_000, chunk=10)


def _land(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {
            "prog1": 4.0, "descent": 0.2, "upright": 0.05, "anglev_sq": 0.002, "act2_sq": 0.02,
            "goal": 10.0, "crash": 10.0,
        }  # fmt: skip
        settings: AlgorithmConfig = PPOConfig(learning_rate=5e-3, learning_rate_end=5e-4)
        return TrainConfig(LandConfig(), settings, RewardConfig(weights), steps=2_000_000)
    weights = {"progxy": 1.0, "descent": 1.0, "upright": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
    return TrainConfig(LandConfig(), BPTTConfig(learning_rate=8e-3), RewardConfig(weights), steps=1_000_000, chunk=10)


def _land_visual(algo: str) -> TrainConfig:
    weights = {"progxy": 1.0, "descent": 1.0, "upright": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
    settings: AlgorithmConfig = BPTTConfig(envs=32, horizon=48, learning_rate_end=1.2e-4)
    steps = 650_000
    if algo == "ppo":
        weights = {
            "prog1": 4.0, "descent": 0.2, "upright": 0.05, "anglev_sq": 0.002, "act2_sq": 0.02, "goal": 10.0,
            "crash": 10.0,
        }  # fmt: skip
        settings, steps = PPOConfig(learning_rate=2e-3), 2_000_000
    network, seen = NetworkConfig((128, 64)), EnvConfig(cameras=_EYES["land_visual"])
    return TrainConfig(
        LandVisualConfig(), settings, RewardConfig(weights), seen, network, steps=steps, chunk=30, eval_episodes=100
    )


def _avoid(algo: str) -> TrainConfig:
    weights = {"vel": 4.0, "avoid": 30.0, "ori2": 0.1, "anglev_sq": 0.01, "act2_sq": 0.02}
    parameters = {"avoid_reach": 0.5}
    settings: AlgorithmConfig = BPTTConfig(horizon=48, learning_rate_end=3e-4, gradient_decay=1.5, average=0.99)
    task, network = TASKS["avoid"], NetworkConfig((128, 64), pool=(12, 32), recurrent=64)
    curriculum: tuple[StageConfig, ...] = ()
    if algo == "ppo":
        weights = {"vel": 0.3, "avoid": 0.1, "anglev_sq": 0.002, "act2_sq": 0.02, "goal": 5.0, "crash": 5.0}
        settings, task, parameters = PPOConfig(learning_rate=2e-3, gamma=0.98), AvoidConfig(), {}
        network, curriculum = dataclasses.replace(network, recurrent=0), CURRICULA["avoid"]
    return TrainConfig(
        task, settings, RewardConfig(weights, parameters), EnvConfig(cameras=_EYES["avoid"]), network,
        steps=4_000_000, chunk=100, eval_episodes=250, curriculum=curriculum, fast_compile=False,
    )  # fmt: skip


def _gap(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {
            "prog1": 1.0, "ori4": 0.1, "fit": 1.0, "overspeed": 0.02, "anglev_sq": 0.0005, "act2_sq": 0.005,
            "goal": 1.0, "crash": 1.0,
        }  # fmt: skip
        reward = RewardConfig(weights, {"desired_speed": 2.0, "fit_margin": 0.02, "fit_limit": 0.1})
        settings: AlgorithmConfig = PPOConfig(gamma=0.97, learning_rate=5e-3, learning_rate_end=5e-4)
        return TrainConfig(TASKS["gap"], settings, reward, steps=3_000_000)
    weights = {
        "prog1": 1.0, "near": 0.1, "ori4": 0.1, "fit": 1.0, "overspeed": 0.02, "anglev_sq": 0.0005, "act2_sq": 0.005,
    }  # fmt: skip
    reward = RewardConfig(weights, {"desired_speed": 2.0, "fit_margin": 0.02, "fit_limit": 0.1})
    settings = BPTTConfig(learning_rate=6e-3, max_grad_norm=1.0, gradient_decay=1.0)
    return TrainConfig(TASKS["gap"], settings, reward, steps=6_000_000, chunk=60)


def _race_clutter(algo: str) -> TrainConfig:
    weights = {
        "vel": 1.5, "near": 1.0, "avoid": 12.0, "fit": 20.0, "ori2": 0.3, "anglev_sq": 0.01, "act2_sq": 0.02,
    }  # fmt: skip
    parameters = {"fit_margin": 0.25, "fit_limit": 2.0}
    settings: AlgorithmConfig = BPTTConfig(horizon=48, gradient_decay=1.5, average=0.99)
    task, curriculum, network = TASKS["race_clutter"], (), NetworkConfig((128, 64), pool=(12, 48), recurrent=64)
    steps = 12_000_000
    if algo == "ppo":
        weights = {
            "prog1": 1.0, "overspeed": 0.01, "avoid": 0.05, "ori2": 0.1, "anglev_sq": 0.0005, "act2_sq": 0.005,
            "goal": 1.0, "crash": 2.0,
        }  # fmt: skip
        settings, parameters, steps = PPOConfig(gamma=0.97), {}, 8_000_000
        task, curriculum = RaceClutterConfig(laps=0), CURRICULA["race_clutter"]
        network = dataclasses.replace(network, recurrent=0)
    return TrainConfig(
        task, settings, RewardConfig(weights, parameters), EnvConfig(cameras=_EYES["race_clutter"]), network,
        steps=steps, chunk=200, eval_episodes=500, curriculum=curriculum, fast_compile=False,
    )  # fmt: skip


def _track(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {"near": 1.0, "anglev_sq": 0.002, "act2_sq": 0.02}
        settings: AlgorithmConfig = PPOConfig(horizon=48, gamma=0.95, learning_rate=5e-3)
        return TrainConfig(TrackConfig(), settings, RewardConfig(weights), steps=2_000_000)
    weights = {"prog2": 1.0, "anglev_sq": 0.01, "act2_sq": 0.02}
    settings = BPTTConfig(horizon=32, learning_rate=8e-3)
    return TrainConfig(TrackConfig(), settings, RewardConfig(weights), steps=1_000_000)


def _race(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {"prog1": 1.0, "anglev_sq": 0.0005, "act2_sq": 0.005, "goal": 1.0, "crash": 1.0}
        settings: AlgorithmConfig = PPOConfig(gamma=0.97, learning_rate=5e-3, learning_rate_end=5e-4)
        return TrainConfig(RaceConfig(laps=0), settings, RewardConfig(weights), steps=3_000_000)
    weights = {"prog1": 1.0, "near": 0.2, "anglev_sq": 0.0005, "act2_sq": 0.005}
    settings = BPTTConfig(learning_rate=8e-3, max_grad_norm=1.0, gradient_decay=1.0)
    return TrainConfig(RaceConfig(laps=0), settings, RewardConfig(weights), steps=2_500_000, chunk=15)


_OURS: dict[str, Callable[[str], TrainConfig]] = {
    "hover": _hover,
    "hover_aware": _hover_aware,
    "land": _land,
    "land_visual": _land_visual,
    "avoid": _avoid,
    "gap": _gap,
    "race_clutter": _race_clutter,
    "track": _track,
    "race": _race,
}


_SMOOTH: dict[str, dict[str, float]] = {
    "hover": {"near": 1.0, "prog2": 0.2, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02, "crash": 10.0},
    "land": {
        "prog1": 4.0, "progxy": 0.1, "descent": 0.2, "upright": 0.05, "anglev_sq": 0.002, "act2_sq": 0.02,
        "goal": 10.0, "crash": 10.0,
    },
    "track": {"near": 1.0, "prog2": 0.2, "anglev_sq": 0.002, "act2_sq": 0.02, "crash": 10.0},
    "race": {"prog1": 1.0, "anglev_sq": 0.0005, "act2_sq": 0.005, "goal": 1.0, "crash": 1.0},
}  # fmt: skip
"""Rewards of the methods that have both a gradient and a critic; where there is none, PPO's. To a critic nothing
follows a crash: where every step costs, as in BPTT's rewards, an early crash would be the best end; these pay for
living on, and charge for a crash."""


def _ours(task: str, algo: str) -> TrainConfig:
    return _OURS[task](algo) if algo in ("ppo", "bptt") else _with_critic(task, algo)


def _with_critic(task: str, algo: str) -> TrainConfig:
    """BPTT's preset with critics: rewards that suit them, and a shorter window, but for races."""
    config = _ours(task, "bptt")
    shared = ("max_grad_norm", "gradient_decay") if algo == "foppo" else (
        "max_grad_norm", "gradient_decay", "learning_rate", "learning_rate_end", "envs"
    )  # fmt: skip
    taken: dict[str, Any] = {name: getattr(config.algo, name) for name in shared}
    if task == "race" and algo != "abpt":
        taken["horizon"] = 64
    if task == "race" and algo == "shac":
        taken |= {"learning_rate": 4e-3, "noise": 0.1}
    reward = RewardConfig(_SMOOTH[task], config.reward.parameters) if task in _SMOOTH else _ours(task, "ppo").reward
    return dataclasses.replace(config, algo=dataclasses.replace(ALGORITHMS[algo], **taken), reward=reward)


def _paper(task: str, algo: str) -> TrainConfig:
    """The paper's rewards, sizes and learning rates (its tables; see docs/rewards.md for what it leaves open)."""
    weights = dict(_PAPER_WEIGHTS[task])
    if algo == "ppo":
        weights |= _PAPER_PPO_EXTRA[task]
        settings: AlgorithmConfig = PPOConfig(
            envs=100, horizon=256, minibatch=25_600, epochs=10, learning_rate=1e-4, learning_rate_end=1e-5,
            gamma=0.99,
        )  # fmt: skip
    elif algo == "abpt":
        settings = ABPTConfig(
            envs=100, horizon=96, collect=10, buffer=100_000, places=1000, minibatch=25_600, learning_rate=1e-3,
            learning_rate_end=1e-5, critic_rate=1.0, gamma=0.99, target_share=0.005,
        )  # fmt: skip
    else:
        settings = BPTTConfig(envs=100, horizon=96, learning_rate=1e-3, learning_rate_end=1e-5)
    steps = _PAPER_STEPS[task][algo != "ppo"] * 1_000_000
    seen = tuple(dataclasses.replace(camera, width=64, height=64) for camera in _EYES.get(task, ()))
    return TrainConfig(
        TASKS[task], settings, RewardConfig(weights), EnvConfig(cameras=seen), steps=steps, chunk=10,
        curriculum=CURRICULA.get(task, ()),
    )  # fmt: skip


def _thrown(task: str, algo: str) -> TrainConfig:
    """Hover from any attitude, tumbling and fast, as a vehicle that was thrown.

    Training has short episodes: what is to be learned is in their first seconds. The target is 5 m up: from 3 m some
    starts hit the ground whatever is done (docs/tasks.md).
    """
    if task != "hover":
        raise ValueError(f"preset 'thrown': accepted for task hover, not {task!r}")
    config = _ours(task, algo)
    thrown = HoverConfig(
        episode_s=3.0, judged_s=10.0, target=(0.0, 0.0, 5.0), velocity=3.0, tilt=math.pi, body_rate=6.0, fence=10.0
    )
    if isinstance(config.algo, BPTTConfig):
        config = dataclasses.replace(config, algo=dataclasses.replace(config.algo, envs=32, learning_rate=8e-3))
    return dataclasses.replace(config, task=thrown)


PRESETS: dict[str, Callable[[str, str], TrainConfig]] = {
    "ours": _ours,
    "paper": _paper,
    "thrown": _thrown,
}
"""Presets by name: functions of the task's and the algorithm's name."""


def preset(task: str, algo: str, name: str = "ours") -> TrainConfig:
    """The configuration of a task and an algorithm.

    Raises:
        ValueError: for an unknown name, with the nearest one and all there are; for the paper's preset of a task that
            the paper gives no numbers for.
    """
    for kind, value, known in (("task", task, TASKS), ("algorithm", algo, ALGORITHMS), ("preset", name, PRESETS)):
        if value not in known:
            raise ValueError(unknown(kind, value, known))
    if name == "paper" and algo in ("shac", "foppo"):
        raise ValueError(f"preset 'paper': the paper does not train by {algo!r}; accepted: ppo, bptt, abpt")
    if name == "paper" and task not in _PAPER_WEIGHTS:
        raise ValueError(
            f"preset 'paper': the paper has no reward for task {task!r}; accepted: {', '.join(_PAPER_WEIGHTS)}"
        )
    return PRESETS[name](task, algo)


def default_algorithm(task: str) -> str:
    """The algorithm that a task is best learned by; for a name that is none, ppo."""
    return "bptt" if task in FIRST_ORDER else "ppo"


def task_name(config: TaskConfig) -> str:
    """The name of a task's configuration."""
    return next(name for name, known in TASKS.items() if type(known) is type(config))


def algorithm_name(config: AlgorithmConfig) -> str:
    """The name of an algorithm's configuration."""
    return next(name for name, known in ALGORITHMS.items() if type(known) is type(config))


def suites(config: TaskConfig) -> dict[str, TaskConfig]:
    """What a task is evaluated on, by name: its criteria. A policy counts by its worst.

    Tracking trained on random references is judged on a circle and on a lemniscate, which it never saw; a race is
    judged on one lap.
    """
    if isinstance(config, TrackConfig) and config.reference == "polynomial":
        return {
            "circle": dataclasses.replace(config, reference="circle", mean_error=0.08),
            "lemniscate": dataclasses.replace(config, reference="lemniscate", mean_error=0.15),
        }
    if isinstance(config, RaceConfig):
        return {"race": dataclasses.replace(config, laps=max(config.laps, 1))}
    if isinstance(config, RaceClutterConfig):
        return {"race_clutter": dataclasses.replace(config, laps=max(config.laps, 1), collisions_end=True)}
    if isinstance(config, AvoidConfig):
        return {
            f"avoid_{speed:g}": dataclasses.replace(config, speed=(speed, speed), collisions_end=True)
            for speed in (5.0, 8.0)
        }
    if isinstance(config, HoverConfig):
        return {task_name(config): dataclasses.replace(config, episode_s=config.judged_s or config.episode_s)}
    if isinstance(config, GapConfig):
        return {"gap": dataclasses.replace(config, collisions_end=True)}
    return {task_name(config): config}


_ANY, _SHARE = (0.0, math.inf), (0.0, 1.0)
_BOUNDS: dict[str, tuple[float, float]] = {
    "gradient_decay": _ANY, "gae_lambda": _SHARE, "td_lambda": _SHARE, "clip": _ANY, "value_weight": _ANY,
    "entropy_weight": _ANY, "log_std": (-10.0, 2.0), "critic_rate": _ANY, "exact_rate": _ANY, "target_share": _SHARE,
    "noise": _ANY, "fresh_share": _SHARE, "at_once": _SHARE, "average": (0.0, 0.9999),
}  # fmt: skip
"""Of options of algorithms, smallest and largest."""


def check(config: TrainConfig) -> None:
    """Check the numbers of a run.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    for name, value in _whole_numbers("", config):
        if abs(value) >= (10**300 if name == "steps" else 2**53):  # of steps, the time is told
            raise ValueError(f"{name} is {value}; accepted: whole numbers below 2^53")
    algo = config.algo
    positive = {
        "steps": config.steps, "chunk": config.chunk, "eval_episodes": config.eval_episodes,
        "algo.envs": algo.envs, "algo.horizon": algo.horizon, "algo.learning_rate": algo.learning_rate,
        "algo.learning_rate_end": algo.learning_rate_end, "algo.max_grad_norm": algo.max_grad_norm,
    }  # fmt: skip
    if isinstance(algo, PPOConfig | SHACConfig | FOPPOConfig):
        positive |= {"algo.epochs": algo.epochs, "algo.minibatch": algo.minibatch}
    if isinstance(algo, ABPTConfig):
        positive |= {"algo.collect": algo.collect, "algo.fits": algo.fits, "algo.minibatch": algo.minibatch}
        for name, value, of in (
            ("buffer", algo.buffer, algo.envs * algo.collect), ("places", algo.places, algo.envs)
        ):  # fmt: skip
            if value < 1 or of < 1 or value % of:
                raise ValueError(f"algo.{name} is {value}; accepted: a positive multiple of {of}, what an update adds")
    for name, value in positive.items():
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} is {value}; accepted: more than 0")
    for name, (low, high) in {**_BOUNDS, "horizon_start": (0, algo.horizon)}.items():
        value = getattr(algo, name, None)
        if value is not None and not (math.isfinite(value) and low <= value <= high):
            accepted = f"{low:g} to {high:g}" if math.isfinite(high) else f"{low:g} or more"
            raise ValueError(f"algo.{name} is {value}; accepted: {accepted}")
    if not 0 < algo.gamma <= 1:
        raise ValueError(f"algo.gamma is {algo.gamma}; accepted: above 0, at most 1")
    if isinstance(algo, PPOConfig | SHACConfig | FOPPOConfig) and algo.steps % algo.minibatch:
        raise ValueError(
            f"algo.minibatch is {algo.minibatch}; accepted: a divisor of algo.envs * algo.horizon ({algo.steps})"
        )
    if not config.network.hidden or min(config.network.hidden) <= 0:
        raise ValueError(f"network.hidden is {config.network.hidden}; accepted: one or more positive sizes")
    if isinstance(config.task, HoverConfig) and not (math.isfinite(config.task.judged_s) and config.task.judged_s >= 0):
        raise ValueError(f"task.judged_s is {config.task.judged_s}; accepted: 0 or more")
    if not 0 <= config.seed < 2**32:
        raise ValueError(f"seed is {config.seed}; accepted: 0 to 2^32 - 1")
    if config.stop_at is not None and not 0 < config.stop_at <= 1:
        raise ValueError(f"stop_at is {config.stop_at}; accepted: above 0, at most 1")
    for name, value in (*config.reward.weights.items(), *config.reward.parameters.items()):
        if not math.isfinite(value):
            raise ValueError(f"reward {name} is {value}; accepted: a finite number")
    if not config.reward.weights:
        raise ValueError("reward.weights is empty; accepted: at least one term (see `e2efly list`)")


def _whole_numbers(name: str, value: Any) -> Iterator[tuple[str, int]]:
    """Every whole number of a configuration, with its name."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from _whole_numbers(f"{name}.{field.name}" if name else field.name, getattr(value, field.name))
    elif isinstance(value, tuple):
        for i, entry in enumerate(value):
            yield from _whole_numbers(f"{name}[{i}]", entry)
    elif isinstance(value, int):
        yield name, value
