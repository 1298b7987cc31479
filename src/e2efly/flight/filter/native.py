"""The filter's formulas as machine code, so that a call takes a fraction of Python's time.

The formulas stand in Python alone. They are computed once with symbols in place of numbers, and each operation on a
symbol writes a line of C. The C compiler of the machine makes a library of it when a flight begins.
"""

import ctypes
import math
import shutil
import subprocess
import tempfile
from array import array
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from e2efly.flight.filter.backup import Backup
from e2efly.flight.filter.forecast import (
    ForecastCommand,
    ForecastMotion,
    GyroReading,
    Residual,
    ResponseStep,
    Stretch,
    measured,
    moved,
)
from e2efly.flight.filter.judgement import judged
from e2efly.flight.filter.margins import MarginLimits
from e2efly.flight.filter.obstacle import Plane

SOLIDS = 8
"""The compiled formula knows so many sides of solids. With more of them near, Python computes."""
FAR = Plane(0.0, 0.0, 0.0, 1e9, "")
"""A side that no manoeuvre reaches."""
COMPILER, LONGEST = "cc", 60.0
"""The C compiler, and how long it may take, s."""
OPTIONS = ("-O1", "-ffp-contract=off", "-shared", "-fPIC")
"""No product and sum become one operation, so that the results are Python's to the last bit."""


def _operation(form: str) -> Callable[..., "Symbol"]:
    """A method that writes an operation on numbers. Its object is a symbol, the first of them, or the function."""

    def written(self: Any, *of: Any) -> "Symbol":
        return self.function.put(form, *((self, *of) if isinstance(self, Symbol) else of))

    return written


class Symbol:
    """A number of the function."""

    __slots__ = ("function", "name")

    def __init__(self, function: "TracedFunction", name: str) -> None:
        """A number with a name in C."""
        self.function, self.name = function, name

    def __bool__(self) -> bool:
        """A branch would be taken once and for all.

        Raises:
            TypeError: always.
        """
        raise TypeError("a condition on a symbol; accepted: the function `where`")

    __add__, __radd__ = _operation("{} + {}"), _operation("{1} + {0}")
    __sub__, __rsub__ = _operation("{} - {}"), _operation("{1} - {0}")
    __mul__, __rmul__ = _operation("{} * {}"), _operation("{1} * {0}")
    __truediv__, __rtruediv__ = _operation("{} / {}"), _operation("{1} / {0}")
    __lt__, __gt__ = _operation("{} < {}"), _operation("{} > {}")
    __le__, __ge__ = _operation("{} <= {}"), _operation("{} >= {}")
    __eq__, __ne__ = _operation("{} == {}"), _operation("{} != {}")  # type: ignore[assignment]
    __hash__ = None  # type: ignore[assignment]
    __and__, __neg__, __abs__ = _operation("{} && {}"), _operation("-{}"), _operation("fabs({})")


class TracedFunction:
    """A function in C, written operation by operation. It has the functions of `arithmetic.Scalars`, for symbols. A
    condition is 1.0 or 0.0.
    """

    def __init__(self, name: str, inputs: int) -> None:
        """A function of so many numbers."""
        self.function, self.name, self.lines = self, name, list[str]()
        self.inputs = [self.put(f"in[{i}]") for i in range(inputs)]

    def put(self, form: str, *of: Any) -> Symbol:
        """The result of an operation."""
        name = f"v{len(self.lines)}"
        self.lines.append(f"const double {name} = {form.format(*map(_term, of))};")
        return Symbol(self, name)

    def written(self, results: Iterable[Any]) -> str:
        """The function, with its results."""
        ends = [f"out[{i}] = {_term(result)};" for i, result in enumerate(results)]
        return "\n    ".join([f"void {self.name}(const double *in, double *out) {{", *self.lines, *ends]) + "\n}\n"

    sqrt, sin, cos = _operation("sqrt({})"), _operation("sin({})"), _operation("cos({})")
    arctan2 = _operation("atan2({}, {})")
    maximum, minimum = _operation("{0} > {1} ? {0} : {1}"), _operation("{0} < {1} ? {0} : {1}")
    where = _operation("{} != 0.0 ? {} : {}")


def _term(a: Any) -> str:
    if isinstance(a, Symbol):
        return a.name
    if math.isinf(a):
        return "INFINITY" if a > 0 else "(-INFINITY)"
    return f"({float(a)!r})"


MOTION, COMMAND, AIR, READ = (len(of._fields) for of in (ForecastMotion, ForecastCommand, Residual, GyroReading))
STRETCH = COMMAND + 11 + 1 + READ
"""Numbers of a stretch: command, step, whether there is a reading, reading."""
PLANE = 4
"""Numbers of a side."""


