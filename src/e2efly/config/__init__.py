"""Every option of a run, as frozen dataclasses: at once the configuration, the command line and its help.

Imports no JAX, so that `--help` is instant. Numbers are leaves of the compiled programs (changing one does not
recompile) unless the field says that it sets a shape.
"""

from e2efly.config.algorithms import (
    ABPTConfig,
    AlgorithmConfig,
    BPTTConfig,
    FOPPOConfig,
    PPOConfig,
    SHACConfig,
)
from e2efly.config.tasks import (
    AvoidConfig,
    ClutterConfig,
    ForestConfig,
    GapConfig,
    HoverAwareConfig,
    HoverConfig,
    LandConfig,
    LandVisualConfig,
    RaceClutterConfig,
    RaceConfig,
    TaskConfig,
    TrackConfig,
)
from e2efly.config.train import (
    NetworkConfig,
    RewardConfig,
    StageConfig,
    TrainConfig,
)
from e2efly.config.vehicle import (
    CameraConfig,
    EnvConfig,
    ImageNoiseConfig,
    ImuConfig,
    NoiseConfig,
)

__all__ = [
    "ABPTConfig",
    "AlgorithmConfig",
    "AvoidConfig",
    "BPTTConfig",
    "CameraConfig",
    "ClutterConfig",
    "EnvConfig",
    "FOPPOConfig",
    "ForestConfig",
    "GapConfig",
    "HoverAwareConfig",
    "HoverConfig",
    "ImageNoiseConfig",
    "ImuConfig",
    "LandConfig",
    "LandVisualConfig",
    "NetworkConfig",
    "NoiseConfig",
    "PPOConfig",
    "RaceClutterConfig",
    "RaceConfig",
    "RewardConfig",
    "SHACConfig",
    "StageConfig",
    "TaskConfig",
    "TrackConfig",
    "TrainConfig",
]
