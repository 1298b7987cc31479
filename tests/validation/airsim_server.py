"""A server that speaks AirSim's RPC, over MuJoCo's body: for tests and benchmarks where no AirSim runs.

What it takes from AirSim's sources: methods with their parameter counts and rpclib's words for a wrong one; a thread
for a move, answers in any order; NED and FRD; a clock of physics steps that `simContinueForTime` lets go on by the wall
clock, so that one step more or less is taken; a move that blocks until its duration has passed on that clock or another
call cuts it short, and whose command stays; SimpleFlight's rate loop as gains times error over the vehicle's authority;
pictures (`airsim_eyes.py`) of where the vehicle was in the last frame of the game, of which there are none in a pause.
"""

import argparse
import contextlib
import dataclasses
import json
import math
import socketserver
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import msgpack
import numpy as np

from e2efly.validation.airsim.protocol import DIALECTS, METHODS
from e2efly.validation.plant import RigidState
from e2efly.validation.plants.mujoco import MujocoPlant
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix
from tests.validation.airsim_eyes import AirSimError, Eyes, quaternion_of

PERIOD = 0.003
"""Physics step, s."""
FRAME = 5
"""Physics steps in a frame of the game."""
STOCK_GAIN = 0.25
"""Of SimpleFlight's rate loop, throttle per rad/s."""
FLIP = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""NED from ENU, and back."""
TURN = np.diag([1.0, -1.0, -1.0])
"""FRD from FLU, and back."""


class World:
    """The simulator behind the server."""

    def __init__(self, vehicle: Vehicle, version: int, settings: dict[str, Any], seed: int = 0) -> None:
        self.vehicle, self.version, self.settings = vehicle, version, settings
        self.paused, self.control, self.armed = False, False, False
        self.steps, self.start = 0, time.time_ns()
        self.goal = np.zeros(4)  # rates FLU, throttle
        self.lock, self.moving, self.cut = threading.Lock(), threading.Lock(), threading.Event()
        self._random = np.random.default_rng(seed)
        self._authority = authority(vehicle)
        self.plant = MujocoPlant(vehicle)
        self.set_gains(np.full(3, STOCK_GAIN))
        self.eyes = Eyes(settings, version)
        self.drawn, self.placed = self.plant.state, 0  # where the game draws the vehicle; steps when it was placed

    def set_gains(self, gains: np.ndarray) -> None:
        """Gains of the rate loop; the body goes on as it is."""
        gain = np.maximum(gains * self._authority, 1e-3)
        body = MujocoPlant(_with(self.vehicle, gain))
        with self.lock:
            body.data.qpos[:], body.data.qvel[:], body.data.act[:] = (
                self.plant.data.qpos, self.plant.data.qvel, self.plant.data.act
            )  # fmt: skip
            self.plant = body

    def now(self) -> int:
        """The clock, ns."""
        return self.start + round(self.steps * PERIOD * 1e9)

    def step(self) -> None:
        """One physics step."""
        with self.lock:
            thrust = self.goal[3] * 4 * self.vehicle.thrust_range[1] / self.vehicle.mass
            self.plant.step(np.array([thrust, *self.goal[:3]]), PERIOD)
            self.steps += 1

    def go_on(self, seconds: float) -> None:
        """As the executor does: as many steps as the wall clock has room for from where its loop happens to stand."""
        phase = float(self._random.uniform(0, 1))
        count = math.floor(seconds / PERIOD + phase)
        for _ in range(count):
            self.step()
            if self.steps % FRAME == 0:
                self.drawn = self.plant.state
        if count < FRAME:  # AirSim waits for the end of a frame that a short stretch has begun in
            self.drawn = self.plant.state

    def kinematics(self) -> dict[str, Any]:
        """The truth, NED and FRD."""
        with self.lock:
            s = self.plant.state
        turned = quaternion_of(FLIP @ _matrix(s.quaternion) @ TURN)
        none = _vector(np.zeros(3))
        return {
            "position": _vector(FLIP @ s.position),
            "orientation": dict(zip(("w_val", "x_val", "y_val", "z_val"), turned, strict=True)),
            "linear_velocity": _vector(FLIP @ s.velocity), "angular_velocity": _vector(TURN @ s.body_rate),
            "linear_acceleration": none, "angular_acceleration": none,
        }  # fmt: skip

    def place(self, k: dict[str, Any]) -> None:
        """Pose and velocities; the rotors turn as they did."""
        q = np.array([k["orientation"][name] for name in ("w_val", "x_val", "y_val", "z_val")])
        position, velocity, rate = (_array(k[name]) for name in ("position", "linear_velocity", "angular_velocity"))
        quaternion = quaternion_of(FLIP @ _matrix(q / np.linalg.norm(q)) @ TURN)
        with self.lock:
            speed = self.plant.data.act.copy()
            self.plant.reset(RigidState(FLIP @ position, FLIP @ velocity, np.array(quaternion), TURN @ rate))
            self.plant.data.act[:] = speed
            self.placed = self.steps

    def pictures(self, requests: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """The answers to `ImageRequest`s."""
        position, matrix = FLIP @ self.drawn.position, FLIP @ _matrix(self.drawn.quaternion) @ TURN
        time = (self.steps - self.placed) * PERIOD
        return [self.eyes.answer(request, position, matrix, time, self.now()) for request in requests]

    def camera(self, name: str) -> dict[str, Any]:
        """A `CameraInfo`."""
        return self.eyes.info(name, FLIP @ self.drawn.position, FLIP @ _matrix(self.drawn.quaternion) @ TURN)

    def call(self, method: str, p: list[Any]) -> Any:
        """Do what a method does; runs in a thread of its own."""
        if method == "moveByAngleRatesThrottle":
            return self._move(TURN @ np.array(p[:3], float), float(p[3]), float(p[4]))
        actions: dict[str, Callable[[], Any]] = {
            "ping": lambda: True,
            "getServerVersion": lambda: self.version,
            "getSettingsString": lambda: json.dumps(self.settings),
            "simPause": lambda: self._set(paused=p[0]),
            "simIsPaused": lambda: self.paused,
            "simContinueForTime": lambda: self.go_on(float(p[0])),
            "enableApiControl": lambda: self._set(control=p[0]),
            "isApiControlEnabled": lambda: self.control,
            "armDisarm": lambda: self._set(armed=p[0]) or self.control,
            "simGetGroundTruthKinematics": self.kinematics,
            "simSetKinematics": lambda: self.place(p[0]),
            "getMultirotorState": lambda: {"timestamp": self.now(), "kinematics_estimated": self.kinematics()},
            "setAngleRateControllerGains": lambda: self.set_gains(np.array(p[0], float)),
            "cancelLastTask": self.cut.set,
            "reset": self._reset,
            "simGetImages": lambda: self.pictures(p[0]),
            "simGetCameraInfo": lambda: self.camera(p[0]),
        }
        return actions[method]()

    def _set(self, **values: bool) -> None:
        for name, value in values.items():
            setattr(self, name, value)

    def _reset(self) -> None:
        stands = np.array([0.0, 0.0, self.vehicle.feet_height])
        with self.lock:
            self.plant.reset(RigidState(stands, np.zeros(3), np.eye(4)[0], np.zeros(3)))
            self.plant.data.act[:] = self.vehicle.rotor_speed_min
        self.control, self.goal = False, np.zeros(4)

    def _move(self, rates: np.ndarray, throttle: float, duration: float) -> bool:
        if not self.moving.acquire(blocking=False):
            self.cut.set()
            self.moving.acquire()
        try:
            self.cut.clear()
            if duration <= 0:
                return True
            until = self.now() + round(duration * 1e9)
            if self.control:
                self.goal = np.array([*rates, throttle])
            while self.now() < until:
                if self.cut.wait(0.0005):
                    return False
            return True
        finally:
            self.moving.release()


class Server(socketserver.ThreadingTCPServer):
    """The RPC server; `port` tells where it listens."""

    allow_reuse_address, daemon_threads = True, True

    def __init__(self, world: World, port: int = 0) -> None:
        super().__init__(("127.0.0.1", port), _Connection)
        self.world, self.port = world, int(self.server_address[1])
        self.calls: list[tuple[str, list[Any]]] = []

    def __enter__(self) -> "Server":
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()
        self.server_close()


class _Connection(socketserver.BaseRequestHandler):
    @property
    def _served(self) -> Server:
        assert isinstance(self.server, Server)
        return self.server

    def handle(self) -> None:
        unpacker, writing = msgpack.Unpacker(), threading.Lock()
        with contextlib.suppress(ConnectionError):
            while data := self.request.recv(1 << 16):
                unpacker.feed(data)
                for message in unpacker:
                    if message[2] == "moveByAngleRatesThrottle":
                        threading.Thread(target=self._answer, args=(message, writing), daemon=True).start()
                    else:
                        self._answer(message, writing)

    def _answer(self, message: list[Any], writing: threading.Lock) -> None:
        _, number, method, parameters = message
        self._served.calls.append((method, parameters))
        error, result = None, None
        dialect = DIALECTS[self._served.world.version]
        images = {"simGetImages": dialect.image_parameters, "simGetCameraInfo": dialect.camera_parameters}
        methods = {**METHODS, **images}
        if method not in methods:
            count = len(parameters)
            error = f"rpclib: server could not find function '{method}' with argument count {count}."
        elif len(parameters) != (wanted := len(methods[method])):
            error = (
                f"rpclib: Function '{method}' was called with an invalid number of arguments. "
                f"Expected: {wanted}, got: {len(parameters)}"
            )
        else:
            try:
                result = self._served.world.call(method, parameters)
            except AirSimError as thrown:
                error = (
                    f"rpclib: function '{method}' (called with {wanted} arg(s)) threw an exception. "
                    f"The exception contained this information: {thrown}."
                )
        with writing, contextlib.suppress(OSError):
            self.request.sendall(msgpack.packb([1, number, error, result], use_single_float=True))


def authority(vehicle: Vehicle) -> np.ndarray:
    """Angular acceleration about x, y, z for one unit of the mixer's input: every rotor by all of its thrust."""
    torque = np.abs(allocation_matrix(vehicle)[1:]).sum(1) * vehicle.thrust_range[1]
    return torque / np.asarray(vehicle.inertia)


def settings(**changes: Any) -> dict[str, Any]:
    """What stands in settings.json."""
    return {"SettingsVersion": 1.2, "SimMode": "Multirotor", "ClockType": "SteppableClock", **changes}


def _with(vehicle: Vehicle, rate_gain: np.ndarray) -> Vehicle:
    return dataclasses.replace(vehicle, rate_gain=rate_gain)


def _vector(v: np.ndarray) -> dict[str, float]:
    return dict(zip(("x_val", "y_val", "z_val"), map(float, v), strict=True))


def _array(v: dict[str, float]) -> np.ndarray:
    return np.array([v["x_val"], v["y_val"], v["z_val"]])


def _matrix(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def main() -> None:
    """Serve until interrupted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicle", default="vis_r")
    parser.add_argument("--port", type=int, default=41451)
    parser.add_argument("--version", type=int, default=1)
    args = parser.parse_args()
    with Server(World(load_vehicle(args.vehicle), args.version, settings()), args.port) as server:
        print(f"serving airsim:127.0.0.1:{server.port}", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait()
    sys.exit(0)


if __name__ == "__main__":
    main()
