"""Every command and every piece of Python on the pages of the tutorials runs, in the order of the page."""

from pathlib import Path

import pytest

from tests.docs.pages import TUTORIALS, blocks, needs_firmware, run_block

BLOCKS = [
    pytest.param(page, i, id=f"{page.stem}-{i}")
    for page in TUTORIALS
    for i, (_, code) in enumerate(blocks(page))
    if not needs_firmware(code)
]


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[Path, Path]:
    """Where each page's blocks run: what one writes the next ones read."""
    return {page: tmp_path_factory.mktemp(page.stem) for page in TUTORIALS}


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("page", "index"), BLOCKS)
def test_block_of_a_tutorial(page: Path, index: int, folders: dict[Path, Path]) -> None:
    language, code = blocks(page)[index]
    done = run_block(language, code, folders[page])
    assert done.returncode == 0, f"{code}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"


def test_the_tutorials_that_there_are() -> None:
    pages = {page.stem for page in TUTORIALS}
    assert pages >= {"install", "tour", "train", "own-vehicle", "identify", "see", "validate", "fly"}
    assert len(BLOCKS) >= 30
