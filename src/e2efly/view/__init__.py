"""Pictures of runs and flights."""
