"""Commands on topics of ROS 1: a real roscore, a real rospy publisher in a process of its own."""

from collections.abc import Iterator

import pytest

from e2efly.flight.child import SYSTEM_PYTHON
from e2efly.flight.commander.sources import open_commands
from tests.flight.command_streams import PUBLISHED, REFUSED, TOPICS, first, refused
from tests.flight.ros_domain import publisher
from tests.flight.ros_master import PUBLISH
from tests.flight.test_pose_ros1 import ros  # noqa: F401


@pytest.fixture(scope="module")
def commander(ros: None) -> Iterator[None]:  # noqa: F811
    """A publisher of commands, beside that of poses."""
    with publisher(PUBLISHED + PUBLISH, SYSTEM_PYTHON):
        yield


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("topic", TOPICS)
def test_each_type_is_a_command_of_its_mode(commander: None, topic: str) -> None:
    TOPICS[topic](first(f"ros1:{topic}"))


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("topic", "problem"), [*REFUSED.items(), ("/vector", "geometry_msgs/Vector3")])
def test_what_is_no_command_is_refused_by_name(commander: None, topic: str, problem: str) -> None:
    assert problem in refused(f"ros1:{topic}")


def test_a_topic_not_from_the_root_is_refused() -> None:
    with pytest.raises(ValueError, match="command source ros1: topic is 'commands'; accepted: a name from the root"):
        open_commands("ros1:commands")
