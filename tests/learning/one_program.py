"""Programs that several trainings of a test share, as compiling them takes most of its time."""

from typing import Any

import pytest

from e2efly.learning.programs import Programs


def compile_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs of a test that differ in numbers alone share the programs of the first."""
    compiled, programs = Programs.compile, []

    def first(*args: Any) -> Programs:
        if not programs:
            programs.append(compiled(*args))
        return programs[0]

    monkeypatch.setattr(Programs, "compile", staticmethod(first))
