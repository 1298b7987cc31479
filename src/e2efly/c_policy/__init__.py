"""The C of `export --c`: a policy's graph, its contract and its check, for machines without Python. Imports no JAX."""
