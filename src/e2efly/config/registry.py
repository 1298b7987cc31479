"""Registries: objects of one kind by name, and users' own code by reference. Imports no JAX.

A reference is `path/to/file.py:Name` or `package.module:Name`. It is accepted wherever a name is. Installed packages
register through entry points, which are read when a name is unknown (`load_installed`).
"""

import hashlib
import importlib
import importlib.util
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, TypeVar

from e2efly.config.names import unknown

T = TypeVar("T")
F = TypeVar("F", bound=Callable[..., Any])
C = TypeVar("C", bound=type)
_REFERENCE = re.compile(r"(?P<reference>(?:.+\.py|[\w.]+):[A-Za-z_]\w*)(?::(?P<where>.*))?")


class Registry(Generic[T], Mapping[str, T]):
    """Objects of one kind by name, in the order in which they were registered."""

    def __init__(self, kind: str, source: Callable[[T], Any] = lambda thing: thing) -> None:
        self.kind = kind
        self._source = source  # gives the part of an object that has its origin
        self._known: dict[str, T] = {}

    def __getitem__(self, name: str) -> T:
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)

    def add(self, name: str, thing: T) -> T:
        """Register an object. Registering the same object twice has no effect.

        Raises:
            ValueError: for a name that is not a word, or is taken, naming the origins of both objects.
        """
        if not name.isidentifier():
            raise ValueError(f"{self.kind} {name!r} of {origin(thing)}; accepted: a name of letters, digits and _")
        new, known = (origin(self._source(t)) for t in (thing, self._known.get(name, thing)))
        if known != new:
            raise ValueError(f"{self.kind} {name!r} of {new} is also the name of {known}; accepted: another name")
        self._known[name] = thing
        return thing

    def adding(self, name: str, made: Callable[[F], T]) -> Callable[[F], F]:
        """A decorator that registers, under a name, what `made` gives for the decorated function or class."""

        def registered(thing: F) -> F:
            self.add(name, made(thing))
            return thing

        return registered

    def extending(self, base: type, name: str) -> Callable[[C], C]:
        """A decorator that registers a complete subclass of `base` under a name, and gives it this name as `name`.

        The decorator raises a ValueError for any other object, naming its origin and what it lacks.
        """
        needed = ", ".join(sorted(getattr(base, "__abstractmethods__", ())))
        accepted = f"accepted: a class that extends {origin(base)}" + (f" and has {needed}" if needed else "")

        def checked(kind: Any) -> Any:
            if not (isinstance(kind, type) and issubclass(kind, base)):
                raise ValueError(f"{self.kind} {name!r} is {origin(kind)}; {accepted}")
            if missing := sorted(getattr(kind, "__abstractmethods__", ())):
                raise ValueError(f"{self.kind} {name!r} of {origin(kind)} lacks {', '.join(missing)}; {accepted}")
            kind.name = name  # type: ignore[attr-defined]
            return kind

        return self.adding(name, checked)

    def find(self, name: str) -> T:
        """The object for a name or a reference.

        Raises:
            ValueError: for an unknown name, with the nearest one and all names; or for a reference that does not lead
                to a registered object, naming file and name.
        """
        if name not in self._known and ":" not in name:
            load_installed()
        if name in self._known:
            return self._known[name]
        if ":" not in name:
            raise ValueError(unknown(self.kind, name, self._known) + ", or path/to/file.py:Name, or module:Name")
        whole = absolute(name)
        if (here := next((t for t in self._known.values() if origin(self._source(t)) == whole), None)) is not None:
            return here
        thing = load(name)
        found = next((t for t in self._known.values() if thing is t or thing is self._source(t)), None)
        if found is None:
            raise ValueError(f"{name} is {thing!r}; accepted: what its file registers as {self.kind}")
        return found

    def reference(self, thing: T) -> str:
        """The text with which `find` finds an object in another process.

        It is the object's name if the package ships the object, otherwise its reference.

        Raises:
            ValueError: when the object is not registered.
        """
        name = next((name for name, known in self._known.items() if known is thing), None)
        if name is None:
            raise ValueError(f"{origin(thing)} is no registered {self.kind}; accepted: {', '.join(self._known)}")
        return name if is_shipped(thing) else origin(thing)


