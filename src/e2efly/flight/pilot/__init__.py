"""Who flies, and how: state machine, hover controller, fence, and flight without poses. Pure functions."""
