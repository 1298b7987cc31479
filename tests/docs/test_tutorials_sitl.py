"""The commands of the tutorials that fly the real firmware."""

from pathlib import Path

import pytest

from tests.docs.pages import TUTORIALS, blocks, needs_firmware, run_block

CODES = sorted({code for page in TUTORIALS for _, code in blocks(page) if needs_firmware(code)})


@pytest.mark.whole
@pytest.mark.parametrize("code", CODES)
def test_firmware_commands_of_a_tutorial(code: str, tmp_path: Path) -> None:
    done = run_block("sh", code, tmp_path)
    assert done.returncode == 0, f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


def test_there_are_some() -> None:
    assert CODES