def absolute(name: str) -> str:
    """A name, or a reference whose file is found from every folder."""
    where, _, attribute = name.rpartition(":")
    return f"{Path(where).expanduser().absolute()}:{attribute}" if where.endswith(".py") else name


def load_installed() -> None:
    """Import the modules that installed packages register by their entry points of the group `e2efly`.

    Raises:
        ValueError: naming the package and the entry point, if its module cannot be imported.
    """
    for point in metadata.entry_points(group="e2efly"):
        where = f"entry point {point.name} = {point.value} of the package {point.dist.name if point.dist else '?'}"
        _imported(where, partial(importlib.import_module, point.module))


def load(reference: str) -> Any:
    """The object that `path/to/file.py:Name` or `package.module:Name` names. A file is imported once.

    Raises:
        ValueError: when the file or the module is missing, cannot be imported or has no such name.
    """
    where, _, name = reference.rpartition(":")
    if not where or not name:
        raise ValueError(f"reference is {reference!r}; accepted: path/to/file.py:Name or package.module:Name")
    module = _file(Path(where)) if where.endswith(".py") else _imported(where, lambda: importlib.import_module(where))
    try:
        return getattr(module, name)
    except AttributeError:
        if module.__name__ in _BEGUN:
            raise ValueError(f"{where} has no {name} yet: it imports itself") from None
        names = sorted(n for n, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__)
        raise ValueError(unknown(f"name in {where}", name, names)) from None


def referenced(text: str) -> tuple[str, str] | None:
    """A reference and the text after another colon, `path/to/file.py:Name:TEXT`. None: the text is not a reference."""
    found = _REFERENCE.fullmatch(text)
    if found is None or not ("." in text.partition(":")[0] or ".py:" in text):
        return None
    return found["reference"], found["where"] or ""


def check_methods(thing: Any, methods: Sequence[str]) -> None:
    """Refuse an object that lacks a method.

    Raises:
        ValueError: naming its origin, what it lacks and what it must have.
    """
    if lacking := [name for name in methods if not hasattr(thing, name)]:
        of = origin(thing if isinstance(thing, type) else type(thing))
        raise ValueError(f"{of} has no {', '.join(lacking)}; accepted: all of {', '.join(methods)}")


def origin(thing: Any) -> str:
    """The reference of an object: with its file if it was given as a file, otherwise with its module."""
    module = sys.modules.get(getattr(thing, "__module__", ""))
    name = getattr(thing, "__qualname__", repr(thing))
    if module is None:
        return name
    file = getattr(module, "__file__", None)
    of_file = module.__name__ == "__main__" or module.__name__.startswith(_OF_FILES)
    return f"{Path(file).absolute()}:{name}" if of_file and file else f"{module.__name__}:{name}"


def is_shipped(thing: Any) -> bool:
    """Whether an object is part of the package."""
    return str(getattr(thing, "__module__", "")).split(".")[0] == __name__.split(".")[0]


_OF_FILES = "e2efly_file_"
"""Beginning of the names of modules that are imported from files."""
_BEGUN: set[str] = set()
"""Files whose import has begun but not ended."""


def _file(path: Path) -> ModuleType:
    path = path.expanduser().absolute()
    if not path.is_file():
        raise ValueError(f"there is no file {path}")
    name = _OF_FILES + hashlib.sha256(str(path).encode()).hexdigest()[:16]
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)

    def run() -> ModuleType:
        sys.modules[name] = module
        _BEGUN.add(name)
        try:
            spec.loader.exec_module(module)  # type: ignore[union-attr]
        except BaseException:
            del sys.modules[name]
            raise
        finally:
            _BEGUN.discard(name)
        return module

    return _imported(str(path), run)


def _imported(where: str, run: Callable[[], ModuleType]) -> ModuleType:
    try:
        return run()
    except ValueError:
        raise
    except Exception as error:  # any error of the user's code
        raise ValueError(f"{where} cannot be imported: {type(error).__name__}: {error}") from error
