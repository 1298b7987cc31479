"""The kinds of pose sources, one file each, and the choice among them by a line of text."""

import importlib
import pkgutil
import re

from e2efly.deploy.pose.registry import SOURCES, Kind, opened
from e2efly.deploy.pose.source import PoseSource
from e2efly.registry import load, load_installed

for _file in pkgutil.iter_modules(__path__, f"{__name__}."):
    importlib.import_module(_file.name)

_REFERENCE = re.compile(r"(?P<reference>(?:.+\.py|[\w.]+):[A-Za-z_]\w*)(?::(?P<where>.*))?")


def open_source(text: str) -> PoseSource:
    """Open a pose source.

    Args:
        text: NAME:... of a registered kind (of an installed package, too), written as its form says; or the reference
            of a class or a function, path/to/file.py:Name or module:Name, and behind another colon what it is given.

    Raises:
        ValueError: naming the text and what is accepted; for a port that is taken or a host without an address; for a
            package that is not installed or a peer that does not answer, with what to do.
    """
    name, _, where = text.partition(":")
    if name not in SOURCES and name.isidentifier():
        load_installed()
    if name in SOURCES:
        return opened(SOURCES[name], text, where)
    if (found := _REFERENCE.fullmatch(text)) and ("." in name or ".py:" in text):
        own = load(found["reference"])
        known = next((kind for kind in SOURCES.values() if kind.open is own), Kind(own, f"{found['reference']}[:...]"))
        return opened(known, text, found["where"] or "")
    forms = "; ".join(kind.form for kind in SOURCES.values())
    raise ValueError(f"pose source is {text!r}; accepted: {forms}; or path/to/file.py:Name[:...]")
