"""RAPTOR's form: 22 inputs, a dense layer of 16 ReLU, a GRU of 16, a dense layer of 4, a hundred times a second.

PX4's module `mc_raptor` compiles these sizes in and computes the inputs itself; they are written here as it does
(PX4-Autopilot, src/modules/mc_raptor/mc_raptor.cpp and mc_raptor.hpp, read 2026-11-29). In the order of the network:
position less the target's, clipped to 0.5 m; rotation matrix, body to the target's yaw, row by row; velocity less the
target's, clipped to 1 m/s; body rates, rad/s; the last commands. World vectors are in the frame of the target's yaw.
Commands are shares of the rotor speed: -1 stands still, 1 is full speed.
"""

from collections.abc import Sequence
from itertools import accumulate

from e2efly.control.vectors import Array, namespace
from e2efly.policy.observation import Field

INPUTS, UNITS, OUTPUTS = 22, 16, 4
RATE = 100.0
"""Control rate, Hz."""
COMMAND_MODE = "rotor_speed"
FARTHEST = 0.5
"""Largest position error that is shown, m per axis."""
FASTEST = 1.0
"""Largest velocity error that is shown, m/s per axis."""
ROTOR_OF = (1, 0, 2, 3)
"""The place of each of our rotors (rear right, front right, rear left, front left) in RAPTOR's order: front right, rear
right, rear left, front left. It is its own inverse."""
FIELDS = {"position_error": 3, "attitude": 4, "velocity": 3, "body_rate": 3, "past_actions": 4}
"""The observation from which the inputs are computed, with the sizes of its fields. The yaw of the target is the
world's x axis."""
COLUMNS = {
    name: tuple(range(end - size, end))
    for (name, size), end in zip(FIELDS.items(), accumulate(FIELDS.values()), strict=True)
}
"""The columns of each field in the observation."""


def inputs_of(observation: Array) -> Array:
    """The inputs of the network, (*n, 22), for observations, (*n, 17), in the library of the array."""
    xp = namespace(observation)
    error, quaternion, velocity, rate, last = (observation[..., list(at)] for at in COLUMNS.values())
    w, x, y, z = (quaternion[..., i] for i in range(4))
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    shown = xp.clip(-error, -FARTHEST, FARTHEST), xp.stack(rows, axis=-1), xp.clip(velocity, -FASTEST, FASTEST)
    return xp.concatenate([*shown, rate, last[..., list(ROTOR_OF)]], axis=-1)


def check_form(fields: Sequence[Field], rate: float, mode: str) -> None:
    """Check that a policy sees, and commands, what RAPTOR's form computes its inputs from.

    Args:
        fields: the observation.
        rate: control rate, Hz.
        mode: command mode.

    Raises:
        ValueError: naming what differs, its value and what is accepted.
    """
    sees = {field.name: field.size for field in fields}
    for name, value, accepted in (
        ("observation", sees, FIELDS), ("control_rate", rate, RATE), ("command_mode", mode, COMMAND_MODE),
    ):  # fmt: skip
        if value != accepted:
            raise ValueError(f"{name} is {value!r}; accepted in RAPTOR's form: {accepted!r}")
