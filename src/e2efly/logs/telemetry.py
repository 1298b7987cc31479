"""The flight log: MCAP, written by other threads than the control loop, so that neither the disk nor the data can
disturb it.

`Telemetry.record` puts a message into a queue. One thread turns the queue into chunks, one every `FLUSH_PERIOD`, and
hands each chunk as a whole to the operating system. Another thread asks it to write them to the disk. A killed process
leaves whole chunks. `e2efly.logs.flight_log` can read them, and so can every MCAP reader that reads in order.
"""

import math
import os
import threading
import time
from collections import Counter, deque
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from e2efly.logs.channels import CHANNELS
from e2efly.logs.mcap_file import McapFile, mcap_writer

FLUSH_PERIOD = 0.1
"""Seconds between two chunks. A process that dies loses at most this much, plus the time to write one chunk."""
SYNC_PERIOD = 1.0
"""Seconds between two requests to write the file to the disk. A power loss costs at most this much, plus the duration
of a request."""
QUEUE_SIZE = 20_000
"""The largest number of messages that wait: some 20 s of flight at 100 Hz."""
_SLICE = 8  # messages encoded without a pause: the longest time that the control loop waits for the interpreter
_KINDS_OF_PROBLEMS = 64  # any further kinds are counted together, so that nothing grows without limit in flight


