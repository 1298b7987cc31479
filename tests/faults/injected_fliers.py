"""What goes wrong with those who fly in mode POLICY: images, commands, and the vehicle that a filter believes in."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from e2efly.flight.sight.image_source import Frame
from e2efly.vehicles.vehicle import Vehicle
from tests.faults.injection import Flier, Injection, Kind, Parameters, one_of, uniform, vector
from tests.faults.stage import FENCE, TARGET, Stage

AWAY = 2.5
"""A commanded position is at most so far from the target, m."""
MARGIN = 0.2
"""And so far inside the fence, m."""
SPEED, ACCELERATION, TILT, RATE = 5.0, 8.0, 1.0, 4.0
"""Largest jumps of commands, m/s, m/s^2, rad, rad/s."""


def _images(change: Callable[..., Callable[[np.ndarray], np.ndarray]]) -> Callable[..., Injection]:
    """Of a function that changes an image."""

    def begin(stage: Stage, **parameters: Any) -> Injection:
        del stage
        changed = change(**parameters)
        return Injection(frame=lambda frame: dataclasses.replace(frame, image=changed(frame.image)))

    return begin


def mirrored(axis: str) -> Callable[[np.ndarray], np.ndarray]:
    """Left and right, or up and down, change places."""
    return lambda image: np.ascontiguousarray(np.flip(image, {"rows": 0, "columns": 1}[axis]))


def transposed() -> Callable[[np.ndarray], np.ndarray]:
    """Rows and columns change places, in an image that keeps its shape."""
    return lambda image: _resampled(np.swapaxes(image, 0, 1), image.shape[0], image.shape[1], 1.0)


def negative() -> Callable[[np.ndarray], np.ndarray]:
    """Near and far, or black and white, change places."""
    return lambda image: image.max() + image.min() - image


def miscalibrated(zoom: float, shift: float, scale: float) -> Callable[[np.ndarray], np.ndarray]:
    """Another focal length, another pitch as a share of the rows, and another unit of the values."""

    def changed(image: np.ndarray) -> np.ndarray:
        moved = np.roll(image, round(shift * image.shape[0]), 0)
        return _resampled(moved, *image.shape[:2], zoom) * np.asarray(scale, image.dtype)

    return changed


def _resampled(image: np.ndarray, height: int, width: int, zoom: float) -> np.ndarray:
    """The nearest pixels of an image about its middle."""

    def places(count: int, of: int) -> np.ndarray:
        at = ((np.arange(count) + 0.5) / count - 0.5) / zoom + 0.5
        return np.clip((at * of).astype(int), 0, of - 1)

    return image[np.ix_(places(height, image.shape[0]), places(width, image.shape[1]))]


def _frozen(stage: Stage, noise: float) -> Injection:
    """The same image, with or without noise of its own, as a share of its largest value."""
    kept: list[np.ndarray] = []

    def same(frame: Frame) -> Frame:
        kept.append(frame.image)
        del kept[1:]
        top = float(kept[0].max())
        shaken = kept[0] + noise * top * stage.random.normal(size=kept[0].shape)
        return dataclasses.replace(frame, image=np.clip(shaken, 0.0, top).astype(kept[0].dtype))

    return Injection(frame=same)


def _late(stage: Stage, delay: float, stamped: bool) -> Injection:
    for camera in stage.cameras:
        camera.delay, camera.stamped = delay, stamped

    def end() -> None:
        for camera in stage.cameras:
            camera.delay = 0.0

    return Injection(end=end)


def _clock(stage: Stage, step: float) -> Injection:
    del stage
    return Injection(frame=lambda frame: dataclasses.replace(frame, time=frame.time + step))


def _jumping(stage: Stage, mode: str, way: list[float], share: float, period: float) -> Injection:
    """Commands jump to and fro in a direction."""
    began, before, reach = stage.rig.now(), stage.command, share * np.array(way)

    def jump() -> None:
        side = -1.0 if (stage.rig.now() - began) // period % 2 else 1.0
        stage.command = command(mode, side * reach, before["position"])

    return Injection(each=jump, end=lambda: setattr(stage, "command", before))


def command(mode: str, reach: np.ndarray, home: list[float]) -> dict[str, Any]:
    """A command of a mode, at a share of what it may reach in a direction, (3,) up to 1."""
    thrust = 9.81 * (1.0 + 0.9 * reach[2])
    if mode == "position":
        low, high = np.add(FENCE.low, MARGIN), np.subtract(FENCE.high, MARGIN)
        return {"mode": mode, mode: np.clip(np.add(home, AWAY * reach), low, high).tolist()}
    if mode == "attitude":
        return {"mode": mode, mode: [*(TILT * reach[:2]).tolist(), 0.0], "thrust": thrust}
    if mode == "ctbr":
        return {"mode": mode, "body_rate": (RATE * reach).tolist(), "thrust": thrust}
    return {"mode": mode, mode: ({"velocity": SPEED, "acceleration": ACCELERATION}[mode] * reach).tolist()}


def another(vehicle: Vehicle, mass: float, thrust: float, inertia: float, lag: float) -> Vehicle:
    """The vehicle that flies, if its file is wrong by these factors."""
    return dataclasses.replace(
        vehicle, mass=vehicle.mass * mass, thrust_map=vehicle.thrust_map * thrust,
        rotor_thrust_max=vehicle.rotor_thrust_max * thrust, inertia=vehicle.inertia * inertia,
        motor_time_constant=vehicle.motor_time_constant * lag,
    )  # fmt: skip


def _factors(random: np.random.Generator) -> Parameters:
    """Of a file that is wrong in everything."""
    spread = {"mass": 1.25, "thrust": 1.25, "inertia": 2.0, "lag": 2.5}
    return {name: round(float(most ** random.uniform(-1, 1)), 3) for name, most in spread.items()}


def _jump(random: np.random.Generator) -> Parameters:
    modes = ("position", "velocity", "acceleration", "attitude", "ctbr")
    return {
        "mode": modes[int(random.integers(len(modes)))], "way": vector(random, 1.0),
        "share": round(float(random.uniform(0.2, 1.0)), 2), "period": round(float(10 ** random.uniform(-1.5, 0.3)), 3),
    }  # fmt: skip


def _calibration(random: np.random.Generator) -> Parameters:
    zoom, scale = 1.5 ** random.uniform(-1, 1), (1.0, 1.0, 0.5, 0.8, 1.25, 2.0)[int(random.integers(6))]
    return {"zoom": round(float(zoom), 3), "shift": round(float(random.uniform(-0.25, 0.25)), 3), "scale": scale}


SIGHT = Flier.SIGHT
FLIERS = {
    "images: mirrored": Kind(_images(mirrored), one_of("axis", "rows", "columns"), flier=SIGHT),
    "images: rows and columns swapped": Kind(_images(transposed), flier=SIGHT),
    "images: negative": Kind(_images(negative), flier=SIGHT),
    "images: miscalibrated": Kind(_images(miscalibrated), _calibration, flier=SIGHT),
    "images: frozen": Kind(_frozen, one_of("noise", 0.0, 0.002, 0.02), flier=SIGHT),
    "images: late": Kind(_late, lambda random: {
        "delay": round(float(random.uniform(0.05, 0.5)), 3), "stamped": bool(random.random() < 0.5)},
        flier=SIGHT, limited=(0.5, 10.0)),
    "images: none": Kind(lambda stage: Injection(frame=lambda frame: None), flier=SIGHT, limited=(0.1, 5.0)),
    "images: their clock is set": Kind(_clock, uniform(step=(-0.5, 0.5)), flier=SIGHT),
    "commands: jump": Kind(_jumping, _jump, flier=Flier.COMMANDS),
    "filter: another vehicle": Kind(
        lambda stage, **factors: Injection(), _factors, flier=Flier.FILTER, body=another),
}  # fmt: skip
"""Kinds of faults of who flies, by name."""
BEYOND = dataclasses.replace(FENCE, high=(TARGET[0] - 0.3, *FENCE.high[1:]))
"""The fence of a flight behind the filter: the policy's target is beyond it."""
