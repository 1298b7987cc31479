"""Every option of a run, as frozen dataclasses. They are the configuration, the command line and its help at once.

Imports no JAX, so that `--help` is instant. Numbers are leaves of the compiled programs, so changing one does not
recompile, unless the field says that it sets shapes.
"""

from e2efly.config.algorithms import (
    ALGORITHMS,
    ABPTConfig,
    AlgorithmConfig,
    BPTTConfig,
    DAggerConfig,
    FOPPOConfig,
    PPOConfig,
    SHACConfig,
)
from e2efly.config.env import (
    AHEAD,
    D435I,
    CameraConfig,
    DisturbanceConfig,
    EnvConfig,
    EstimateConfig,
    ImageNoiseConfig,
    ImuConfig,
    LinkConfig,
    NoiseConfig,
    PayloadConfig,
)
from e2efly.config.numbers import check_fields, number, shape
from e2efly.config.random_worlds import CLUTTER, ClutterConfig, ForestConfig
from e2efly.config.run import NetworkConfig, Paper, RewardConfig, Robust, Sourced, StageConfig, TaskConfig, TrainConfig

__all__ = [
    "AHEAD",
    "ALGORITHMS",
    "CLUTTER",
    "D435I",
    "ABPTConfig",
    "AlgorithmConfig",
    "BPTTConfig",
    "CameraConfig",
    "ClutterConfig",
    "DAggerConfig",
    "DisturbanceConfig",
    "EnvConfig",
    "EstimateConfig",
    "FOPPOConfig",
    "ForestConfig",
    "ImageNoiseConfig",
    "ImuConfig",
    "LinkConfig",
    "NetworkConfig",
    "NoiseConfig",
    "PPOConfig",
    "Paper",
    "PayloadConfig",
    "RewardConfig",
    "Robust",
    "SHACConfig",
    "Sourced",
    "StageConfig",
    "TaskConfig",
    "TrainConfig",
    "check_fields",
    "number",
    "shape",
]
