"""The runner of the tutorials sees a command that fails."""

from pathlib import Path

from tests.docs.pages import blocks, run_block


def test_a_block_ends_at_its_first_command_that_fails(tmp_path: Path) -> None:
    done = run_block("sh", "false\ntouch reached\n", tmp_path)
    assert done.returncode != 0
    assert not (tmp_path / "reached").exists()
    assert run_block("python", "raise SystemExit(3)", tmp_path).returncode == 3


def test_an_unknown_option_in_a_tutorial_fails(tmp_path: Path) -> None:
    done = run_block("sh", "e2efly list --nothing\n", tmp_path)
    assert done.returncode != 0
    assert "--nothing" in done.stdout + done.stderr


def test_what_runs_in_the_process_of_the_tests_fails_as_it_would_in_its_own(tmp_path: Path) -> None:
    done = run_block("sh", "e2efly eval nobody\ntouch reached\n", tmp_path)
    assert done.returncode == 2
    assert "unknown policy 'nobody'" in done.stderr
    done = run_block("sh", "touch reached\ne2efly eval hover\n", tmp_path)
    assert done.returncode != 0  # a shell's command among those of e2efly
    done = run_block("python", "raise ValueError('why')", tmp_path)
    assert done.returncode == 1
    assert "ValueError: why" in done.stderr
    assert not (tmp_path / "reached").exists()


def test_blocks_of_a_page_come_in_order(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# T\n```sh\na\n```\n```console\n$ b\n```\n```python\nc\n```\n")
    assert blocks(page) == [("sh", "a\n"), ("python", "c\n")]
