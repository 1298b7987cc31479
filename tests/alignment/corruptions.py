"""What goes wrong with the frames, units and clocks of logs: each makes a wrong log of a right one."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from e2efly.alignment.comparison import attitudes
from e2efly.control import Quat, Vec3
from e2efly.logs.recording import Record, Stream
from e2efly.vehicles.vehicle import Vehicle

POSES = ("position", "velocity", "quaternion")


@dataclass(frozen=True)
class Corruption:
    """One thing that goes wrong."""

    name: str
    streams: tuple[str, ...]
    """The streams that it changes. A log without any of them cannot have it."""
    of: Callable[[Record, Vehicle], Record]
    told: str
    """What the user has to be told: a regular expression."""


def _values(name: str, of: Callable[[np.ndarray], np.ndarray]) -> Callable[[Record, Vehicle], Record]:
    return lambda record, _: with_values(record, {name: of})


def with_values(record: Record, changes: dict[str, Callable[[np.ndarray], np.ndarray]]) -> Record:
    """The record with the values of some of its streams changed."""
    streams = {
        k: Stream(record.streams[k].time, of(record.streams[k].values))
        for k, of in changes.items()
        if k in record.streams
    }
    return replace(record, streams={**record.streams, **streams})


def _frd(x: np.ndarray) -> np.ndarray:
    return x * [1, -1, -1]


def _ned(x: np.ndarray) -> np.ndarray:
    return x[:, [1, 0, 2]] * [1, 1, -1]


def _ned_attitude(body: bool) -> Callable[[np.ndarray], np.ndarray]:
    half = np.sqrt(0.5)

    def of(q: np.ndarray) -> np.ndarray:
        turned = Quat(0.0, half, half, 0.0).compose(Quat(*q.T))
        turned = turned.compose(Quat(0.0, 1.0, 0.0, 0.0)) if body else turned
        return np.stack([turned.w, turned.x, turned.y, turned.z], -1)

    return of


def _poses_ned(body: bool, imu: bool = False) -> Callable[[Record, Vehicle], Record]:
    changes = {"position": _ned, "velocity": _ned, "quaternion": _ned_attitude(body)}
    return lambda record, _: with_values(record, changes | ({"body_rate": _frd, "specific_force": _frd} if imu else {}))


def _in_the_body(record: Record, _: Vehicle) -> Record:
    stream = record.streams["velocity"]
    seen = Quat(*attitudes(record.streams["quaternion"], stream.time).T).unrotate(Vec3(*stream.values.T))
    return with_values(record, {"velocity": lambda x: np.stack([seen.x, seen.y, seen.z], -1)})


def _frozen(begin: float, end: float) -> Callable[[Record, Vehicle], Record]:
    """Between two shares of the flight."""

    def of(record: Record, _: Vehicle) -> Record:
        first, length = record.span[0], record.duration

        def held(stream: Stream) -> Stream:
            inside = (stream.time > first + begin * length) & (stream.time < first + end * length)
            at = max(int(np.argmax(inside)) - 1, 0)
            return Stream(stream.time, np.where(inside[:, None], stream.values[at], stream.values))

        return replace(record, streams={k: held(s) if k in POSES else s for k, s in record.streams.items()})

    return of


def _fast(record: Record, _: Vehicle) -> Record:
    first = record.span[0]
    poses = {k: Stream(first + 1.01 * (s.time - first), s.values) for k, s in record.streams.items() if k in POSES}
    return replace(record, streams={**record.streams, **poses})


def _thrust(unit: Callable[[Vehicle], float]) -> Callable[[Record, Vehicle], Record]:
    return lambda record, vehicle: with_values(record, {"command": lambda x: x * [unit(vehicle), 1, 1, 1]})


def _copied(name: str) -> Corruption:
    return Corruption(
        f"one column in all of {name}",
        (name,),
        _values(name, lambda x: x[:, [0, 0, 0, 0]]),
        f"{name} is the same as .1",
    )


CORRUPTIONS = (
    Corruption(
        "quaternion xyzw",
        ("quaternion",),
        _values("quaternion", lambda q: q[:, [1, 2, 3, 0]]),
        "qw=qz qx=qw qy=qx qz=qy",
    ),
    Corruption(
        "quaternion world to body",
        ("quaternion",),
        _values("quaternion", lambda q: q * [1, -1, -1, -1]),
        r"qx=qx\*-1 qy=qy\*-1 qz=qz\*-1",
    ),
    Corruption("poses of NED and FRD", ("quaternion",), _poses_ned(True), "world NED and a body FRD.* corrected"),
    Corruption(
        "poses and IMU of NED and FRD",
        ("quaternion", "body_rate"),
        _poses_ned(True, imu=True),
        "world is NED and the body FRD.* corrected",
    ),
    Corruption("poses of NED", ("quaternion",), _poses_ned(False), "world NED.* corrected"),
    Corruption(
        "positions and velocities of NED",
        ("position",),
        lambda r, _: with_values(r, {"position": _ned, "velocity": _ned}),
        r"px=py py=px pz=pz\*-1",
    ),
    Corruption(
        "velocity in the body's axes",
        ("velocity", "quaternion"),
        _in_the_body,
        "velocities are in the body's axes.* corrected",
    ),
    Corruption("position in cm", ("position",), _values("position", lambda x: x * 100), r"px=px\*0.01"),
    Corruption("velocity in cm/s", ("velocity",), _values("velocity", lambda x: x * 100), r"vx=vx\*0.01"),
    Corruption(
        "position, x and y swapped", ("position",), _values("position", lambda x: x[:, [1, 0, 2]]), "px=py py=px"
    ),
    Corruption("position, z negated", ("position",), _values("position", lambda x: x * [1, 1, -1]), r"pz=pz\*-1"),
    Corruption(
        "velocity, y and z swapped", ("velocity",), _values("velocity", lambda x: x[:, [0, 2, 1]]), "vy=vz vz=vy"
    ),
    Corruption("velocity, y negated", ("velocity",), _values("velocity", lambda x: x * [1, -1, 1]), r"vy=vy\*-1"),
    Corruption("thrust in N", ("command",), _thrust(lambda v: float(v.mass)), "it looks like N"),
    Corruption(
        "thrust in 0 to 1",
        ("command",),
        _thrust(lambda v: float(v.mass / (4 * v.rotor_thrust_max))),
        "0 to 1 of the largest thrust",
    ),
    Corruption(
        "rotor speeds in rpm", ("rotor_speed",), _values("rotor_speed", lambda x: x * 30 / np.pi), r"n1=n1\*0.10472"
    ),
    Corruption(
        "rotor speeds in eRPM/100",
        ("rotor_speed",),
        _values("rotor_speed", lambda x: x * 30 / np.pi * 7 / 100),
        "eRPM/100, by 7 pairs of poles",
    ),
    _copied("rotor_speed"),
    _copied("motor"),
    Corruption("poses frozen for a tenth", ("position",), _frozen(0.4, 0.5), "repeat a sample for .* left out of them"),
    Corruption(
        "poses frozen from a tenth on",
        ("position",),
        _frozen(0.1, 1.1),
        "repeat a sample for .*--without position velocity quaternion",
    ),
    Corruption(
        "clock of the poses 1 % fast", ("quaternion", "body_rate"), _fast, r"clock is [01]\.?\d* % fast .* corrected"
    ),
    Corruption("gyroscope in deg/s", ("body_rate",), _values("body_rate", np.degrees), r"wx=wx\*0.0174533"),
    Corruption(
        "gyroscope, x and y swapped", ("body_rate",), _values("body_rate", lambda x: x[:, [1, 0, 2]]), "wx=wy wy=wx"
    ),
    Corruption("gyroscope, x negated", ("body_rate",), _values("body_rate", lambda x: x * [-1, 1, 1]), r"wx=wx\*-1"),
    Corruption("gyroscope of FRD", ("body_rate",), _values("body_rate", _frd), r"wy=wy\*-1 wz=wz\*-1"),
    Corruption("accelerometer of FRD", ("specific_force",), _values("specific_force", _frd), r"ay=ay\*-1 az=az\*-1"),
    Corruption(
        "IMU of FRD",
        ("body_rate", "specific_force"),
        lambda r, _: with_values(r, dict.fromkeys(("body_rate", "specific_force"), _frd)),
        r"wy=wy\*-1 wz=wz\*-1 ay=ay\*-1 az=az\*-1",
    ),
)
"""All of them."""
