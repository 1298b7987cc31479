"""The real firmware with our rigid body as a plant: commands reach it as sticks, through its own rate profile."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from e2efly.control import Vec3
from e2efly.flight.betaflight.messages import set_raw_rc
from e2efly.flight.betaflight.mixers import mixer_of
from e2efly.flight.betaflight.sticks import Sticks
from e2efly.flight.pilot.hover import controlled
from e2efly.validation.plant import EVERYTHING, Plant, RigidState, check_mode
from e2efly.validation.plants.registry import register
from e2efly.vehicles.vehicle import RATE_LOOP, Vehicle

if TYPE_CHECKING:
    from e2efly.flight.bridge import Bridge

LATENCY_S = 0.004
"""Latency from a stick frame to the firmware's rate loop, s: half of the bridge's period on the rig, and one round of
the firmware."""
FRAME_S = 0.008
"""Longest time between two stick frames, s."""
HEIGHT_M = 2.0
"""Height at which the throttle map is learned, m."""
DISARMED_S, ARMED_S, SPINNING_S = 0.2, 0.4, 0.25
"""Durations before a flight, s: the firmware is disarmed (it resets its integrals), armed, and held with the rotors at
hover speed."""


@register("betaflight")
class BetaflightPlant(Plant):
    """Starts the firmware, takes off once to learn the throttle map, and then flies from any given state."""

    parallel, latency, episodes, whole_flights = False, LATENCY_S, 20, True
    alters = EVERYTHING - {*RATE_LOOP, "plain_mixer"}

    def __init__(self, vehicle: Vehicle, mode: str) -> None:
        """Build the firmware if needed, start it and take off.

        Raises:
            ValueError: for a command mode that does not lead to body rates and thrust, and for rotors that no mixer of
                the firmware drives.
            OSError: when the firmware cannot be built or started, or does not take off.
        """
        check_mode(mode, self.name, rates=True)
        mixer_of(vehicle)
        from e2efly.validation import firmware_program
        from e2efly.validation.bridge_session import Session, rehearsal_settings
        from e2efly.validation.rig import Rig

        program = firmware_program.chosen()
        self.vehicle, self.mode, self._body = vehicle, mode, vehicle
        self._folder = tempfile.TemporaryDirectory(prefix="e2efly-")
        self._rig = Rig(program, Path(self._folder.name), vehicle)
        try:
            self._rig.start()
            self._session = Session(self._rig, rehearsal_settings(HEIGHT_M))
            if not self._session.take_off(4.0):
                raise OSError(f"the firmware does not take off: {self._bridge.flight.reasons}")
        except BaseException:
            self._rig.close()
            raise

    @property
    def _bridge(self) -> "Bridge":
        return self._session.bridge

    @property
    def _sticks(self) -> Sticks:
        return self._session.autopilot.sticks

    def meet(self, body: Vehicle, plain_mixer: bool = False) -> None:
        """Put another body under the firmware. Throttle map and settings stay those of the vehicle that took off.

        Raises:
            ValueError: for a plain mixer, because the firmware has its own mixer; for a body with another number of
                rotors.
        """
        if plain_mixer:
            raise ValueError("plant 'betaflight' has the firmware's own mixer; accepted: plain_mixer False")
        if body.rotor_count != self.vehicle.rotor_count:
            raise ValueError(
                f"vehicle {body.name!r} has {body.rotor_count} rotors; accepted: {self.vehicle.rotor_count}, which the "
                "firmware drives"
            )
        self._body = body
        self._rig.carry(body)

    def disturb(self, wind: np.ndarray, rotor_share: np.ndarray) -> None:
        """Set wind and shares of thrust from now on."""
        self._rig.wind, self._rig.thrust_shares = wind, rotor_share

    @property
    def state(self) -> RigidState:
        """The vehicle now."""
        return RigidState.of(self._rig.state)

    def reset(self, state: RigidState) -> None:
        """Disarm, arm, bring the rotors to hover speed while the body is held in place, and release it."""
        from e2efly.validation.world import FlownBody

        rig, mid = self._rig, self._sticks.centre
        closed = self._sticks.arrange((mid, mid, mid, 1000), ())
        hover = self._bridge.map.throttle(9.81)
        spinning = self._sticks.channels_of(hover, (0.0, 0.0, 0.0), ()).channels
        speed = np.full(self._body.rotor_count, self._body.hover_rotor_speed)
        rig.held, zero = True, np.zeros(3)
        rig.wind, rig.thrust_shares = np.zeros(3), np.ones(self._body.rotor_count)
        rig.state = FlownBody(state.position, zero, np.array([1.0, 0, 0, 0]), zero, speed)
        for armed, channels, seconds in (
            (False, closed, DISARMED_S), (True, closed, ARMED_S), (True, spinning, SPINNING_S),
        ):  # fmt: skip
            rig.set(armed=armed)
            for _ in range(round(seconds / FRAME_S)):
                self._frame(channels, FRAME_S)
        rig.held = False
        rig.state = FlownBody(state.position, state.velocity, state.quaternion, state.body_rate, speed)

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command for `dt` s, and send it again at least every `FRAME_S`."""
        frames = max(int(np.ceil(dt / FRAME_S - 1e-9)), 1)
        for _ in range(frames):
            wanted = controlled(self.vehicle, self.mode, self.state.odometry(0.0), command)
            rates = Vec3(*(float(rate) for rate in (wanted.rate.x, wanted.rate.y, wanted.rate.z)))
            throttle = min(self._bridge.map.throttle(float(wanted.thrust)), self._sticks.throttle.largest)
            self._frame(self._sticks.channels_of(throttle, (rates.x, rates.y, rates.z), ()).channels, dt / frames)

    def close(self) -> None:
        """End the firmware."""
        self._session.close()
        self._rig.close()
        self._folder.cleanup()

    def _frame(self, channels: tuple[int, ...], dt: float) -> None:
        now = self._rig.now()
        client = self._session.autopilot.client
        client.poll(now)
        client.set_raw_rc(set_raw_rc(channels), now)
        self._rig.sleep(dt)
