"""The operator's terminal: hostile texts, streams that fail, signals."""

import io
import os
import pty
import signal
import subprocess
import sys
from collections.abc import Callable

import pytest

from e2efly.commands.terminal import Terminal, console_table
from e2efly.flight.operator import LANDING, Speaker, Stop
from e2efly.flight.process import printable

FORGED = "\x1b[2K\rPOLICY: all is well\n\ud800\u202e"


def spoken(stream: io.TextIOBase, *lines: str) -> None:
    say = Speaker(stream)  # type: ignore[arg-type]
    for line in lines:
        say(line)
    say.close()


def test_a_text_from_outside_stays_on_its_line_and_does_nothing() -> None:
    assert printable(FORGED) == r"\x1b[2K\rPOLICY: all is well\n\ud800\u202e"
    assert printable("Größe [bold] 3.5 m") == "Größe [bold] 3.5 m"


def test_no_command_sends_escape_sequences_of_its_texts(capsys: pytest.CaptureFixture[str]) -> None:
    Terminal().print(FORGED[:-2])
    Terminal().print(console_table([{"name": "\x1b]0;title[red]"}]))
    shown = capsys.readouterr().out
    assert "\x1b" not in shown
    assert r"\x1b[2K" in shown
    assert r"\x1b]0;" in shown  # cut to the width that it would have had


@pytest.mark.parametrize("encoding", ["utf-8", "ascii", "latin-1"])
def test_what_a_terminal_cannot_show_is_escaped_and_the_next_line_comes(encoding: str) -> None:
    bytes_out = io.BytesIO()
    stream = io.TextIOWrapper(bytes_out, encoding)
    spoken(stream, FORGED.replace("\n", ""), "Größe 😀", "next")
    first, second, third = bytes_out.getvalue().decode(encoding).splitlines()
    assert r"\x1b[2K\rPOLICY: all is well\ud800\u202e" in first
    assert ("Größe" in second) == (encoding != "ascii")
    assert third.endswith("  next")


def test_a_stream_that_fails_for_a_while_loses_lines_not_the_speaker() -> None:
    class Failing(io.StringIO):
        tries = 0

        def write(self, text: str) -> int:
            self.tries += 1
            if self.tries < 3:
                raise BrokenPipeError if self.tries == 1 else RuntimeError("of another kind")
            return super().write(text)

    stream = Failing()
    spoken(stream, "one", "two", "three")
    assert stream.getvalue().endswith("  three\n")


def test_every_signal_asks_for_a_landing_and_is_given_back() -> None:
    before = [signal.getsignal(number) for number in LANDING]
    for number in LANDING:
        stop = Stop()
        assert not stop()
        signal.raise_signal(number)
        assert stop()
        stop.restore()
    assert [signal.getsignal(number) for number in LANDING] == before
    assert {signal.SIGINT, signal.SIGTERM, signal.SIGHUP} <= set(LANDING)


def test_a_hang_up_that_is_ignored_already_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        stop = Stop()
        signal.raise_signal(signal.SIGHUP)
        assert not stop()
        stop.restore()
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def _terminal() -> tuple[int, Callable[[], None]]:
    """A terminal whose connection ends."""
    ours, theirs = pty.openpty()
    return theirs, lambda: os.close(ours)


def _pipe() -> tuple[int, Callable[[], None]]:
    """A pipe that nobody reads any more."""
    ours, theirs = os.pipe()
    return theirs, lambda: os.close(ours)


@pytest.mark.parametrize("made", [_terminal, _pipe])
def test_a_process_whose_terminal_is_gone_ends_as_it_wants_to(made: Callable) -> None:
    code = (
        "import sys; from e2efly.flight.operator import Speaker\n"
        "say = Speaker(sys.stdout)\n"
        "say.write('ready'); sys.stdin.readline()\n"
        "for _ in range(3): say('status')\n"
        "say.write('the end'); say.close()\n"
        "sys.stderr.write('landed'); sys.exit(0)\n"
    )
    output, end = made()
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=output, stderr=subprocess.PIPE, text=True
    )
    os.close(output)
    end()
    assert process.communicate("go\n", timeout=30)[1] == "landed"
    assert process.returncode == 0
