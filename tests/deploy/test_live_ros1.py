"""Live topics of ROS 1: a real roscore, a real rospy subscriber in a process of its own."""

import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from e2efly.deploy.child import SYSTEM_PYTHON
from e2efly.deploy.log.live import Live, targets_of
from tests.deploy.live_ros import TAKE, check, heard, latched

PACKAGES = (
    "apt-get install python3-roslaunch python3-rosmaster python3-rospy python3-nav-msgs python3-geometry-msgs "
    "python3-sensor-msgs python3-std-msgs"
)
SUBSCRIBER = f"""{TAKE}
import rospy
rospy.init_node("subscriber", disable_signals=True)
for name, kind in kinds.items():
    rospy.Subscriber(sys.argv[1] + "/" + name, kind, lambda m, name=name: take(name, m), queue_size=10)
with one:
    print(json.dumps(["ready", None, None]), flush=True)
while missing:
    rospy.sleep(0.05)
"""


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A ROS master on a free port."""
    roscore = shutil.which("roscore")
    if roscore is None or not Path(SYSTEM_PYTHON).exists():
        pytest.fail(f"needs ROS 1: {PACKAGES}; or E2EFLY_WITHOUT=ros1 to go without these tests")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    folder = tmp_path_factory.mktemp("ros1")
    settings = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1"}
    settings |= {"ROS_HOME": str(folder), "ROS_LOG_DIR": str(folder)}
    with pytest.MonkeyPatch.context() as patch, (folder / "output").open("w") as output:
        for key, value in settings.items():
            patch.setenv(key, value)
        core = subprocess.Popen([roscore, "-p", str(port)], stdout=output, stderr=output, start_new_session=True)
        try:
            deadline = time.monotonic() + 30
            while not answers(port):
                assert time.monotonic() < deadline, (folder / "output").read_text()
                time.sleep(0.05)
            yield
        finally:
            core.terminate()
            core.wait(20)


def answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def test_a_subscriber_hears_every_topic(ros: None) -> None:
    check(heard("ros1:/vehicle", "/vehicle", [SYSTEM_PYTHON, "-c", SUBSCRIBER]))


def test_who_comes_late_hears_the_mode(ros: None) -> None:
    command = [SYSTEM_PYTHON, "-c", SUBSCRIBER.replace("set(kinds)", '{"mode"}')]
    assert latched("ros1", "/e2efly", command)["mode"][1] == "HOVER -> POLICY: switch"


def test_without_a_master_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    monkeypatch.setenv("E2EFLY_ROS_PYTHON", SYSTEM_PYTHON)
    with pytest.raises(ValueError, match=r"no ROS master answers .*127\.0\.0\.1:1.*start roscore"):
        Live(targets_of(["ros1"]))
