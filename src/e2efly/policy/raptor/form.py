"""RAPTOR's form: 22 inputs, a dense layer of 16 ReLU, a GRU of 16, a dense layer of 4, a hundred times a second.

PX4's module `mc_raptor` compiles these sizes in and computes the inputs itself; they are written here as it does
(PX4-Autopilot, src/modules/mc_raptor/mc_raptor.cpp and mc_raptor.hpp, read 2026-11-29). In the order of the network:
position less the target's, clipped to 0.5 m; rotation matrix, body to the target's yaw, row by row; velocity less the
target's, clipped to 1 m/s; body rates, rad/s; the last commands. World vectors are in the frame of the target's yaw.
Commands are shares of the rotor speed: -1 stands still, 1 is full speed.
"""

from collections.abc import Sequence

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
