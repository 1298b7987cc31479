"""The simulator that policies are trained in, as a plant."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.physics import Physics, State, step
from e2efly.validate.plant import MOMENT, RigidState, check_mode
from e2efly.vehicles import Vehicle


class SimulatorPlant:
    """Physics steps of the same length as in training; it moves on when one of them is full.

    A command that takes over inside a physics step acts in proportion, as in training: the step is taken under the
    mean of what was commanded over it. At the ends of control periods no step is half full.
    """

    name = "simulator"

    def __init__(self, vehicle: Vehicle, command_mode: str = "ctbr", control_rate: float | None = None) -> None:
        """Make the plant.

        Args:
            vehicle: as loaded; the flight controller knows it exactly.
            command_mode: what `step` is given.
            control_rate: Hz, which physics steps divide evenly; the vehicle's own when left out.

        Raises:
            ValueError: for an unknown command mode, or a rate that is not positive.
        """
        check_mode(command_mode, self.name)
        physics = Physics.of(vehicle, command_mode, control_rate=control_rate)
        self._step = physics.control_period / physics.substeps
        self._physics = dataclasses.replace(physics, control_period=self._step, substeps=1)
        self._hover = vehicle.hover_rotor_speed
        self._state = State.hovering(vehicle, jnp.zeros(3, jnp.float32))
        self._filled, self._mean = 0.0, np.zeros(4)

    @property
    def state(self) -> RigidState:
        """The vehicle at the end of the last full physics step."""
        return RigidState.of(self._state)

    def reset(self, state: RigidState) -> None:
        """Put the vehicle there, the rotors at hover speed."""
        arrays = (state.position, state.velocity, state.quaternion, state.body_rate, np.full(4, self._hover))
        self._state = State(*(jnp.asarray(x, jnp.float32) for x in arrays))
        self._filled, self._mean = 0.0, np.zeros(4)

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command, (4,), for `dt` s."""
        while dt > MOMENT:
            part = min(dt, self._step - self._filled)
            self._mean = self._mean + command * (part / self._step)
            self._filled += part
            dt -= part
            if self._filled > self._step - MOMENT:
                mean = jnp.asarray(self._mean, jnp.float32)
                self._state = _advance(self._physics, self._state, mean)
                self._filled, self._mean = 0.0, np.zeros(4)

    def close(self) -> None:
        """Nothing to let go."""


@jax.jit
def _advance(physics: Physics, state: State, command: jax.Array) -> State:
    return step(physics, physics.nominal, state, command)
