"""Terms of the physics that a vehicle's file may leave out: values for the tests."""

from typing import Any

VALUES: dict[str, Any] = {
    "rotor_inertia": 1.5e-5,
    "motor_time_constant_down": 0.06,
    "centre_of_mass": [0.004, -0.006, 0.01],
    "inertia_products": [1e-4, -2e-4, 5e-5],
    "drag_torque": [2e-3, 3e-3, 1e-3],
    "rate_integral_gain": [60.0, 50.0, 20.0],
    "gyro_time_constant": 0.004,
    "nominal_voltage": 14.8,
    "battery_voltage": 15.6,
    "voltage_sag": 0.08,
    "speed_per_volt": 0.9,
    "rotor_speed_ceiling": [3600.0, 3500.0, 3400.0, 3300.0],
    "rotor_axis": [[0.08, 0.06, 0.995], [-0.06, 0.08, 0.995], [0.06, -0.08, 0.995], [-0.08, -0.06, 0.995]],
    "inflow_loss": 60.0,
}
"""Of the size that a vehicle like the VIS-R has."""
