"""Commands on topics of ROS 2: a real rclpy publisher in a process of its own."""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from e2efly.flight.commander.commander import Commander
from e2efly.flight.commander.sources import open_commands
from e2efly.flight.settings import FlightSettings
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.loading import load_vehicle
from tests.flight.command_streams import PUBLISHED, REFUSED, TOPICS, first, refused
from tests.flight.ros_domain import PUBLISH, publisher, ros_domain


@pytest.fixture(scope="module")
def ros() -> Iterator[None]:
    """A publisher in a domain of its own that no other machine hears."""
    with ros_domain(), publisher(PUBLISHED + PUBLISH):
        yield


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("topic", TOPICS)
def test_each_type_is_a_command_of_its_mode(ros: None, topic: str) -> None:
    command = first(f"ros2:{topic}")
    TOPICS[topic](command)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("topic", "problem"), [*REFUSED.items(), ("/vector", "geometry_msgs/msg/Vector3")])
def test_what_is_no_command_is_refused_by_name(ros: None, topic: str, problem: str) -> None:
    said = refused(f"ros2:{topic}")
    assert problem in said


@pytest.mark.whole
def test_a_relay_that_ends_is_the_reason_of_the_silence(ros: None) -> None:
    source: Any = open_commands("ros2:/velocity")
    commander = Commander(source, load_vehicle("vis_r"), FlightSettings())
    zero = np.zeros(3)
    still = Odometry(0.0, np.array([0.0, 0.0, 1.0]), zero, np.array([1.0, 0, 0, 0]), zero)
    try:
        deadline = time.monotonic() + 20
        # its stamp stands, so that all but the first are refused: what comes last is the reason
        while not (commander.stream.taken and commander.stream.refused) and time.monotonic() < deadline:
            commander.hear(still, time.monotonic())
            time.sleep(0.01)
        assert commander.stream.taken and commander.stream.refused
        source._child.process.kill()
        source._child.process.wait(10)
        ended = time.monotonic()
        while time.monotonic() < ended + 0.4:
            commander.hear(still, time.monotonic())
            time.sleep(0.01)
        assert "its process has ended" in str(commander.readiness(still, time.monotonic()))
    finally:
        source.close()


def test_a_topic_not_from_the_root_is_refused() -> None:
    with pytest.raises(ValueError, match="command source ros2: topic is 'commands'; accepted: a name from the root"):
        open_commands("ros2:commands")
