"""Pose sources: where the vehicle's motion comes from, and what is checked before it is used for flight."""
