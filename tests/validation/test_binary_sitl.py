"""A SITL that the user built is asked what it is, kept, and flown from then on."""

from pathlib import Path

import pytest

from e2efly.commands.firmware import FirmwareOptions, run
from e2efly.validation import binary, firmware_program


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of its own with the packaged firmware in it."""
    program = firmware_program.build().program
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = firmware_program.firmware_folder()
    folder.mkdir(parents=True)
    (folder / "betaflight").symlink_to(program)
    return tmp_path


def test_it_is_flown_until_the_packaged_one_is_chosen_again(cache: Path, capsys: pytest.CaptureFixture) -> None:
    mine = cache / "my_SITL"
    mine.write_bytes(firmware_program.build().program.read_bytes())
    mine.chmod(0o755)
    assert run(FirmwareOptions(binary=mine)) == 0
    assert "Betaflight 4.6, MSP 1.47. An override that MSP has left is held" in capsys.readouterr().out
    kept = firmware_program.chosen()
    assert (kept.program, kept.release) == (binary.keep(mine).program, firmware_program.PACKAGED)
    assert kept.program.read_bytes() == mine.read_bytes() and kept.program != firmware_program.build().program
    mine.unlink()  # what is flown does not hang on where it was built
    assert firmware_program.chosen() == kept
    assert run(FirmwareOptions()) == 0
    assert firmware_program.chosen() == firmware_program.build()


def test_what_is_no_firmware_is_refused_and_the_choice_stays(cache: Path) -> None:
    with pytest.raises(ValueError, match=r"--binary is .*/none; accepted: a program"):
        run(FirmwareOptions(binary=cache / "none"))
    with pytest.raises(OSError, match="does not start"):
        run(FirmwareOptions(binary=Path("/bin/true")))
    with pytest.raises(ValueError, match="--archive and --binary are both given"):
        run(FirmwareOptions(cache / "a.tar.gz", Path("/bin/true")))
    assert firmware_program.chosen() == firmware_program.build()


def test_a_version_whose_packets_are_not_known_is_refused_by_name(cache: Path) -> None:
    (cache / binary.IDENTITY).write_text('{"api": [1, 44], "version": [4, 3, 2], "text": ""}')
    with pytest.raises(ValueError, match=r"SITL of Betaflight 4\.3 is not known; accepted: 4\.5 and later"):
        firmware_program.identified(cache)
    (cache / binary.IDENTITY).write_text('{"api": [1, 50], "version": [27, 6, 0], "text": "2027.6.0"}')
    with pytest.raises(ValueError, match=r"Betaflight 2027\.6\.0, MSP 1\.50; accepted"):
        firmware_program.identified(cache)


def test_one_that_feels_yaw_the_other_way_is_refused(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As one of the same version that was built for another simulator."""
    from dataclasses import replace

    packaged = firmware_program.build()
    assert packaged.release.sitl is not None
    mirrored = replace(packaged.release, sitl=replace(packaged.release.sitl, yaw_sign=1))
    monkeypatch.setattr(binary, "identified", lambda folder: replace(packaged, release=mirrored))
    with pytest.raises(ValueError, match=r"turned left at 1 rad/s it feels -1\.00; accepted: 1"):
        binary.keep(packaged.program)
