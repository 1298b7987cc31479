"""Topics of ROS 2: a real rclpy publisher in a process of its own."""

from collections.abc import Iterator
from contextlib import closing

import pytest

from e2efly.flight.pose.sources import open_source
from tests.flight.ros_domain import PUBLISH, publisher, ros_domain
from tests.flight.ros_poses import PUBLISHED, TOPICS, check_published, first, problem_of


@pytest.fixture(scope="module")
def ros() -> Iterator[None]:
    """A publisher in a domain of its own that no other machine hears."""
    with ros_domain(), publisher(PUBLISHED + PUBLISH):
        yield


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("topic", TOPICS)
def test_a_topic_is_read_whatever_its_type_and_reliability(ros: None, topic: str) -> None:
    with closing(open_source(f"ros2:{topic}")) as source:
        assert source.describe().startswith(f"ros2:{topic} (rclpy of ")
        check_published(first(source), topic)


def test_a_topic_of_another_type_is_named(ros: None) -> None:
    with closing(open_source("ros2:/text")) as source:
        problem = problem_of(source)
        assert "std_msgs/msg/String" in problem
        assert "nav_msgs/msg/Odometry" in problem
    assert source._child.process.returncode == 0  # type: ignore[attr-defined]


def test_an_odometry_without_twist_gives_no_velocity() -> None:
    from geometry_msgs.msg import TwistWithCovariance
    from nav_msgs.msg import Odometry

    from e2efly.flight.scripts.pose_relay import pose_of

    twist = TwistWithCovariance()
    twist.covariance[0] = -1.0
    content = pose_of(Odometry(twist=twist))
    assert "velocity" not in content
    assert "stamp" not in content  # zero says that there is none
    assert content["quaternion"] == [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("text", ["ros1:odometry", "ros2:odometry"])
def test_a_topic_not_from_the_root_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="topic is 'odometry'; accepted: a name from the root"):
        open_source(text)