class Telemetry:
    """A flight log that is being written. Every method may be called from any thread. Only the first one raises.

    Use it in a `with` block, or call `close`. A log that is not closed can be read too, without its last moments.
    """

    def __init__(self, path: str | Path, queue_size: int = QUEUE_SIZE) -> None:
        """Create the file and start writing. Its folder is created if necessary. Messages that come while `queue_size`
        messages wait are dropped and counted.

        Raises:
            ValueError: if the file exists already or cannot be created, or if the package `mcap` is missing.
        """
        mcap_writer()  # now rather than in flight
        self.path = Path(path)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        except OSError as error:
            if isinstance(error, FileExistsError) and self.path.exists():
                raise ValueError(f"flight log {str(path)!r} exists already; accepted: a new file") from None
            raise ValueError(f"flight log {str(path)!r} cannot be made: {error}") from None
        self._monotonic, self._wall = time.monotonic(), time.time_ns()
        self._queue: deque[tuple[str, float, int, dict[str, Any]]] = deque()
        self._queue_size = queue_size
        self._count = 0
        self._problems: Counter[str] = Counter()
        self._missing, self._missing_from, self._missing_to = 0, math.inf, -math.inf
        self._closing, self._synced = threading.Event(), threading.Event()
        self._unsynced = False
        self._writer = threading.Thread(target=self._write, name="telemetry", daemon=True)
        self._syncer = threading.Thread(target=self._sync, name="telemetry-sync", daemon=True)
        self._writer.start()
        self._syncer.start()

    def record(self, channel: str, time: float, values: Mapping[str, Any]) -> None:
        """Hand over a message. This takes some microseconds, whatever happens.

        Args:
            channel: a key of `e2efly.logs.channels.CHANNELS`.
            time: time of the message, s on this machine's monotonic clock (`time.monotonic`).
            values: values by field: numbers, lists or arrays of numbers, flags, texts, lists of texts, None. Lists and
                arrays are copied. A number that is not finite is written as null, because JSON does not have such
                numbers.
        """
        try:
            self._count += 1
            if self._closing.is_set():
                self._problem("closed: a message came after the end")
            elif len(self._queue) >= self._queue_size:
                self._problem("queue full: a message was dropped")
            else:
                copied = {key: _copied(value) for key, value in values.items()}
                self._queue.append((channel, time, self._count, copied))
        except Exception as error:
            self._problem(f"record: {type(error).__name__}")

    @property
    def problems(self) -> dict[str, int]:
        """The problems and how often they occurred. Empty if everything recorded is, or soon will be, in the file."""
        return dict(self._problems)

    @property
    def failed(self) -> bool:
        """Whether writing has ended early, as on a full disk. Nothing recorded since then is in the file."""
        return any(problem.startswith("disk") for problem in self.problems)

    @property
    def missing(self) -> str:
        """What a failed disk did not take, for people. Empty if it took everything."""
        if not self._missing:
            return ""
        first, last = (max(moment - self._monotonic, 0.0) for moment in (self._missing_from, self._missing_to))
        return f"{self._missing} messages from {first:.1f} s to {last:.1f} s after the start of the log are missing"

    def close(self, timeout: float = 5.0) -> None:
        """Write the waiting messages, the index and the end of the file. Gives up on a disk that hangs after `timeout`
        s.
        """
        self._closing.set()
        self._writer.join(timeout)
        self._syncer.join(timeout)
        if self._writer.is_alive() or self._syncer.is_alive():
            self._problem("disk: it did not take the end of the file in time")
        elif self._queue:  # these came during the writer's last write
            self._problems["closed: a message came after the end"] += len(self._queue)
            self._queue.clear()

    def __enter__(self) -> "Telemetry":
        """The log itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        self.close()

    def _problem(self, text: str) -> None:
        known = text in self._problems or len(self._problems) < _KINDS_OF_PROBLEMS
        self._problems[text if known else "other problems"] += 1

    def _log_time(self, monotonic: float) -> int:
        """Wall time at the start plus the monotonic time since then, ns. Setting the wall clock in flight does not
        change the order.
        """
        return max(self._wall + round((monotonic - self._monotonic) * 1e9), 0)

    def _write(self) -> None:
        """The writer's thread."""
        log = None
        try:
            log = McapFile(self._file)
            while True:
                last = self._closing.wait(FLUSH_PERIOD)  # first: no message may come afterwards
                self._drain(log)
                if last:
                    log.finish()
                    return
                log.flush()
                self._unsynced = True
        except OSError as error:
            reason = error.strerror or str(error)
            self._problem(f"disk: {reason}; the flight goes on without a log")
            self._swallow(log)
            self._say_what_is_missing(log, reason)
        except Exception as error:  # an error of ours must end here and not end the flight
            self._problem(f"disk: writer stopped by {type(error).__name__}: {error}")
            self._swallow(log)
        finally:
            self._synced.set()

    def _drain(self, log: "McapFile") -> None:
        began = time.monotonic()
        for i in range(len(self._queue)):
            if i % _SLICE == _SLICE - 1:
                time.sleep(0.0005)
                if time.monotonic() - began > FLUSH_PERIOD:  # many messages at once: write chunks of the usual length
                    log.flush()
                    began = time.monotonic()
            channel, when, number, values = self._queue.popleft()
            try:
                self._check(channel, values)
                log.add(channel, self._log_time(when), number, values)
                log.pending.append(when)
            except Exception as error:  # whatever it was given, the log goes on
                self._problem(f"{str(channel)[:40]}: not written: {type(error).__name__}: {str(error)[:80]}")

    def _check(self, channel: str, values: Mapping[str, Any]) -> None:
        if channel not in CHANNELS:
            raise ValueError(f"no such channel; accepted: {', '.join(CHANNELS)}")
        known = {field.name for field in CHANNELS[channel].fields}
        for name in values:
            if name not in known and channel != "meta":
                self._problem(f"{channel}: field {str(name)[:40]!r} is not in its schema")

    def _swallow(self, log: "McapFile | None") -> None:
        """Without a disk: empty the queue and count the lost messages, so that memory does not grow in flight."""
        for when in log.pending if log else ():
            self._lose(when)
        while True:
            last = self._closing.wait(FLUSH_PERIOD)
            while self._queue:
                self._lose(self._queue.popleft()[1])
                self._problem("not written: the disk had failed before")
            if last:
                return

    def _lose(self, when: float) -> None:
        self._missing += 1
        self._missing_from, self._missing_to = min(self._missing_from, when), max(self._missing_to, when)

    def _say_what_is_missing(self, log: "McapFile | None", reason: str) -> None:
        """Write an event that says what is missing at the end of the file, if necessary in place of its last blocks."""
        try:
            while log is not None:
                now = time.monotonic()
                text = f"flight log: {self.missing}: {reason}"
                if log.end_with(self._log_time(now), self._count + 1, {"level": "error", "text": text}):
                    return
                for when in log.give_up_block():
                    self._lose(when)
        except Exception as error:  # nothing more can be done
            self._problem(f"disk: {type(error).__name__}: the log does not say what is missing")

    def _sync(self) -> None:
        """The thread that waits for the disk, so that the writer need not."""
        try:
            ended = False
            while not ended:
                ended = self._synced.wait(SYNC_PERIOD)
                if self._unsynced or ended:
                    self._unsynced = False
                    os.fsync(self._file)
        except OSError as error:
            self._problem(f"sync: {error.strerror or error}")
        finally:
            self._synced.wait()
            os.close(self._file)


def _copied(value: Any) -> Any:
    """A copy of a list or an array, because its owner may change it before it is written."""
    if type(value) is list:
        return value[:]
    return value.copy() if isinstance(value, np.ndarray) else value
