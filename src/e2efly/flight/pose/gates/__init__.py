"""Poses from the gates that a camera sees, and from an IMU: a pose source of a racing vehicle without motion capture.

`lens.py` says where the corners of a known track appear, `association.py` which found corner is which of them, and
`error_state.py` carries the pose on by the IMU and corrects it by the difference. `gate_estimator.py` wires them, and
`gate_source.py` is the source. `flight/sight/gate_corners.py` finds corners in a mask.
"""
