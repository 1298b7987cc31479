"""AirSim as a plant: its vehicle, its flight controller SimpleFlight and its physics, in lockstep over its RPC."""

from collections.abc import Mapping
from typing import ClassVar, Self, cast

import numpy as np

from e2efly.flight.pilot.hover import controlled, rates_of
from e2efly.policy.contract import Contract
from e2efly.validation.airsim.airsim_camera import AirSimCamera, camera_of, opened, taken
from e2efly.validation.airsim.lockstep import AirSimSession
from e2efly.validation.airsim.rpc import PORT, Rpc
from e2efly.validation.airsim.vehicle_model import LONG_S, SPUN_S, differences, hold, measure
from e2efly.validation.plant import MOMENT, Plant, RigidState, Shutter, check_mode
from e2efly.validation.plants.registry import register
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle
from e2efly.vehicles.vehicle_rules import check_quadrotor

FLOOR_M = 0.02
"""Distance of AirSim's floor below the floor of our world, m. AirSim's collisions end a descent slightly above the
place where the vehicle had come to rest, and such a touch must count."""
OUTER_S = 0.01
"""Longest time between two commands of a mode above body rates, s. The controller of the mode runs at this interval."""


@register("airsim")
class AirsimPlant(Plant):
    """One vehicle of a running AirSim. A measured line maps thrust over mass to throttle; body rates stay as they are.

    The proportional gains of SimpleFlight's rate loop are set so that its bandwidth is the vehicle's `rate_gain`.
    """

    needs = {"msgpack": "e2efly[airsim]"}
    parallel, episodes, takes_address = False, 20, True
    host: ClassVar[str] = "127.0.0.1"
    port: ClassVar[int] = PORT
    named: ClassVar[str] = ""
    cameras: ClassVar[Mapping[str, str]] = {}
    """By an image of the contract, the AirSim camera that provides it."""

    @classmethod
    def at(cls, address: str) -> type[Self]:
        """AirSim at HOST, HOST:PORT or HOST:PORT:VEHICLE.

        VEHICLE is the name of a vehicle in its settings. An empty host is this machine.

        Raises:
            ValueError: naming the address and what is accepted.
        """
        host, *more = address.split(":")
        accepted = "accepted: airsim:HOST, airsim:HOST:PORT or airsim:HOST:PORT:VEHICLE, a port of 1 to 65535"
        port = more[0] if more else str(PORT)
        if len(more) > 2 or not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535):
            raise ValueError(f"--plant is airsim:{address}; {accepted}")
        return cls._with(host=host or cls.host, port=int(port), named=more[1] if len(more) > 1 else "")

    @classmethod
    def seeing(cls, cameras: Mapping[str, str]) -> type[Self]:
        """The plant that provides a policy's images by `simGetImages`."""
        return cls._with(cameras=dict(cameras))

    @classmethod
    def _with(cls, **values: object) -> type[Self]:
        made = type(cls.__name__, (cls,), {**values, "__module__": cls.__module__, "__doc__": cls.__doc__})
        return cast("type[Self]", made)

    @classmethod
    def of(cls, vehicle: Vehicle, contract: Contract) -> Self:
        """Make the plant, and check one image of each of its cameras.

        Raises:
            ValueError, OSError: as for the plant; or for a camera that is not the contract's.
        """
        images = {image.name: image for image in contract.images}
        asked = [camera_of(where, images[name]) for name, where in cls.cameras.items()]
        plant = cls(vehicle, contract.action.mode)
        try:
            plant._cameras = [opened(plant._session, camera) for camera in asked]
        except BaseException:
            plant.close()
            raise
        return plant

    @classmethod
    def differences(cls, vehicle: Vehicle, contract: Contract) -> list[str]:
        """Measured differences between AirSim's vehicle and the vehicle to which its flight controller is to be tuned.

        Raises:
            ValueError, OSError: as for `of`.
        """
        plant = cls.of(vehicle, contract)
        try:
            told = (
                [] if plant.grounded else ["AirSim's vehicle has no ground to stand on: it falls with its rotors off."]
            )
            told += [camera.describe() for camera in plant._cameras]
            return told + differences(plant.model, vehicle)
        finally:
            plant.close()

    def __init__(self, vehicle: Vehicle, mode: str) -> None:
        """Connect, reset AirSim, find the place where the vehicle stands, and measure the vehicle.

        Raises:
            ValueError: for a command mode that does not lead to body rates and thrust, or for answers that make no
                sense.
            OSError: naming the address, when AirSim does not answer or refuses.
        """
        check_mode(mode, self.name, rates=True)
        check_quadrotor(vehicle, "plant 'airsim'")
        self.vehicle, self.mode = vehicle, mode
        self._cameras: list[AirSimCamera] = []
        self._shutters: Mapping[str, Shutter] = {}
        self._films: dict[str, list[np.ndarray]] = {}
        self._time = 0.0  # time since the last reset, s
        rpc = Rpc(self.host, self.port)
        try:
            self._session = AirSimSession(rpc, self.named)
        except BaseException:
            rpc.close()
            raise
        try:
            begin = self._session.state()
            rest = self._session.settle()
            self.grounded = rest is not None
            stands = begin if rest is None else rest
            self._origin = stands.position - np.array([0.0, 0.0, vehicle.feet_height - FLOOR_M])
            self._session.take_over()
            self.model = measure(self._session)
            self._session.set_gains(self.model.gains(vehicle.rate_gain))
        except BaseException:
            self.close()
            raise
        self.reset(RigidState(np.array([0.0, 0.0, vehicle.feet_height]), np.zeros(3), np.eye(4)[0], np.zeros(3)))

    @property
    def state(self) -> RigidState:
        """The vehicle now. Its first place is over the world's origin, and AirSim's floor lies `FLOOR_M` below ours."""
        return self._state

    def reset(self, state: RigidState) -> None:
        """Bring the rotors to hover speed in level flight one metre higher, and put the vehicle into the state."""
        above = RigidState(state.position + np.array([0.0, 0.0, 1.0]), np.zeros(3), np.eye(4)[0], np.zeros(3))
        self._session.place(self._there(above))
        hold(self._session, np.zeros(3), self.model.throttle(GRAVITY), SPUN_S)
        self._session.begin(self._there(state))
        self._look()
        self._time, self._films = 0.0, {name: [] for name in self._shutters}
        if self._shutters:
            self._develop()
            self._session.begin(self._there(state))  # the pictures may have taken a few physics steps
            self._look()

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command for `dt` s, to within half of AirSim's physics step. Later steps compensate the difference."""
        end = self._time + dt
        while self._time < end - MOMENT:
            until = min([end, *(due for due in self._due() if due > self._time + MOMENT)])
            self._hold(command, until - self._time)
            self._time = until
            self._develop()

    def expose(self, shutters: Mapping[str, Shutter]) -> None:
        """Take pictures in flight, at the times of AirSim's clock that the shutters give."""
        self._shutters = dict(shutters)

    def shown(self, name: str, now: float) -> np.ndarray:
        """The newest image of a camera that a policy has at `now`, s since `reset`."""
        return self._films[name][self._shutters[name].newest(now)]

    def _hold(self, command: np.ndarray, dt: float) -> None:
        longest = LONG_S if self.mode == "ctbr" else OUTER_S
        count = max(int(np.ceil(dt / longest - 1e-9)), 1)
        limit = np.asarray(self.vehicle.body_rate_max, float)
        for _ in range(count):
            wanted = controlled(self.vehicle, self.mode, self.state.odometry(0.0), command)
            rates = np.clip(rates_of(wanted), -limit, limit)
            self._session.command(rates, self.model.throttle(float(wanted.thrust)))
            self._session.advance(dt / count)
            self._look()

    def _due(self) -> list[float]:
        """Next exposure time of each camera, s since the last reset."""
        return [shutter.exposed(len(self._films[name])) for name, shutter in self._shutters.items()]

    def _develop(self) -> None:
        for camera in self._cameras:
            shutter, film = self._shutters.get(camera.image.name), self._films.get(camera.image.name, [])
            image = None
            while shutter is not None and shutter.exposed(len(film)) <= self._time + MOMENT:
                image = taken(self._session, camera) if image is None else image
                film.append(image)

    def close(self) -> None:
        """Give AirSim control of its vehicle again, and let it run on."""
        self._session.close()

    def _there(self, state: RigidState) -> RigidState:
        """Convert a state of our world to AirSim's world."""
        return RigidState(state.position + self._origin, state.velocity, state.quaternion, state.body_rate)

    def _look(self) -> None:
        s = self._session.state()
        self._state = RigidState(s.position - self._origin, s.velocity, s.quaternion, s.body_rate)
