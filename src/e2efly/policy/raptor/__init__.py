"""RAPTOR's form of a policy: its network, its checkpoints, and its ONNX graph.

J. Eschmann, D. Albani, G. Loianno, RAPTOR: A Foundation Policy for Quadrotor Control, 2025. Imports no JAX.
"""

TAR, HDF5 = ".tar", ".h5"
"""How the names of checkpoints end: PX4's, and those of the Python package `foundation-policy`."""
