"""Learning: networks, algorithms (one a file), checkpoints and the runner."""
