"""AirSim in lockstep: it runs only for the time that it is given, and each command is confirmed before that.

AirSim's clock (SteppableClock) advances one physics step at a time, but `simContinueForTime` counts seconds of the wall
clock (`ScheduledExecutor::executorLoop`). A requested time may therefore end a step early or late. The session reads
the simulator's clock after each run and requests the missing time. It carries a remainder of less than half a step over
into the next run.
"""

import contextlib
import json
import time
from typing import Any

import numpy as np

from e2efly.validation.airsim import frames, protocol
from e2efly.validation.airsim.airsim_images import Picture, field_of_view, image_request, picture
from e2efly.validation.airsim.rpc import Rpc, RpcError
from e2efly.validation.plant import RigidState

HELD_S = 1.0
"""Duration of a rate command that is sent, s. The command is cancelled once it is known to be set."""
_CUT_S = 0.002
"""Time to wait for a cancelled command before it is cancelled again, s."""
_SHY = 0.1
"""Share of a physics step that is subtracted from a requested time. AirSim also takes the step in which the time
ends."""
_LONGER = 1.5
"""Factor by which the next requested time is longer if no time passed. A busy computer is too late to take a step."""
_TRIES = 30
"""Number of requests without effect after which the clock counts as stopped."""
_STEP_ENDS_S = 0.02
"""Time after which a physics step in progress has ended, s."""
_SAMPLES = 6
"""Number of clock readings. Their smallest change is the physics step."""
_REST_S, _REST_SPEED = 3.0, 0.02
"""A vehicle is at rest if its speed falls below the second number, m/s, within the first number, s."""


