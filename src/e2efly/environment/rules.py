"""Checks of the numbers of an environment's configuration."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from e2efly.config import EnvConfig, TaskConfig, check_fields
from e2efly.config.numbers import LATEST
from e2efly.policy.observation import Field
from e2efly.simulation.physics.integrate import SWINGING
from e2efly.simulation.scenes.camera import check as check_camera
from e2efly.simulation.sensors.image_noise import check as check_noise
from e2efly.vehicles.family import Family
from e2efly.vehicles.posterior import WIDEST, Posterior
from e2efly.vehicles.vehicle import Vehicle
from e2efly.vehicles.vehicle_rules import reached_share
from e2efly.vehicles.widths import check_widths


def check(
    config: EnvConfig, vehicle: Vehicle, family: Family | None, body: Vehicle, posterior: Posterior | None
) -> None:
    """Check the numbers of a configuration.

    Args:
        config: the configuration of the environment.
        vehicle: its vehicle, or the middle one of its family.
        family: its family, if it names one.
        body: the vehicle whose parameters are randomised.
        posterior: the distribution from which an identified vehicle is drawn.
    """
    check_fields("env", config)
    config.payload.check("env.payload")
    if config.payload.mass[1] and config.integrator not in SWINGING:
        raise ValueError(
            f"env.integrator is {config.integrator!r}; accepted: {', '.join(SWINGING)}, as env.payload has a load"
        )
    check_widths(body, config.randomize, "env.randomize")
    if family is not None and family.ranges.rotors is not None:
        check_frames(config, family.name)
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
    margin = vehicle.thrust_to_weight if family is None else family.ranges.thrust_to_weight[0]
    d, drawn = config.disturbance, margin * config.weakest
    if posterior is not None:
        drawn *= 1 - WIDEST * posterior.thrust_sigma
    if body.battery_voltage is not None:
        empty = (1 - config.randomize.get("battery_voltage", 0.0)) * body.battery_voltage
        body = dataclasses.replace(body, battery_voltage=empty)
    if body.rotor_speed_ceiling is not None:
        lowest = (1 - config.randomize.get("rotor_speed_ceiling", 0.0)) * body.rotor_speed_ceiling
        body = dataclasses.replace(body, rotor_speed_ceiling=lowest)
    if body.battery_voltage is not None or body.rotor_speed_ceiling is not None:
        drawn *= reached_share(body)
    if drawn < 1:
        load = f", and env.payload has mass {config.payload.mass[1]:g}" if config.payload.mass[1] else ""
        raise ValueError(
            f"env.randomize is {dict(config.randomize)} and env.disturbance has thrust {d.thrust:g}, "
            f"rotor {d.rotor:g}, sag {d.sag:g}, ceiling {d.ceiling:g}, push {d.push:g}{load}: the weakest vehicle of "
            f"these cannot hover (thrust to weight {drawn:.2f}; {config.vehicle} has {margin:.2f}); accepted: draws "
            "that leave at least 1"
        )


def hidden(options: TaskConfig, task: Any, own: Sequence[Field]) -> tuple[str, ...]:
    """The names of the vehicle's own fields that a task's option `observes` leaves out.

    Args:
        options: the options of the task.
        task: the task that they make.
        own: the vehicle's own fields.

    Raises:
        ValueError: for a name that is no field, and where the attitude is left out.
    """
    if options.observes is None:
        return ()
    rows = getattr(task, "observable", None)
    offered = task.fields if rows is None else [field for field, _ in rows]
    known = {field.name: field for field in (*offered, *own)}
    if strange := [name for name in options.observes if name not in known]:
        raise ValueError(f"task.observes has {', '.join(strange)}; accepted: some of {', '.join(known)}")
    needed = next(field.name for field in known.values() if field.frame == "world_body")
    if needed not in options.observes:
        raise ValueError(
            f"task.observes is {', '.join(options.observes) or 'empty'}; accepted: with {needed}, of which a policy "
            "gets where up is"
        )
    return tuple(field.name for field in own if field.name not in options.observes)


def check_frames(config: EnvConfig, name: str) -> None:
    """Refuse what is drawn for each rotor, with a family whose vehicles differ in their number of rotors.

    Raises:
        ValueError: naming the option, its value and what is accepted.
    """
    if config.lost_rotor:
        raise ValueError(f"env.lost_rotor is {config.lost_rotor}; accepted for vehicle {name!r}: 0")
    for f in dataclasses.fields(Vehicle):
        if "per_rotor" in f.metadata and config.randomize.get(f.name):
            raise ValueError(f"env.randomize.{f.name} is {config.randomize[f.name]}; accepted for vehicle {name!r}: 0")
