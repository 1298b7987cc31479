"""TensorBoard events, written in the calling thread.

tensorboardX's `SummaryWriter` writes in its own thread. If the disk is full, that thread ends with a traceback, and the
next call that hands it an event waits for ever.
"""

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

_torch = sys.modules.get("torch")
sys.modules.setdefault("torch", None)  # type: ignore[arg-type]  # tensorboardX imports it where it is installed: 1.4 s
from tensorboardX.event_file_writer import EventsWriter  # noqa: E402
from tensorboardX.proto.event_pb2 import Event, SessionLog  # noqa: E402  # pyright: ignore[reportAttributeAccessIssue]
from tensorboardX.summary import scalar  # noqa: E402

if _torch is None:
    del sys.modules["torch"]


@contextmanager
def event_file(folder: Path, first: int) -> Iterator[Callable[[Mapping[str, float], int], None]]:
    """A new file of events.

    Args:
        folder: the folder of the file.
        first: step from which on the events of earlier files are no longer valid.

    Yields:
        A function that writes numbers by name, at a step.

    Raises:
        OSError: naming the folder, when it cannot be written.
    """
    writer: Any = None
    try:
        with _named(folder):
            folder.mkdir(parents=True, exist_ok=True)
            writer = EventsWriter(str(folder / "events"))
            begun = SessionLog(status=SessionLog.START)
            writer.write_event(Event(wall_time=time.time(), step=first, session_log=begun))

        def write(numbers: Mapping[str, float], step: int) -> None:
            with _named(folder):
                for name, value in numbers.items():
                    writer.write_event(Event(wall_time=time.time(), step=step, summary=scalar(name, value)))
                writer.flush()

        yield write
    finally:
        if writer is not None:
            with suppress(OSError):  # complete events are already written
                writer.close()


@contextmanager
def _named(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OSError(f"cannot write {folder}: {error.strerror}") from None
