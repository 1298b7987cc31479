"""AirSim: its RPC byte for byte beside the published client's, frames, lockstep, what is measured, and bad input."""
