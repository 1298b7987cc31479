"""Images on topics of ROS 1: a real master and a real rospy subscriber, in processes of their own."""

from pathlib import Path

import pytest

from e2efly.flight.child import SYSTEM_PYTHON
from tests.flight.given_on_ros import check_given
from tests.flight.ros_master import ros_master

SUBSCRIBER = """
import base64, json, rospy
from sensor_msgs.msg import CameraInfo, Image
rospy.init_node("subscriber", anonymous=True, disable_signals=True)
m, info = rospy.wait_for_message("/front/image", Image), rospy.wait_for_message("/front/camera_info", CameraInfo)
image = [m.encoding, m.height, m.width, m.step, m.header.frame_id, m.header.stamp.to_sec(), list(m.data)]
print(json.dumps({"image": image, "info": [list(info.K), info.height, info.width, info.header.frame_id]}), flush=True)
"""


@pytest.mark.whole
def test_depth_is_published_in_metres_with_its_camera(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("E2EFLY_ROS_PYTHON", SYSTEM_PYTHON)
    with ros_master(tmp_path):
        check_given("ros1", SYSTEM_PYTHON, SUBSCRIBER)
