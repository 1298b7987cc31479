"""Trees of `ros_topics` as messages of the package `rosbags`, which needs no ROS."""

from __future__ import annotations

import importlib
from typing import Any

BASE, NAME, ARRAY = 1, 2, 3
"""Kinds of fields, as rosbags numbers them; what is left is a sequence."""


def type_store(version: int) -> Any:
    """The message types of ROS 1 or 2.

    Raises:
        ImportError: where rosbags is not there.
    """
    typesys = importlib.import_module("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if version == 1 else typesys.Stores.ROS2_HUMBLE)
    words = importlib.import_module("ros_topics" if __package__ in (None, "") else f"{__package__}.ros_topics")
    kind = full_name(words.TRANSFORMS_TYPE)
    if kind not in store.fielddefs:  # ROS 1's has it not
        own = words.TF_DEFINITION.partition("=")[0]
        store.register(typesys.get_types_from_msg(own, kind))
    return store


def full_name(kind: str) -> str:
    """A message type as ROS 2 and rosbags write it: nav_msgs/msg/Odometry."""
    return kind.replace("/", "/msg/")


def encoded(store: Any, version: int, kind: str, tree: dict[str, Any]) -> Any:
    """A message, serialized for ROS 1 or 2; `kind` as ROS 1 writes it."""
    message = made(store, full_name(kind), tree)
    return (store.serialize_ros1 if version == 1 else store.serialize_cdr)(message, full_name(kind))


def made(store: Any, kind: str, tree: Any) -> Any:
    """A message of a type from a tree; what the tree lacks is zero, empty or false."""
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
