"""Motion capture systems, through the package `motioncapture`."""

import sys

from e2efly.flight.pose.registry import part_of, register
from e2efly.flight.pose.relay import RelaySource, open_relay
from e2efly.policy.odometry import Sample

SYSTEMS = ("vrpn", "optitrack", "vicon", "qualisys", "nokov", "fzmotion", "mock")
"""Systems for which `motioncapture` may be built. The package itself reports which of them it supports."""
ADVICE = (
    "install the package motioncapture (pip install motioncapture), and check that the system streams to this machine"
)
"""What to do if it does not open."""


@register("mocap", "mocap:TYPE:HOST:RIGID_BODY")
def open_mocap(where: str) -> RelaySource[Sample]:
    """Follow one rigid body: `where` has one of `SYSTEMS`, the address of the machine that streams, and the body's name
    there.

    Raises:
        ValueError: for an unknown system, a package that is not installed, or a system that does not answer.
    """
    system, _, rest = where.partition(":")
    host, _, body = rest.partition(":")
    system, host, body = part_of(system), part_of(host), part_of(body)
    if system not in SYSTEMS:
        raise ValueError(f"pose source mocap: type is {system!r}; accepted: {', '.join(SYSTEMS)}")
    return open_relay(f"mocap:{system}:{host}:{body}", [sys.executable], ADVICE, "mocap", system, host, body)
