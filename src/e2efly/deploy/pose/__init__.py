"""Pose sources: where the vehicle's motion comes from, and what is checked before anything flies by it."""
