"""What the four numbers of a command are, in each command mode. No JAX."""

COMMANDS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "rotor_thrust": (("rear_right", "front_right", "rear_left", "front_left"), ("N",) * 4),
    "rotor_share": (("rear_right", "front_right", "rear_left", "front_left"), ("1",) * 4),
    "ctbr": (("collective_thrust", "roll_rate", "pitch_rate", "yaw_rate"), ("m/s^2", "rad/s", "rad/s", "rad/s")),
    "attitude": (("collective_thrust", "roll", "pitch", "yaw"), ("m/s^2", "rad", "rad", "rad")),
    "acceleration": (("x", "y", "z", "yaw"), ("m/s^2", "m/s^2", "m/s^2", "rad")),
    "velocity": (("x", "y", "z", "yaw"), ("m/s", "m/s", "m/s", "rad")),
    "position": (("x", "y", "z", "yaw"), ("m", "m", "m", "rad")),
}
"""Names and units of the four commands of each command mode, for simulator, contract and flight."""
OF_ROTORS = ("rotor_thrust", "rotor_share")
"""Modes that command the rotors themselves, below the flight controller's rate loop."""
