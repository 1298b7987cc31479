"""Flight logs as bags of ROS 1 and ROS 2, written without ROS by the package `rosbags`.

The messages and their frames are described in `scripts/ros_topics.py`.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from e2efly.logs.flight_log import FlightLog
from e2efly.logs.scripts.ros_messages import encoded, full_name, type_store
from e2efly.logs.scripts.ros_topics import TOPICS, Topic, Tree


def export_bag(log: FlightLog, path: str | Path, version: int) -> dict[str, int]:
    """Write a flight log as a bag. `log` is a log from `read_log`. `path` is a new file ending in `.bag` for ROS 1, or
    a new folder for ROS 2 (sqlite3 storage).

    Returns:
        Number of messages written, by topic.

    Raises:
        ValueError: for another version, a path that exists, or an ending that does not fit the version. Also for a log
            that has none of the channels of a bag or has a message that does not follow its schema, and if the package
            `rosbags` is missing.
    """
    if version not in (1, 2):
        raise ValueError(f"bag: version is {version!r}; accepted: 1 (ROS 1) or 2 (ROS 2)")
    path = Path(path)
    if path.exists():
        raise ValueError(f"bag: {str(path)!r} exists already; accepted: a path that is not there")
    if (path.suffix == ".bag") != (version == 1):
        wanted = "a file ending in .bag" if version == 1 else "a folder, whose name does not end in .bag"
        raise ValueError(f"bag: path is {str(path)!r}; accepted for ROS {version}: {wanted}")
    kept = [topic for topic in TOPICS if topic.channel in log.series]
    if not kept:
        channels = dict.fromkeys(topic.channel for topic in TOPICS)
        raise ValueError(f"bag: {log.path} has no message of {', '.join(channels)}")
    try:
        from rosbags.rosbag1 import Writer as Writer1
        from rosbags.rosbag2 import Writer as Writer2

        store = type_store(version)
    except ImportError as error:
        raise ValueError(
            f"bag: the package rosbags is missing ({error}); accepted: pip install 'e2efly[ros]'"
        ) from None
    rows = sorted(_rows(kept, log), key=lambda row: row[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        writer: Any = stack.enter_context(Writer1(path) if version == 1 else Writer2(path, version=8))
        connections = {t.name: writer.add_connection(t.name, full_name(t.kind), typestore=store) for t in kept}
        for stamp, topic, tree in rows:
            writer.write(connections[topic.name], stamp, encoded(store, version, topic.kind, tree))
    return {topic.name: sum(row[1] is topic for row in rows) for topic in kept}


def _rows(topics: list[Topic], log: FlightLog) -> Iterator[tuple[int, Topic, Tree]]:
    for topic in topics:
        series = log[topic.channel]
        for stamp, values in zip(series.stamp, series.values, strict=True):
            try:
                tree = topic.build(values, int(stamp))
            except (TypeError, ValueError) as error:
                raise ValueError(f"flight log: {topic.channel} has {values!r}: {error}") from None
            if tree is not None:
                yield int(stamp), topic, tree
