"""The simulator in which policies are trained, as a plant."""

import dataclasses
from typing import Any

import numpy as np

from e2efly.policy.contract import Contract
from e2efly.validation.plant import EVERYTHING, MOMENT, Plant, RigidState, check_mode
from e2efly.validation.plants.registry import register
from e2efly.vehicles.vehicle import Vehicle

_STILL = None, None
"""No wind, and full thrust."""


@register("simulator")
class SimulatorPlant(Plant):
    """Physics steps of the same length as in training. The state advances when a whole step has been commanded.

    A command that begins inside a physics step acts in proportion, as in training: the step uses the mean of the
    commands over it. A control period ends at the end of a physics step.
    """

    alters = EVERYTHING

    def __init__(self, vehicle: Vehicle, command_mode: str = "ctbr", control_rate: float | None = None) -> None:
        """Make the plant, with a flight controller that is tuned to the vehicle.

        A whole number of physics steps fits into a period of the control rate, Hz, which is the vehicle's own if left
        out.

        Raises:
            ValueError: for an unknown command mode, or a rate that is not positive.
        """
        check_mode(command_mode, self.name)
        import jax

        from e2efly.simulation.physics import Physics

        physics = Physics.of(vehicle, command_mode, control_rate=control_rate)
        self._step = physics.control_period / physics.substeps
        self._physics = dataclasses.replace(physics, control_period=self._step, substeps=1)
        self._advance, self._hover = jax.jit(_advance), np.full(vehicle.rotor_count, vehicle.hover_rotor_speed)
        self._made, self._air = self._physics, _STILL
        self.reset(RigidState(np.zeros(3), np.zeros(3), np.eye(4)[0], np.zeros(3)))

    @classmethod
    def of(cls, vehicle: Vehicle, contract: Contract) -> "SimulatorPlant":
        """The plant, with the control rate of a contract."""
        return cls(vehicle, contract.action.mode, contract.control_rate_hz)

    def meet(self, body: Vehicle, plain_mixer: bool = False) -> None:
        """Fly another body from the next `reset` on, which the flight controller does not know."""
        mixer = dataclasses.replace(self._made.mixer, plain=np.float32(plain_mixer))
        self._physics = dataclasses.replace(self._made, mixer=mixer).flying(body)
        self._hover = np.full(body.rotor_count, body.hover_rotor_speed)

    def disturb(self, wind: np.ndarray, rotor_share: np.ndarray) -> None:
        """Set wind and shares of thrust from now on."""
        self._air = wind.astype(np.float32), rotor_share.astype(np.float32)

    @property
    def state(self) -> RigidState:
        """The vehicle at the end of the last full physics step."""
        return RigidState.of(self._state)

    def reset(self, state: RigidState) -> None:
        """Put the vehicle into a state, with the rotors at hover speed."""
        import jax.numpy as jnp

        from e2efly.simulation.physics import State, started

        arrays = (state.position, state.velocity, state.quaternion, state.body_rate, self._hover)
        p, v, q, w, speed = (jnp.asarray(x, jnp.float32) for x in arrays)
        begin = State(p, v, q, w, speed)
        self._state = started(self._physics, self._physics.flown, begin)
        self._filled, self._mean, self._air = 0.0, 0.0, _STILL

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command, (4,), for `dt` s."""
        while dt > MOMENT:
            part = min(dt, self._step - self._filled)
            self._mean = self._mean + command * (part / self._step)
            self._filled += part
            dt -= part
            if self._filled > self._step - MOMENT:
                mean = np.asarray(self._mean, np.float32)
                self._state = self._advance(self._physics, self._state, mean, *self._air)
                self._filled, self._mean = 0.0, 0.0


def _advance(physics: Any, state: Any, command: Any, wind: Any, rotor_share: Any) -> Any:
    from e2efly.simulation.physics import step

    return step(physics, physics.flown, state, command, wind=wind, rotor_share=rotor_share)
