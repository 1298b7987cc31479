"""Converts the trees of `ros_topics` to messages of the package `rosbags`, which does not need ROS."""

from __future__ import annotations

import importlib
from typing import Any

BASE, NAME, ARRAY = 1, 2, 3
"""Kinds of fields, in the numbering of rosbags. Any other number is a sequence."""


def type_store(version: int) -> Any:
    """The message types of ROS 1 or 2.

    Raises:
        ImportError: rosbags is not installed.
    """
    typesys = importlib.import_module("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if version == 1 else typesys.Stores.ROS2_HUMBLE)
    words = importlib.import_module("ros_topics" if __package__ in (None, "") else f"{__package__}.ros_topics")
    kind = full_name(words.TRANSFORMS_TYPE)
    if kind not in store.fielddefs:  # the store of ROS 1 does not have it
        own = words.TF_DEFINITION.partition("=")[0]
        store.register(typesys.get_types_from_msg(own, kind))
    return store


def full_name(kind: str) -> str:
    """The name of a message type in the form of ROS 2 and rosbags: nav_msgs/msg/Odometry."""
    return kind.replace("/", "/msg/")


def encoded(store: Any, version: int, kind: str, tree: dict[str, Any]) -> Any:
    """A message, serialized for ROS 1 or 2. `kind` is the name of its type in the form of ROS 1."""
    message = made(store, full_name(kind), tree)
    return (store.serialize_ros1 if version == 1 else store.serialize_cdr)(message, full_name(kind))


def made(store: Any, kind: str, tree: Any) -> Any:
    """A message of a type, made from a tree. A field that is not in the tree becomes zero, empty or false."""
    if kind == "builtin_interfaces/msg/Time":
        return store.types[kind](*divmod(int(tree or 0), 10**9))
    tree = tree or {}
    return store.types[kind](*(_field(store, form, tree.get(name)) for name, form in store.fielddefs[kind][1]))


def _field(store: Any, form: tuple[Any, Any], value: Any) -> Any:
    import numpy as np

    sort, detail = int(form[0]), form[1]
    if sort == BASE:
        return value if value is not None else {"string": "", "bool": False}.get(detail[0], 0)
    if sort == NAME:
        return made(store, detail, value)
    (inner, what), size = detail
    if int(inner) != BASE:
        return [made(store, what, entry) for entry in value or ()]
    if isinstance(value, bytes):
        return np.frombuffer(value, np.uint8)
    return np.zeros(size if sort == ARRAY else 0, what[0]) if value is None else np.asarray(value, what[0])
