"""Reading of TOML files that people write."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from e2efly.config.tables import number, numbers, read_table


def test_what_is_right_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("a = 1\nb = [1, 2.5]")
    table = read_table(tmp_path / "a.toml")
    assert number("a", table["a"]) == 1.0
    np.testing.assert_array_equal(numbers("b", table["b"], 2), [1.0, 2.5])


@pytest.mark.parametrize("value", [True, "1", float("nan"), float("inf"), [1], None, 1e308, -(10**400)])
def test_what_is_no_number_is_named(value: Any) -> None:
    with pytest.raises(ValueError, match=r"f: a is .*; accepted: a finite number of metres"):
        number("f: a", value, " of metres")
    with pytest.raises(ValueError, match=r"f: a is .*; accepted: 2 finite numbers"):
        numbers("f: a", [1.0, value], 2)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none.toml: No such file.*accepted: the path of a .toml file"):
        read_table(tmp_path / "none.toml")
    (tmp_path / "a.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match=r"a.toml: not a TOML file"):
        read_table(tmp_path / "a.toml")


def test_a_number_that_python_cannot_write_is_named() -> None:
    with pytest.raises(ValueError, match=r"f: a is a number too large to be shown; accepted: a finite number"):
        number("f: a", 16**5000)


@pytest.mark.parametrize("text", ["a = " + "[" * 100_000, "a = " + "{a=" * 50_000, "a = " + "9" * 5000, "a = \x00"])
def test_what_is_nested_too_deep_or_too_long_is_no_toml(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(ValueError, match=r"a.toml: not a TOML file: "):
        read_table(tmp_path / "a.toml")
