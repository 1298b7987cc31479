"""Files that survive a crash: complete writes, JSON without NaN, folders with only one writing process at a time."""

import io
import json
import math
import os
import reprlib
import socket
import struct
import sys
import tokenize
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

LOCK = ".lock"
"""Name of the file in a folder that tells who writes to it. Only the kernel's lock on this file counts."""


def cache_folder() -> Path:
    """The user's cache folder of this package."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "e2efly"


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file so that it is complete at any moment: either the old or the new one.

    Raises:
        OSError: naming the path, when the folder cannot be written or is full.
    """
    part = path.with_name(f"{path.name}.{os.getpid()}.part")  # other processes may write the same file
    try:
        with part.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise OSError(f"cannot write {path}: {error.strerror}") from error


def write_json(path: Path, content: Any, indent: int | None = 1) -> None:
    """Write a JSON file atomically, with null for numbers that JSON does not have (NaN and infinities).

    Raises:
        OSError: naming the path, when the folder cannot be written or is full.
    """
    write_atomically(path, (json.dumps(finite(content), indent=indent, allow_nan=False) + "\n").encode())


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file.

    Raises:
        ValueError: when the file is missing, is not JSON, or contains something other than an object.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise ValueError(f"{path} cannot be read: {error}") from None
    except RecursionError:
        raise ValueError(f"{path} cannot be read: it is nested too deeply") from None
    if not isinstance(found, dict):
        raise ValueError(f"{path} is {reprlib.repr(found)}; accepted: an object")
    return found


def read_npz(path: Path, most: int) -> dict[str, np.ndarray]:
    """The arrays of an .npz file, by name.

    Args:
        path: the file.
        most: the largest number of bytes that all arrays together may have.

    Raises:
        ValueError: without the file's name, for another file, a damaged one, one that unpacks to more than `most`
            bytes, and one that holds objects.
    """
    try:
        if not path.is_file():
            raise ValueError("it is no file")
        with zipfile.ZipFile(path) as archive:
            if (size := sum(entry.file_size for entry in archive.infolist())) > most:
                raise ValueError(f"it unpacks to {size} bytes; accepted: at most {most}")
            return {name.removesuffix(".npy"): array_of(archive.read(name)) for name in archive.namelist()}
    except (
        OSError,
        EOFError,
        RuntimeError,
        NotImplementedError,
        struct.error,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise ValueError(str(error)) from None


def array_of(data: bytes) -> np.ndarray:
    """The array in the content of an .npy file.

    Raises:
        ValueError: for other content, objects, and another size than the header says.
    """
    file = io.BytesIO(data)
    if np.lib.format.read_magic(file) != (1, 0):
        raise ValueError("it is of another version of .npy; accepted: 1.0, as np.save writes it")
    try:
        shape, by_columns, kind = np.lib.format.read_array_header_1_0(file)
    except (SyntaxError, TypeError, MemoryError, RecursionError, tokenize.TokenError) as error:
        raise ValueError(f"its header is {error}") from None
    return np.frombuffer(data, kind, offset=file.tell()).reshape(shape, order="F" if by_columns else "C")


def finite(value: Any) -> Any:
    """A JSON tree with None for every number that is not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [finite(entry) for entry in value]
    return value


def make_folder(folder: Path, what: str = "--out") -> None:
    """Make a folder and those above it, if it does not exist.

    Raises:
        OSError: when the folder cannot be made. `what` names it in the error text.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"cannot make {what} {folder}: {error.strerror}") from error


@contextmanager
def held(folder: Path, option: str = "--out") -> Iterator[None]:
    """Keep other processes from writing to a folder. The folder is made if it does not exist.

    The kernel releases the lock when the process ends, however it ends. So no lock outlives its process. What a killed
    process had not finished writing is removed.

    Args:
        folder: the folder to lock.
        option: the option that names the folder, for the error text.

    Raises:
        ValueError: when another process holds it, naming the process, the host and the time since when.
        OSError: when the folder cannot be made, or its file system has no locks.
    """
    anew = not folder.exists()
    make_folder(folder, option)
    path = folder / LOCK
    try:
        file = _locked(path)
    except BlockingIOError:
        raise ValueError(
            f"{option} {folder} is in use by {_holder(path)}; accepted: another folder, or this one when that process "
            "has ended"
        ) from None
    except OSError as error:
        raise OSError(f"cannot lock {option} {folder}: {error.strerror}") from error
    for part in folder.glob("*.part"):
        if not _runs(part.suffixes[-2][1:] if len(part.suffixes) > 1 else ""):
            part.unlink(missing_ok=True)
    now = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    about = json.dumps({"process": os.getpid(), "host": socket.gethostname(), "since": now})
    try:
        with suppress(OSError):  # on a full disk it gives no details, but the lock still holds
            os.ftruncate(file, 0)
            os.lseek(file, 0, os.SEEK_SET)
            os.write(file, about.encode())
        yield
    finally:
        _unlock(file, path)
        if anew:
            with suppress(OSError):  # the folder is not empty
                folder.rmdir()


def _runs(process: str) -> bool:
    """Whether a process of this number runs on this machine. Windows is not asked: there, every one may run."""
    if sys.platform == "win32":  # signal 0 would be Ctrl-C
        return True
    try:
        os.kill(int(process), 0)
    except (ValueError, ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def _locked(path: Path) -> int:
    """A descriptor of the file, with the lock on it."""
    while True:
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(file)
            if path.exists() and os.path.samestat(os.fstat(file), path.stat()):
                return file
        except OSError:
            os.close(file)
            raise
        os.close(file)  # of a file that its last holder has removed meanwhile


_LOCKED = 2**30
"""The byte that is locked on Windows, far behind the text: others may read what is not locked."""


def _lock(file: int) -> None:
    """Lock an open file, or raise `BlockingIOError`."""
    if sys.platform == "win32":
        import msvcrt

        os.lseek(file, _LOCKED, os.SEEK_SET)
        try:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
        except PermissionError as error:
            raise BlockingIOError(str(error)) from None
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _unlock(file: int, path: Path) -> None:
    if sys.platform == "win32":  # there, an open file cannot be removed: one that another process has opened stays
        os.close(file)
        with suppress(OSError):
            path.unlink()
    else:  # an unlocked file may already be another process's
        path.unlink(missing_ok=True)
        os.close(file)


def _holder(path: Path) -> str:
    """The holder of a lock, as far as its file tells."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        return f"process {content['process']} on {content['host']} since {content['since']}"
    except (OSError, ValueError, TypeError, KeyError):
        return "another process"


def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object in which every key occurs once."""
    content: dict[str, Any] = {}
    for key, value in pairs:
        if key in content:
            raise ValueError(f"key {key[:80]!r} is there twice")
        content[key] = value
    return content
