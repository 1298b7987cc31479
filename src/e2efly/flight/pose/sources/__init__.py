"""The kinds of pose sources, one file each, and how a line of text selects one."""

import importlib
import pkgutil

from e2efly.flight.pose.pose_source import PoseSource
from e2efly.flight.pose.registry import SOURCES, opened, selected

for _file in pkgutil.iter_modules(__path__, f"{__name__}."):
    importlib.import_module(_file.name)


def open_source(text: str) -> PoseSource:
    """Open a pose source: NAME:... of a registered kind, also of an installed package, written as its form says. Or a
    reference to a class or a function, path/to/file.py:Name or module:Name, optionally followed by another colon and
    the text that it is given.

    Raises:
        ValueError: naming the text and what is accepted. Also for a port that is taken or a host without an address.
            For a package that is not installed or a peer that does not answer, it says what to do.
    """
    if chosen := selected(SOURCES, text):
        kind, where = chosen
        return opened(kind, text, where)
    forms = "; ".join(kind.form for kind in SOURCES.values())
    raise ValueError(f"pose source is {text!r}; accepted: {forms}; or path/to/file.py:Name[:...]")
