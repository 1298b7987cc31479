"""TensorBoard's events as its reader finds them, and on a disk without room."""

import struct
import subprocess
import sys
from pathlib import Path

import pytest
from tensorboardX.proto.event_pb2 import Event

from e2efly.learning.events import event_file


def events_of(folder: Path) -> list[Event]:
    """The events of the only file: records of a length, its checksum, the event, and its checksum."""
    (file,) = folder.iterdir()
    data, found = file.read_bytes(), []
    while data:
        size = struct.unpack("<Q", data[:8])[0]
        found.append(Event.FromString(data[12 : 12 + size]))
        data = data[16 + size :]
    return found


def test_what_is_written_is_there_at_once(tmp_path: Path) -> None:
    with event_file(tmp_path / "events", 40) as write:
        write({"update": 60, "eval/hover/success": 0.5}, 60)
        _, begun, *numbers = events_of(tmp_path / "events")
    assert (begun.step, begun.session_log.status) == (40, 1)
    assert [(e.step, e.summary.value[0].tag, e.summary.value[0].simple_value) for e in numbers] == [
        (60, "update", 60.0), (60, "eval/hover/success", 0.5)
    ]  # fmt: skip


def test_a_disk_without_room_is_named_and_nobody_waits(tmp_path: Path) -> None:
    """A limit of a file's size stands for a full disk."""
    code = (
        "import resource\n"
        "from pathlib import Path\n"
        "from e2efly.learning.events import event_file\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        "try:\n"
        f"    with event_file(Path({str(tmp_path / 'events')!r}), 0) as write:\n"
        "        for i in range(1000):\n"
        "            write({'reward': 1.0}, i)\n"
        "except OSError as error:\n"
        "    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == f"cannot write {tmp_path / 'events'}: File too large\n"
    assert done.stderr == ""


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(OSError, match=r"cannot write .*file/events: Not a directory"),
        event_file(tmp_path / "file/events", 0),
    ):
        pass


def test_writing_events_loads_no_torch_and_leaves_it_to_others() -> None:
    """It takes seconds, and every training would wait for them."""
    code = (
        "import sys\n"
        "import e2efly.learning.events\n"
        "print('torch' in sys.modules)\n"
        "import torch\n"
        "print(float(torch.ones(1)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "False\n1.0\n"
