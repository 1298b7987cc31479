"""The page of the Python interface names what `import e2efly` offers, and nothing else as such."""

import importlib
import re

import e2efly
from tests.docs.pages import DOCS

PAGE = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")


def found(text: str) -> list[object]:
    """The objects that the page shows, each imported from where the page says."""
    places = (place.rpartition(".") for place in re.findall(r"^::: (\S+)$", text, re.MULTILINE))
    return [getattr(importlib.import_module(module), name) for module, _, name in places]


def test_the_page_and_the_package_offer_the_same() -> None:
    elsewhere = {"Plant", "RigidState"}  # the page says where
    offered = {name: getattr(e2efly, name) for name in e2efly.__all__ if name not in elsewhere}
    assert all(f"`e2efly.{name}`" in PAGE for name in elsewhere)
    face, _, others = PAGE.partition("## What they return")
    shown = found(face)
    assert [name for name, thing in offered.items() if thing not in shown] == []
    assert [thing for thing in shown if thing not in offered.values()] == []
    assert all(thing not in offered.values() for thing in found(others))


def test_nothing_else_shows_among_its_names() -> None:
    assert {name for name in dir(e2efly) if not name.startswith("_")} == set(e2efly.__all__)