class AirSimSession:
    """One vehicle of one AirSim that is controlled, armed and paused."""

    def __init__(self, rpc: Rpc, vehicle: str = "") -> None:
        """Take control of the vehicle with this name in the settings. Empty: the only vehicle.

        Raises:
            RpcError: naming what the server refuses, or saying that its clock cannot be stepped.
            ValueError: for a server of an unknown dialect.
        """
        self.rpc, self.vehicle = rpc, vehicle
        self._call("ping")
        version = self._call("getServerVersion")
        if version not in protocol.DIALECTS:
            known = ", ".join(f"{number} ({each.name})" for number, each in protocol.DIALECTS.items())
            raise ValueError(f"{rpc.where}: getServerVersion is {version!r}; accepted: {known}")
        self.dialect = protocol.DIALECTS[version]
        self.settings = _settings(self._call("getSettingsString"))
        self._wall = 1 / _clock_speed(self.settings)
        self.take_over()
        self.step = self._physics_step()
        self._due = self._now()

    def take_over(self) -> None:
        """Reset the simulation, take control, arm, and pause.

        Raises:
            RpcError: naming what the server refuses.
        """
        self._call("simPause", False)  # AirSim resets in a frame of the game, and a pause has none
        self._call("reset")
        self._call("enableApiControl", True, self.vehicle)
        if not self._call("isApiControlEnabled", self.vehicle):
            raise RpcError(f"{self.rpc.where}: gives no control; accepted: settings.json with AllowAPIAlways true")
        if not self._call("armDisarm", True, self.vehicle):
            raise RpcError(f"{self.rpc.where}: does not arm")
        self._call("simPause", True)
        if not self._call("simIsPaused"):
            raise RpcError(f"{self.rpc.where}: does not pause")
        time.sleep(_STEP_ENDS_S)
        self._due = self._now()  # time to which the vehicle must be brought, on the simulator's clock, ns

    def state(self) -> RigidState:
        """The vehicle now, ENU and FLU, relative to the place where AirSim has put it.

        Raises:
            ValueError: for an answer that is not a state.
        """
        try:
            return protocol.rigid_state(self._call("simGetGroundTruthKinematics", self.vehicle))
        except ValueError as error:
            raise ValueError(f"{self.rpc.where}: simGetGroundTruthKinematics: {error}") from None

    def place(self, state: RigidState) -> None:
        """Put the vehicle into a state. The rotor speeds do not change."""
        self._call("simSetKinematics", protocol.kinematics(state), True, self.vehicle)

    def set_gains(self, gains: np.ndarray) -> None:
        """Set proportional gains of the rate loop about x, y and z, throttle per rad/s.

        Integral and derivative gains are zero.
        """
        none = [0.0, 0.0, 0.0]
        self._call("setAngleRateControllerGains", [float(gain) for gain in gains], none, none, self.vehicle)

    def command(self, rates: np.ndarray, throttle: float) -> None:
        """Set body rates, FLU, rad/s, and throttle, 0 to 1, from now until the next command.

        The server's method sets them when it begins. Then it waits for its duration, which does not pass during a
        pause. The method is therefore cancelled by `cancelLastTask`, and its answer proves that it had begun. The
        values that it has set stay.
        """
        p, q, r = frames.body(rates).tolist()
        number = self.rpc.send("moveByAngleRatesThrottle", p, q, r, float(throttle), HELD_S, self.vehicle)
        until = time.monotonic() + 10.0
        while True:
            self._call("cancelLastTask", self.vehicle)
            if self.rpc.arrived(number, _CUT_S):
                self.rpc.result(number)
                return
            if time.monotonic() > until:
                raise RpcError(f"{self.rpc.where}: moveByAngleRatesThrottle does not end when it is cancelled")

    def advance(self, seconds: float) -> float:
        """Let `seconds` pass. Returns the time that has passed, s.

        All the time that was ever requested has passed to within half a physics step. One more step may have passed if
        the simulator's computer was too busy to take a step in time.

        Raises:
            RpcError: when the simulator's clock does not advance.
        """
        began, self._due = self._now(), self._due + round(seconds * 1e9)
        now = began
        while (steps := round((self._due - now) / (self.step * 1e9))) > 0:
            now = self._later(now, (steps - _SHY) * self.step)
        return (now - began) / 1e9

    def tick(self) -> None:
        """Let one physics step pass. Later runs compensate for it.

        Raises:
            RpcError: when the simulator's clock does not advance.
        """
        self._later(self._now(), (1 - _SHY) * self.step)

    def begin(self, state: RigidState) -> None:
        """Put the vehicle into a state, and count time from now."""
        self.place(state)
        self._due = self._now()

    def picture(self, camera: str, image_type: int) -> Picture:
        """The present picture of a camera of the vehicle, uncompressed: depth as numbers, all other types as colours.

        Raises:
            RpcError: when the server refuses, as for an unknown camera.
            ValueError: for an answer that is not such a picture.
        """
        request = image_request(self.dialect, camera, image_type)
        more = (False,) * (len(self.dialect.image_parameters) - 2)  # no camera apart from those of the vehicle
        try:
            answer = self._call("simGetImages", [request], self.vehicle, *more)
        except RpcError as error:
            accepted = "accepted: a camera of the vehicle, as its settings call it"
            raise RpcError(f"{error} (asked for camera {camera!r}; {accepted})") from None
        try:
            return picture(answer, request, self.dialect)
        except ValueError as error:
            raise ValueError(f"{self.rpc.where}: simGetImages of camera {camera!r}: {error}") from None

    def field_of_view(self, camera: str) -> float:
        """Field of view of the longer side of a camera's pictures, degrees.

        AirSim dereferences a null pointer if there is no such camera, so request a picture first.

        Raises:
            ValueError: for an answer that is not an angle.
        """
        more = (False,) * (len(self.dialect.camera_parameters) - 2)
        try:
            return field_of_view(self._call("simGetCameraInfo", camera, self.vehicle, *more))
        except ValueError as error:
            raise ValueError(f"{self.rpc.where}: simGetCameraInfo of camera {camera!r}: {error}") from None

    def settle(self) -> RigidState | None:
        """Let the vehicle come to rest with its rotors off. None: it falls, because there is no ground.

        The command is that of an armed vehicle without a command.
        """
        for _ in range(round(_REST_S / 0.3)):
            self.advance(0.3)
            state = self.state()
            if np.linalg.norm(state.velocity) < _REST_SPEED:
                return state
        return None

    def close(self) -> None:
        """Release control, and let the simulation run on."""
        with contextlib.suppress(OSError):
            self._call("enableApiControl", False, self.vehicle)
            self._call("simPause", False)
        self.rpc.close()

    def _call(self, method: str, *parameters: Any, timeout: float | None = None) -> Any:
        assert method not in protocol.METHODS or len(parameters) == len(protocol.METHODS[method])
        return self.rpc.call(method, *parameters, timeout=timeout)

    def _now(self) -> int:
        """The simulator's clock, ns."""
        state = self._call("getMultirotorState", self.vehicle)
        stamp = state.get("timestamp") if isinstance(state, dict) else None
        if isinstance(stamp, bool) or not isinstance(stamp, int):
            raise RpcError(f"{self.rpc.where}: getMultirotorState.timestamp is {stamp!r}; accepted: nanoseconds")
        return stamp

    def _go_on(self, seconds: float) -> None:
        """Let the simulator run for about `seconds` of its time."""
        wall = seconds * self._wall
        self._call("simContinueForTime", wall, timeout=wall + 10.0)
        until = time.monotonic() + wall + 10.0
        while not self._call("simIsPaused"):  # AirSim answers when the time is over; others may not
            if time.monotonic() > until:
                raise RpcError(f"{self.rpc.where}: does not pause again after simContinueForTime({wall:g})")

    def _physics_step(self) -> float:
        """Smallest change of the simulator's clock, s."""
        before = self._now()
        time.sleep(_STEP_ENDS_S)
        if self._now() != before:
            raise RpcError(
                f"{self.rpc.where}: the clock runs in a pause; accepted: ClockType SteppableClock in settings"
            )
        changes = []
        for _ in range(_SAMPLES):
            now = self._later(before, 0.0005)
            changes.append(now - before)
            before = now
        return min(changes) / 1e9

    def _later(self, now: int, seconds: float) -> int:
        """Let the simulator run for about `seconds` of its time, and longer if its clock does not change.

        Returns the clock, ns.
        """
        for _ in range(_TRIES):
            self._go_on(seconds)
            if (later := self._now()) != now:
                return later
            seconds *= _LONGER if seconds < 1.0 else 1.0
        raise RpcError(f"{self.rpc.where}: the simulator's clock does not go on when simContinueForTime tells it to")


def _settings(text: Any) -> dict[str, Any]:
    """The content of the settings text. Empty if it is not a JSON object."""
    with contextlib.suppress(ValueError, TypeError):
        read = json.loads(text)
        return read if isinstance(read, dict) else {}
    return {}


def _clock_speed(settings: dict[str, Any]) -> float:
    """Simulated seconds per second of the wall clock. 1 if the settings do not give it."""
    speed = settings.get("ClockSpeed")
    if isinstance(speed, int | float) and not isinstance(speed, bool) and 1e-3 <= speed <= 1e3:
        return float(speed)
    return 1.0
