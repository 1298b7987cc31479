"""Checks of the numbers of an environment's configuration."""

import dataclasses

import numpy as np

from e2efly.config import EnvConfig, TaskConfig, check_fields
from e2efly.config.names import unknown
from e2efly.config.numbers import LATEST
from e2efly.simulation.scenes.camera import check as check_camera
from e2efly.simulation.sensors.image_noise import check as check_noise
from e2efly.vehicles.family import load_family, nominal_vehicle
from e2efly.vehicles.posterior import IDENTIFIED, WIDEST, Posterior
from e2efly.vehicles.vehicle import Vehicle, principal_moments, quantities, terms
from e2efly.vehicles.vehicle_rules import battery_share

COUNTED = 2**24
"""Largest number of control steps in an episode: float32 does not count further."""


def check(
    config: EnvConfig, task: TaskConfig, flown: Vehicle | None = None, posterior: Posterior | None = None
) -> None:
    """Check the numbers of a configuration.

    Args:
        config: the configuration of the environment.
        task: the options of the task.
        flown: the vehicle whose parameters are randomised. None: the configuration's vehicle.
        posterior: the distribution from which an identified vehicle is drawn.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    check_fields("env", config)
    check_fields("task", task)
    body = nominal_vehicle(config.vehicle) if flown is None else flown
    names = [f.name for f in quantities(body)]
    for name, width in config.randomize.items():
        if name == IDENTIFIED:
            continue
        if any(name == term.name for term in terms()) and name not in names:
            raise ValueError(
                f"env.randomize.{name} is {width}, and vehicle {body.name!r} has no {name}; accepted: a vehicle file "
                f"with an entry [{name}], or what vehicle {body.name!r} has: {', '.join(names)}"
            )
        if name not in names:
            raise ValueError(unknown("vehicle parameter", name, names))
        if not 0 <= width < 1:
            raise ValueError(f"env.randomize.{name} is {width}; accepted: at least 0 and below 1")
    if body.inertia_products is not None:
        less, more = (config.randomize.get(name, 0.0) for name in ("inertia", "inertia_products"))
        drawn = {"inertia": (1 - less) * body.inertia, "inertia_products": -(1 + more) * np.abs(body.inertia_products)}
        if principal_moments(dataclasses.replace(body, **drawn))[0] <= 0:
            raise ValueError(
                f"env.randomize is {dict(config.randomize)}: an inertia of these draws may have no positive principal "
                f"moment (inertia {body.inertia.tolist()}, inertia_products {body.inertia_products.tolist()}); "
                "accepted: smaller widths of inertia and inertia_products"
            )
    vehicle, family = nominal_vehicle(config.vehicle), load_family(config.vehicle)
    latest = vehicle.latency if family is None else family.ranges.latency[1]
    if config.action_latency is None and latest + config.latency_spread[1] > LATEST:
        raise ValueError(
            f"latency of vehicle {vehicle.name} is {latest} s, env.latency_spread {config.latency_spread}; "
            f"accepted: at most {LATEST:g} s together"
        )
    rate = vehicle.control_rate if config.control_rate is None else config.control_rate
    for camera in config.cameras:
        check_camera(camera)
        check_noise(camera.noise, camera)
        every = 1.0 if camera.rate is None else rate / camera.rate
        if abs(every - round(every)) > 1e-6 or every < 1:
            raise ValueError(f"camera.rate is {camera.rate}; accepted: the control rate, {rate:g} Hz, or a whole part")
    longest, hold = max(task.episode_s, getattr(task, "judged_s", 0.0)), getattr(task, "hold_s", 0.0)
    if longest * rate > COUNTED:
        field = "episode_s" if task.episode_s == longest else "judged_s"
        raise ValueError(
            f"task.{field} is {longest}; accepted: at most {COUNTED / rate:g} s, as far as float32 counts the control "
            f"steps, 2^24 at {rate:g} Hz"
        )
    if not 0 <= hold <= longest:
        raise ValueError(
            f"task.hold_s is {hold}; accepted: 0 to the {longest:g} s of task.episode_s, or of task.judged_s if longer"
        )
    margin = vehicle.thrust_to_weight if family is None else family.ranges.thrust_to_weight[0]
    d, drawn = config.disturbance, margin * config.weakest
    if posterior is not None:
        drawn *= 1 - WIDEST * posterior.thrust_sigma
    if body.battery_voltage is not None:
        empty = (1 - config.randomize.get("battery_voltage", 0.0)) * body.battery_voltage
        drawn *= battery_share(dataclasses.replace(body, battery_voltage=empty))
    if drawn < 1:
        raise ValueError(
            f"env.randomize is {dict(config.randomize)} and env.disturbance has thrust {d.thrust:g}, "
            f"rotor {d.rotor:g}, sag {d.sag:g}: the weakest vehicle of these cannot hover (thrust to weight "
            f"{drawn:.2f}; {config.vehicle} has {margin:.2f}); accepted: draws that leave at least 1"
        )
    for name, part in vars(task).items():
        if hasattr(part, "check"):
            part.check(f"task.{name}")
    for name in ("target", "centre"):
        place = getattr(task, name, None)
        if place is not None and place[2] <= vehicle.feet_height:
            raise ValueError(
                f"task.{name} is {place}; accepted: a place more than {vehicle.feet_height:g} m over the ground, the "
                "height of the centre of mass over the feet"
            )
