"""One control step: physics sub-steps under a command, with the rate loop inside of each."""

import dataclasses
import math
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.config.names import unknown
from e2efly.control import COMMAND_MODES, Vec3
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.body import reached
from e2efly.simulation.physics.control import Command, control_law, remembered
from e2efly.simulation.physics.integrate import INTEGRATORS, SWINGING, ahead
from e2efly.simulation.physics.mixer import Mixer
from e2efly.simulation.physics.state import Parts, RateLoop, State, split
from e2efly.vehicles.vehicle import RATE_LOOP, Vehicle

RATES = (0.1, 10_000.0)
"""Slowest and fastest control rate that is accepted, Hz. No flight controller has a faster loop."""
STEPS = (1e-6, 1.0)
"""Smallest and largest accepted value of the largest physics sub-step, s."""


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["nominal", "mixer", "body", "full_speed"],
    meta_fields=["command_mode", "integrator", "control_period", "substeps"],
)
@dataclass(frozen=True)
class Physics:
    """The settings of the physics. The flight controller is tuned to the nominal vehicle."""

    nominal: Vehicle
    """The vehicle of the control laws and of the action map, as arrays."""
    mixer: Mixer
    """The nominal vehicle's mixer."""
    command_mode: str
    """A name of `COMMAND_MODES`."""
    integrator: str
    """A name of `INTEGRATORS`."""
    control_period: float
    """Duration of a control step, s."""
    substeps: int
    """Physics steps per control step."""
    body: Vehicle | None = None
    """The vehicle that flies, as arrays, if the flight controller does not know it. None: the nominal vehicle."""
    full_speed: float | Array | None = None
    """Largest speed of that vehicle's rotors, rad/s, whatever the command. None: only the limit of the mixer
    applies."""

    @property
    def flown(self) -> Vehicle:
        """The vehicle that flies."""
        return self.nominal if self.body is None else self.body

    def flying(self, body: Vehicle, dtype: type = np.float32) -> "Physics":
        """The same flight controller on another (loaded) body, which it does not know."""
        moved = jax.tree.map(lambda x: np.asarray(x, dtype), body)
        return dataclasses.replace(self, body=moved, full_speed=dtype(body.full_rotor_speed))

    def of_each(self, vehicle: Vehicle) -> "Physics":
        """The same for a batch of vehicles of a family. The flight controller of each vehicle knows its vehicle."""
        return dataclasses.replace(self, nominal=vehicle, mixer=Mixer.of_each(vehicle))

    @staticmethod
    def of(
        vehicle: Vehicle,
        command_mode: str = "ctbr",
        integrator: str = "rk3",
        control_rate: float | None = None,
        largest_step: float = 0.005,
        dtype: type = np.float32,
    ) -> "Physics":
        """Physics of a loaded vehicle, with the smallest number of equal sub-steps of at most `largest_step` seconds.

        Raises:
            ValueError: for an unknown mode or integrator, or a rate or step that is not positive.
        """
        if command_mode not in COMMAND_MODES:
            raise ValueError(unknown("command mode", command_mode, COMMAND_MODES))
        if integrator not in INTEGRATORS:
            raise ValueError(unknown("integrator", integrator, INTEGRATORS))
        rate = vehicle.control_rate if control_rate is None else control_rate
        for name, value, (low, high), unit in (
            ("control_rate", rate, RATES, "Hz"), ("largest_step", largest_step, STEPS, "s")
        ):  # fmt: skip
            if not low <= value <= high:  # false for NaN
                raise ValueError(f"{name} is {value}; accepted: a positive number, {low:g} to {high:g} {unit}")
        substeps = math.ceil(1 / (rate * largest_step) - 1e-9)
        nominal = jax.tree.map(lambda x: np.asarray(x, dtype), vehicle)
        return Physics(nominal, Mixer.of(vehicle, dtype), command_mode, integrator, 1 / rate, substeps)


def vehicle_of_loop(physics: Physics, vehicle: Vehicle) -> Vehicle:
    """The vehicle of the control laws: the nominal vehicle with the rate loop of the plant."""
    return dataclasses.replace(physics.nominal, **{name: getattr(vehicle, name) for name in RATE_LOOP})


