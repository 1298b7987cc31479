"""What people see of a training's progress: on terminals of any width, and in a pipe."""

import io

import pytest
from rich.console import Console
from rich.table import Table

from e2efly.commands import terminal
from e2efly.commands.terminal import Terminal, TerminalProgress, console_table, counted, doing


def shown(width: int, terminal: bool) -> str:
    """All that a training of two evaluations prints."""
    out = io.StringIO()
    console = Console(file=out, width=width, force_terminal=terminal, color_system=None, markup=False, soft_wrap=True)
    with TerminalProgress(console, "race_clutter by bptt") as progress:
        progress.compiling()
        progress.progress(500_000, 1_000_000, 1.2e5, 0.5, 0.5, "vehicle of the file, stage 1 of 2")
        progress.progress(1_000_000, 1_000_000, 1.2e5, 0.98, 0.98, "vehicle of the file, stage 2 of 2")
        progress._bar.refresh()  # else what comes next is drawn in its place
        progress.judging(1000)
    return out.getvalue()


@pytest.mark.parametrize("width", [80, 149, 150, 200])
def test_the_time_left_is_seen_on_every_terminal(width: int) -> None:
    lines = shown(width, terminal=True).replace("\r", "\n").splitlines()
    assert any("left" in line and "race_clutter" in line for line in lines)
    assert any("98" in line and "vehicle of the file, stage 2 of 2" in line for line in lines)
    assert "…" not in "".join(lines)  # nothing was cut


def test_a_pipe_gets_lines() -> None:
    lines = shown(80, terminal=False).splitlines()
    assert lines[0] == "race_clutter by bptt: compiling (seconds; cached for the next run)"
    assert "success 98.0%, best 98.0% (vehicle of the file, stage 2 of 2)" in lines[2]
    assert lines[2].endswith(" 0 s left")
    assert lines[3] == "race_clutter by bptt: flying 1000 starts that it never saw"


def test_no_table_is_cut(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    row = {"policy": "hover, best, vehicle of the file", **{f"column {i}": "100.0%" for i in range(12)}}
    Terminal().print(console_table([row]))
    assert [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()] == [
        " ".join(row), " ".join(row.values())
    ]  # fmt: skip
    for option in ("FORCE_COLOR", "TTY_COMPATIBLE"):  # makes rich take a pipe for a terminal
        monkeypatch.setenv(option, "1")
        monkeypatch.setenv("COLUMNS", "60")
        Terminal().print(console_table([row]))
        assert len(capsys.readouterr().out.splitlines()) == 2
    narrow = Terminal()
    narrow.width = 80
    narrow.print(Table(*row, *row))
    assert "…" not in capsys.readouterr().out


def test_what_was_compiled_says_nothing_about_the_time_left(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A minute of compilation, and then a million steps a second."""
    clock = iter([100.0, 106.0, 112.0])
    monkeypatch.setattr("e2efly.commands.terminal.time.monotonic", lambda: next(clock))
    told = TerminalProgress(Terminal(), "hover")
    for steps in (0, 6_000_000, 12_000_000):
        told.progress(steps, 20_000_000, 1e6, 0.5, 0.5, "hover")
    lines = capsys.readouterr().out.splitlines()
    assert "left" not in lines[0] and lines[1].endswith("  14 s left") and lines[2].endswith("  8 s left")


def test_what_takes_long_says_in_a_pipe_what_it_does_and_how_long_it_still_takes(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter([0.0, *(10.0 + 2.0 * k for k in range(6))])  # the first takes longer, as it is compiled
    monkeypatch.setattr(terminal.time, "monotonic", lambda: next(clock, 99.0))
    console = Terminal()
    with doing(console, "Planning"):
        pass
    assert list(counted(console, "Filming", "abcdef", 6)) == list("abcdef")
    lines = ["Planning", "Filming: 2 of 6, 8 s left", "Filming: 5 of 6, 2 s left", "Filming: 6 of 6, 0 s left"]
    assert capsys.readouterr().out.splitlines() == lines
