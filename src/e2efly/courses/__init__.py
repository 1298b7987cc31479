"""Where to fly: references, gates and race tracks, for NumPy and JAX alike. Imports no JAX."""
