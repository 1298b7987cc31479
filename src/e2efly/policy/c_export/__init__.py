"""The C code of `export --c`: a policy's graph, its contract and a check, for use without Python. Imports no JAX."""
