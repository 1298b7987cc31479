"""Topics of ROS 1: a real roscore, a real rospy publisher in a process of its own."""

import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from e2efly.flight.child import SYSTEM_PYTHON
from e2efly.flight.pose.relay import RelaySource
from e2efly.flight.pose.sources import open_source
from e2efly.flight.publish import Live, targets_of
from e2efly.flight.sight.sources import open_image
from tests.flight.ros_domain import publisher
from tests.flight.ros_images import DEPTH
from tests.flight.ros_master import PUBLISH, ros_master
from tests.flight.ros_poses import PUBLISHED, TOPICS, check_published, first, problem_of


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    folder = tmp_path_factory.mktemp("ros1")
    with ros_master(folder) as said, said.open("a") as output, publisher(PUBLISHED + PUBLISH, SYSTEM_PYTHON, output):
        yield


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("topic", TOPICS)
def test_a_topic_is_read_whatever_its_type(ros: None, topic: str) -> None:
    with closing(open_source(f"ros1:{topic}")) as source:
        check_published(first(source), topic)


def test_a_topic_of_another_type_is_named(ros: None) -> None:
    with closing(open_source("ros1:/text")) as source:
        problem = problem_of(source)
        assert "std_msgs/String" in problem
        assert "nav_msgs/Odometry" in problem
        assert source.refused >= 1


def test_closing_ends_the_process(ros: None) -> None:
    source = open_source("ros1:/pose")
    assert isinstance(source, RelaySource)
    assert source.describe().startswith("ros1:/pose (rospy of ")
    source.close()
    assert source._child.process.returncode == 0
    assert source.read(time.monotonic()) == []


@pytest.mark.parametrize(
    "begin",
    [
        lambda: open_source("ros1:/odometry"),
        lambda: open_image("ros1:/camera/image_raw", DEPTH),
        lambda: Live(targets_of(["ros1"])),
    ],
    ids=["poses", "images", "live"],
)
def test_without_a_master_it_says_so(begin: Callable[[], object], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    monkeypatch.setenv("E2EFLY_ROS_PYTHON", SYSTEM_PYTHON)
    with pytest.raises(ValueError, match=r"no ROS master answers .*127\.0\.0\.1:1.*start roscore"):
        begin()


def test_an_interpreter_without_ros_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    bare = tmp_path / "python"
    bare.write_text(f'#!/bin/sh\nexec {SYSTEM_PYTHON} -S "$@"\n')
    bare.chmod(0o755)
    monkeypatch.setenv("E2EFLY_ROS_PYTHON", str(bare))
    monkeypatch.delenv("PYTHONPATH", raising=False)
    with pytest.raises(ValueError, match=r"No module named 'rospy'.*python3-rospy.*E2EFLY_ROS_PYTHON"):
        open_source("ros1:/odometry")
