"""The table of whole flights, as a terminal of 80 columns shows it."""

import math
from dataclasses import replace

import pytest
from rich.console import Console

from e2efly.commands.rehearsals import flights_table
from e2efly.validation.bridge_session import FlownSession
from e2efly.validation.rehearsal import Rehearsal

MODES = ("init", "takeoff", "hover", "policy", "hover", "land", "done", "init")
REASONS = ("", "mission switch", "reached its height", "mission switch", "mission switch", "mission switch",
           "landed: the ground is felt", "disarmed")  # fmt: skip
WHOLE = Rehearsal(
    modes=MODES, reasons=REASONS, complete=True, hover_error=0.0312, done=True, success=True, mean_error=0.02,
    final_error=0.123, top_speed=11.25, told="touched 12.3 cm off at 0.55 m/s",
    flown=FlownSession(),
)  # fmt: skip
CUT = ("settings: feature AIRMODE is off; needed: on: torque goes before thrust at any throttle (feature AIRMODE); "
       "no good odometry: nothing has come for 0.31 s")  # fmt: skip


def shown(flights: list[Rehearsal], capsys: pytest.CaptureFixture[str]) -> list[str]:
    Console(width=80).print(flights_table(flights))
    return capsys.readouterr().out.splitlines()


def test_a_complete_flight_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    lines = shown([WHOLE] * 12, capsys)
    assert [line.rstrip() for line in lines[:2]] == [
        "whole flight  complete  hover error  policy                           top speed",
        "1             yes       3.1 cm       touched 12.3 cm off at 0.55 m/s  11.2 m/s",
    ]
    assert len(lines) == 13


def test_a_flight_that_was_cut_tells_its_modes_and_why_each_began(capsys: pytest.CaptureFixture[str]) -> None:
    cut = replace(WHOLE, complete=False, modes=MODES[:3], reasons=(*REASONS[:2], CUT), hover_error=math.nan)
    lines = shown([WHOLE, cut, WHOLE], capsys)
    assert max(map(len, lines)) <= 80
    assert lines[2].split()[:3] == ["2", "no", "none"]
    at = lines.index("flight 2 was not complete; its modes, and why each began:")
    assert lines[at + 1].split() == ["init"]
    assert lines[at + 2].split() == ["takeoff", "mission", "switch"]
    assert lines[at + 3].split()[:3] == ["hover", "settings:", "feature"]
    assert " ".join(" ".join(lines[at + 3 :]).split()) == f"hover {CUT}"
