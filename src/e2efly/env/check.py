"""Whether the numbers of an environment's configuration make sense."""

import math

from e2efly.config import EnvConfig, TaskConfig
from e2efly.scenes.camera import check as check_camera
from e2efly.sensors.image_noise import check as check_noise
from e2efly.vehicles import load_vehicle, unknown
from e2efly.vehicles.vehicle import quantities


def check(config: EnvConfig, task: TaskConfig) -> None:
    """Check the numbers of a configuration.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    names = [f.name for f in quantities()]
    for name, width in config.randomize.items():
        if name not in names:
            raise ValueError(unknown("vehicle parameter", name, names))
        if not 0 <= width < 1:
            raise ValueError(f"env.randomize.{name} is {width}; accepted: at least 0 and below 1")
    for field, bounds in (
        ("action_latency", config.action_latency),
        ("observation_latency", config.observation_latency),
        *((f"cameras.{i}.latency", camera.latency) for i, camera in enumerate(config.cameras)),
    ):
        if bounds is not None and not (0 <= bounds[0] <= bounds[1] <= 1):
            raise ValueError(f"env.{field} is {bounds}; accepted: two rising numbers of seconds in [0, 1]")
    if config.past_actions is not None and config.past_actions < 0:
        raise ValueError(f"env.past_actions is {config.past_actions}; accepted: 0 or more")
    if not (math.isfinite(config.wind) and config.wind >= 0):
        raise ValueError(f"env.wind is {config.wind}; accepted: 0 or more, m/s")
    rate = load_vehicle(config.vehicle).control_rate if config.control_rate is None else config.control_rate
    for camera in config.cameras:
        check_camera(camera)
        check_noise(camera.noise, camera)
        every = 1.0 if camera.rate is None or camera.rate <= 0 else rate / camera.rate
        if (camera.rate is not None and camera.rate <= 0) or abs(every - round(every)) > 1e-6 or every < 1:
            raise ValueError(f"camera.rate is {camera.rate}; accepted: the control rate, {rate:g} Hz, or a whole part")
    if not (math.isfinite(task.episode_s) and task.episode_s > 0):
        raise ValueError(f"task.episode_s is {task.episode_s}; accepted: a positive number of seconds")
