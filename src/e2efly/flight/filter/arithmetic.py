"""Functions of numbers under NumPy's names, so that one formula works for one vehicle in flight and for thousands in a
study.

NumPy takes about a microsecond for a function of a single number. The standard library takes a twentieth of that.
"""

import math
from typing import Any

Number = Any
"""A float, or an array of the batch's shape."""


class Scalars:
    """NumPy's functions for floats."""

    sqrt = staticmethod(math.sqrt)
    sin = staticmethod(math.sin)
    cos = staticmethod(math.cos)
    arctan2 = staticmethod(math.atan2)

    @staticmethod
    def maximum(a: float, b: float) -> float:
        """The larger one."""
        return a if a > b else b

    @staticmethod
    def minimum(a: float, b: float) -> float:
        """The smaller one."""
        return a if a < b else b

    @staticmethod
    def where(condition: bool, a: float, b: float) -> float:
        """The first value if the condition holds, otherwise the second."""
        return a if condition else b


SCALARS = Scalars()


def clip(xp: Any, x: Number, low: Number, high: Number) -> Number:
    """The number within bounds."""
    return xp.minimum(xp.maximum(x, low), high)
