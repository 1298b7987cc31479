"""Live topics of ROS 1: a real roscore, a real rospy subscriber in a process of its own."""

from collections.abc import Iterator

import pytest

from e2efly.flight.child import SYSTEM_PYTHON
from e2efly.logs.scripts.ros_topics import TF_DEFINITION
from tests.flight.live_ros import TAKE, check, check_transforms, heard, latched
from tests.flight.ros_master import ros_master

SUBSCRIBER = f"""{TAKE}
import rospy, genpy.dynamic
definition = {TF_DEFINITION!r}
tf = genpy.dynamic.generate_dynamic("tf2_msgs/TFMessage", definition)["tf2_msgs/TFMessage"]
assert tf._md5sum == "94810edda583a504dfda3829e70d7eec", tf._md5sum  # that of the package, by which rviz knows it
kinds["/tf"] = tf
missing.add("/tf")
rospy.init_node("subscriber", disable_signals=True)
for name, kind in kinds.items():
    topic = name if name[0] == "/" else sys.argv[1] + "/" + name
    rospy.Subscriber(topic, kind, lambda m, name=name: take(name, m), queue_size=10)
with one:
    print(json.dumps(["ready", None, None]), flush=True)
while missing:
    rospy.sleep(0.05)
"""


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with ros_master(tmp_path_factory.mktemp("ros1")):
        yield


def test_a_subscriber_hears_every_topic(ros: None) -> None:
    said = heard("ros1:/vehicle", "/vehicle", [SYSTEM_PYTHON, "-c", SUBSCRIBER])
    check(said)
    check_transforms(said["/tf"][1])


def test_who_comes_late_hears_the_mode(ros: None) -> None:
    command = [SYSTEM_PYTHON, "-c", SUBSCRIBER.replace("set(kinds)", '{"mode"}').replace('missing.add("/tf")', "")]
    assert latched("ros1", "/e2efly", command)["mode"][1] == "HOVER -> POLICY: switch"
