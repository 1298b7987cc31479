"""What the rates are also measured with: vehicles that each have parameters of their own, and wide networks."""

import dataclasses

import numpy as np

from e2efly.config import NetworkConfig, TrainConfig
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import quantities

DRAWN = (
    "mass", "inertia", "rotor_position", "thrust_map", "torque_ratio", "motor_time_constant", "drag_linear",
    "drag_quadratic",
)  # fmt: skip
"""The parameters that are drawn anew in every episode, within 10 %, so that every vehicle is different."""


def own_parameters(vehicles: int) -> dict[str, np.ndarray]:
    """Every parameter of VIS-R, (vehicles, ...), within 10 % of the file."""
    nominal, rng, found = load_vehicle("vis_r"), np.random.default_rng(0), {}
    for name in (field.name for field in quantities()):
        value = np.asarray(getattr(nominal, name))
        found[name] = (value * rng.uniform(0.9, 1.1, (vehicles, *value.shape))).astype(np.float32)
    return found


def own(config: TrainConfig) -> TrainConfig:
    """A training in which every vehicle has parameters of its own."""
    return dataclasses.replace(config, env=dataclasses.replace(config.env, randomize=dict.fromkeys(DRAWN, 0.1)))


def wide(config: TrainConfig) -> TrainConfig:
    """A training of 100 environments with horizon 96 and networks with 192 and 96 units."""
    algo = dataclasses.replace(config.algo, envs=100, horizon=96)
    return dataclasses.replace(config, algo=algo, network=NetworkConfig((192, 96)))