def started(physics: Physics, vehicle: Vehicle, state: State) -> State:
    """Add the rate loop's initial state to a state, if the plant's rate loop has one.

    `step` does this itself. Loops whose state must keep its structure need it before their first step.
    """
    if state.rate_loop is not None or COMMAND_MODES[physics.command_mode].controller is None:
        return state
    return dataclasses.replace(state, rate_loop=RateLoop.at_rest(vehicle, state.body_rate))


def step(
    physics: Physics,
    vehicle: Vehicle,
    state: State,
    command: Float[Array, "*n c"],
    *,
    previous: Float[Array, "*n c"] | None = None,
    switch_time: Float[Array, "*n"] | None = None,
    wind: Float[Array, "*n 3"] | None = None,
    rotor_share: Float[Array, "*n r"] | None = None,
    push: Float[Array, "*n 2"] | None = None,
) -> State:
    """Advance the state by one control period.

    Args:
        physics: how to integrate and control.
        vehicle: the plant; any field may be batched. Its rate gain, integral gain and filter are those of the rate
            loop. For everything else the flight controller uses `physics.nominal`.
        state: the state at the start of the step. A load that is part of it hangs from the vehicle.
        command: the command, in the units of the command mode.
        previous: the command that still acts before `switch_time`, for latencies that are not a whole number of steps.
        switch_time: time after the start of the step at which `command` replaces `previous`, s, in [0, control_period].
            A sub-step in which the switch lies uses the time average of the two commands. This keeps the step
            differentiable with respect to the latency.
        wind: velocity of the air in the world, m/s.
        rotor_share: thrust of each rotor divided by the thrust from the vehicle's thrust map. None: 1.
        push: acceleration by a horizontal force from outside at the centre of mass, world, m/s^2. None: no such force.

    Raises:
        ValueError: for a load with an integrator that is not stable with it.
    """
    if state.load is not None and physics.integrator not in SWINGING:
        raise ValueError(f"integrator is {physics.integrator!r}; accepted with a load: {', '.join(SWINGING)}")
    mode = COMMAND_MODES[physics.command_mode]
    state = started(physics, vehicle, state)
    integrate = INTEGRATORS[physics.integrator]
    dt = physics.control_period / physics.substeps
    plant = Airframe.of(vehicle, dt, rotor_share, push, state.load)
    controller = vehicle_of_loop(physics, vehicle)
    air = None if wind is None else Vec3.of(wind)
    after = split(command)
    before = None if previous is None else split(previous)

    def substep(carry: tuple[Parts, RateLoop | None], index: Array) -> tuple[tuple[Parts, RateLoop | None], None]:
        parts, loop = carry
        acting = after
        if before is not None and switch_time is not None:
            done = jnp.clip((index + 1) - switch_time / dt, 0.0, 1.0).astype(command.dtype)
            acting = _blend(before, after, done)
        middle, time = ahead(plant, parts, air, dt)
        memory = None if loop is None else remembered(mode, controller, loop, parts, middle, acting, time)
        rotor_command = control_law(mode)(controller, physics.mixer, middle, acting, memory)
        if physics.full_speed is not None:
            rotor_command = tuple(jnp.minimum(speed, physics.full_speed) for speed in rotor_command)
        moved = integrate(plant, parts, reached(plant, parts.rotor_speed, rotor_command), air, dt)
        return (moved, None if loop is None else remembered(mode, controller, loop, parts, moved, acting, dt)), None

    # a gradient computes each sub-step again from its start: faster than storing what is inside, and far smaller
    again = jax.checkpoint(substep, prevent_cse=False)
    loop = None if mode.controller is None else state.rate_loop
    start = Parts.of(state), jax.tree.map(Vec3.of, loop)
    (parts, loop), _ = jax.lax.scan(again, start, jnp.arange(physics.substeps))
    end = parts.join(state.load)
    if loop is None:
        return dataclasses.replace(end, rate_loop=state.rate_loop)
    return dataclasses.replace(
        end, rate_loop=RateLoop(*(x if x is None else x.stack() for x in (loop.integral, loop.seen)))
    )


def _blend(before: Command, after: Command, share: Array) -> Command:
    return tuple(x + (y - x) * share for x, y in zip(before, after, strict=True))
