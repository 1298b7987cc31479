"""What a training is told and what it leaves: presets, input files, the run directory. Imports no JAX."""
