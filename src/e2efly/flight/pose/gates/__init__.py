"""Poses from the gates that a camera sees, and from an IMU: a pose source of a racing vehicle without motion capture.

`gate_corners.py` finds corners in a mask, `lens.py` says where the corners of a known track would be, and
`error_state.py` carries the pose on by the IMU and corrects it by the difference. `gate_estimator.py` wires them.
"""
