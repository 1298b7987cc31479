"""Autopilots that speak MAVLink 2: PX4 and ArduPilot."""