def source(b: Backup, limits: MarginLimits) -> str:
    """The formulas for a vehicle in a fence, in C."""
    p = TracedFunction("advance", MOTION + AIR + STRETCH)
    take = iter(p.inputs).__next__
    m, air, command = ForecastMotion(*_some(take, MOTION)), Residual(*_four(take)), ForecastCommand(*_four(take))
    step = ResponseStep(take(), _four(take), _four(take), take(), take())
    has_reading, reading = take(), GyroReading(*_some(take, READ))
    plain = moved(p, b.response, m, command, air, step)
    read = measured(p, plain, reading)
    advance = p.written(p.where(has_reading, x, y) for x, y in zip(read, plain, strict=True))
    p = TracedFunction("judge", MOTION + AIR + COMMAND + 1 + SOLIDS * PLANE)
    take = iter(p.inputs).__next__
    m, air, wanted = ForecastMotion(*_some(take, MOTION)), Residual(*_four(take)), ForecastCommand(*_four(take))
    floor = take()
    solids = tuple(Plane(*_four(take), "") for _ in range(SOLIDS))
    given, *told = judged(p, b, limits, m, air, wanted, solids, floor)
    return f"""#include <math.h>
#include <string.h>
static {advance}
void forecast(double *motion, const double *air, const double *stretches, long count) {{
    double in[{MOTION + AIR + STRETCH}];
    memcpy(in + {MOTION}, air, {AIR} * sizeof *air);
    for (; count > 0; count--, stretches += {STRETCH}) {{
        memcpy(in, motion, {MOTION} * sizeof *motion);
        memcpy(in + {MOTION + AIR}, stretches, {STRETCH} * sizeof *stretches);
        advance(in, motion);
    }}
}}
{p.written((*given, *told))}"""


def _some(take: Callable[[], Any], count: int) -> list[Any]:
    return [take() for _ in range(count)]


def _four(take: Callable[[], Any]) -> tuple[Any, Any, Any, Any]:
    return take(), take(), take(), take()


class Native:
    """The compiled formulas of a vehicle in a fence. Only for one thread at a time."""

    def __init__(self, b: Backup, limits: MarginLimits) -> None:
        """Compile them, in about two seconds.

        Raises:
            OSError: if there is no C compiler, or it fails. It tells what the compiler says.
        """
        if shutil.which(COMPILER) is None:
            raise OSError(f"no C compiler {COMPILER!r} is on the path")
        with tempfile.TemporaryDirectory(prefix="e2efly-") as folder:
            code, made = Path(folder, "filter.c"), Path(folder, "filter.so")
            code.write_text(source(b, limits), encoding="utf-8")
            command = [COMPILER, *OPTIONS, "-o", str(made), str(code), "-lm"]
            try:
                done = subprocess.run(
                    command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, timeout=LONGEST
                )
            except subprocess.TimeoutExpired:
                raise OSError(f"{COMPILER} takes longer than {LONGEST:g} s") from None
            if done.returncode:
                raise OSError(f"{COMPILER} ended with {done.returncode}: {done.stderr.strip()[-500:]}")
            library = ctypes.CDLL(str(made))
        numbers = ctypes.POINTER(ctypes.c_double)
        library.forecast.argtypes, library.forecast.restype = (numbers, numbers, ctypes.c_void_p, ctypes.c_long), None
        library.judge.argtypes, library.judge.restype = (numbers, numbers), None
        self._library = library
        self._motion = (ctypes.c_double * MOTION)()
        self._in = (ctypes.c_double * (MOTION + AIR + COMMAND + 1 + SOLIDS * PLANE))()
        self._out = (ctypes.c_double * (COMMAND + 3))()

    def forecast(self, m: ForecastMotion, air: Residual, stretches: list[Stretch]) -> ForecastMotion:
        """The motion after the stretches: `advanced` for each of them."""
        rows = array("d")
        for command, (h, x, y, z, rotors), reading in stretches:
            rows.extend(
                (*command, h, *x, *y, z, rotors, *((0.0,) * (1 + READ) if reading is None else (1.0, *reading)))
            )
        self._motion[:] = m
        push = (ctypes.c_double * AIR)(*air)
        self._library.forecast(self._motion, push, rows.buffer_info()[0], len(stretches))
        return ForecastMotion(*self._motion)

    def judge(
        self, m: ForecastMotion, air: Residual, wanted: ForecastCommand, solids: tuple[Plane, ...], floor: bool
    ) -> tuple[ForecastCommand, float, float, int]:
        """What the function `judged` returns. At most `SOLIDS` sides."""
        sides = [number for plane in (*solids, *(FAR,) * (SOLIDS - len(solids))) for number in plane[:PLANE]]
        self._in[:] = [*m, *air, *wanted, float(floor), *sides]
        self._library.judge(self._in, self._out)
        *given, share, room, limit = self._out
        return ForecastCommand(*given), share, room, int(limit)
