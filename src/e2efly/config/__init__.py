"""Every option of a run, as frozen dataclasses: at once the configuration, the command line and its help.

Imports no JAX, so that `--help` is instant. Numbers are leaves of the compiled programs (changing one does not
recompile) unless the field says that it sets a shape.
"""

from e2efly.config.algorithms import (
    ALGORITHMS,
    ABPTConfig,
    AlgorithmConfig,
    BPTTConfig,
    FOPPOConfig,
    PPOConfig,
    SHACConfig,
)
from e2efly.config.numbers import check_numbers, number, shape
from e2efly.config.train import (
    NetworkConfig,
    Paper,
    RewardConfig,
    StageConfig,
    TaskConfig,
    TrainConfig,
)
from e2efly.config.vehicle import (
    D435I,
    CameraConfig,
    EnvConfig,
    ImageNoiseConfig,
    ImuConfig,
    NoiseConfig,
)
from e2efly.config.worlds import CLUTTER, ClutterConfig, ForestConfig

__all__ = [
    "ALGORITHMS",
    "CLUTTER",
    "D435I",
    "ABPTConfig",
    "AlgorithmConfig",
    "BPTTConfig",
    "CameraConfig",
    "ClutterConfig",
    "EnvConfig",
    "FOPPOConfig",
    "ForestConfig",
    "ImageNoiseConfig",
    "ImuConfig",
    "NetworkConfig",
    "NoiseConfig",
    "PPOConfig",
    "Paper",
    "RewardConfig",
    "SHACConfig",
    "StageConfig",
    "TaskConfig",
    "TrainConfig",
    "check_numbers",
    "number",
    "shape",
]
