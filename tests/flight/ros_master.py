"""A ROS 1 master of the tests' own."""

import shutil
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from e2efly.flight.child import SYSTEM_PYTHON
from tests.waiting import free_port, until

PACKAGES = (
    "apt-get install python3-roslaunch python3-rosmaster python3-rospy python3-nav-msgs python3-geometry-msgs "
    "python3-sensor-msgs python3-std-msgs"
)


PUBLISH = """
import rospy
rospy.init_node("publisher", anonymous=True, disable_signals=True)
publishers = {topic: rospy.Publisher(topic, kind, queue_size=1) for topic, kind in KINDS.items()}
while True:
    for topic in KINDS:
        publishers[topic].publish(message_of(topic, rospy.Time(1700000000, 500000000)))
    rospy.sleep(0.02)
"""
"""The end of a publisher's script, of `KINDS` by topic and `message_of(topic, stamp)`."""


@contextmanager
def ros_master(folder: Path) -> Iterator[Path]:
    """A master on a free port, to which the environment leads; the file that gets its output."""
    roscore = shutil.which("roscore")
    if roscore is None or not Path(SYSTEM_PYTHON).exists():
        pytest.fail(f"needs ROS 1: {PACKAGES}; or E2EFLY_WITHOUT=ros1 to go without these tests")
    port = free_port()
    settings = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1"}
    settings |= {"ROS_HOME": str(folder), "ROS_LOG_DIR": str(folder)}
    said = folder / "output"
    with pytest.MonkeyPatch.context() as patch, said.open("w") as output:
        for key, value in settings.items():
            patch.setenv(key, value)
        core = subprocess.Popen([roscore, "-p", str(port)], stdout=output, stderr=output, start_new_session=True)
        try:
            until(lambda: _answers(port), 30.0, lambda: f"(roscore): {said.read_text()}")
            yield said
        finally:
            core.terminate()
            core.wait(20)


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
