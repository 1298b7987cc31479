"""AirSim over its RPC: the client, frames, lockstep, what its vehicle can do, and its settings. Imports no JAX."""
