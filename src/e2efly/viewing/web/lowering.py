"""Functions of JAX as programs for the page's machine."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal
from jax.interpreters.partial_eval import dce_jaxpr
from jax.lax import GatherScatterMode

from e2efly.viewing.web.machine import ELEMENTWISE, Cells, Machine

FILL = GatherScatterMode.FILL_OR_DROP
PLACES = 4096
"""Largest number of places among which an index may choose."""
SAME = frozenset({"copy", "copy_p", "stop_gradient", "reduce_precision", "optimization_barrier"})
"""Operations whose result is their operand."""
SHAPED = frozenset({"reshape", "squeeze", "expand_dims"})
"""Operations whose result is their operand in another shape."""
SUMS = {
    "reduce_sum": "add", "reduce_prod": "mul", "reduce_max": "max", "reduce_min": "min", "reduce_and": "and",
    "reduce_or": "or", "reduce_xor": "xor",
}  # fmt: skip
"""Reductions, and the instruction of which each is a chain."""
RUNNING = {"cumsum": "add", "cumprod": "mul", "cummax": "max", "cummin": "min"}
"""The same for running results."""
INNER = ("jaxpr", "call_jaxpr", "fun_jaxpr")
"""Parameters of operations that hold a function which they call."""


class NoInstructionError(ValueError):
    """A computation for which the machine has no instructions. The text continues a sentence about what computes."""


def lowered(function: Callable[[dict[str, Any]], Mapping[str, Any]], given: Mapping[str, Any]) -> dict[str, Any]:
    """The program of a function, as JSON.

    Args:
        function: a pure function of arrays by name; it returns arrays by name.
        given: an array, or something with its shape and type, for each input.

    Raises:
        NoInstructionError: for an operation that the machine does not have.
    """
    if keys := [name for name, x in given.items() if jnp.issubdtype(x.dtype, jax.dtypes.prng_key)]:
        raise NoInstructionError(f"keeps random keys in its state, {', '.join(keys)}; accepted: numbers")
    given = {name: jax.ShapeDtypeStruct(np.shape(x), x.dtype) for name, x in sorted(given.items())}
    traced, shape = jax.make_jaxpr(lambda arrays: dict(function(arrays)), return_shape=True)(given)
    # what only a reward reads may compute by operations that the machine does not have
    needed, _ = dce_jaxpr(traced.jaxpr, [True] * len(shape), instantiate=True)
    machine = Machine()
    inputs = {name: machine.input(x.shape) for name, x in given.items()}
    results = _run(machine, needed, traced.consts, list(inputs.values()))
    return machine.program(inputs, dict(zip(sorted(shape), results, strict=True)))


def _run(machine: Machine, jaxpr: Jaxpr, constants: Sequence[Any], given: Sequence[Cells]) -> list[Cells]:
    known: dict[Any, Cells] = dict(zip(jaxpr.invars, given, strict=True))
    known |= zip(jaxpr.constvars, (_constant(machine, value) for value in constants), strict=True)

    def read(x: Any) -> Cells:
        return machine.constant(x.val) if isinstance(x, Literal) else known[x]

    for eqn in jaxpr.eqns:
        known |= zip(eqn.outvars, _lower(machine, eqn, [read(x) for x in eqn.invars]), strict=True)
    return [read(x) for x in jaxpr.outvars]


def _called(machine: Machine, function: ClosedJaxpr | Jaxpr, given: Sequence[Cells]) -> list[Cells]:
    closed = isinstance(function, ClosedJaxpr)
    return _run(machine, function.jaxpr, function.consts, given) if closed else _run(machine, function, (), given)


def _constant(machine: Machine, value: Any) -> Any:
    """The cells of a constant. A random key stays what it is: only constants can come of it."""
    return value if jnp.issubdtype(value.dtype, jax.dtypes.prng_key) else machine.constant(value)


def _lower(machine: Machine, eqn: Any, given: list[Cells]) -> list[Cells]:
    """The results of one operation."""
    name, params = eqn.primitive.name, eqn.params
    if name == "scan":
        return _scan(machine, params, given)
    if name == "cond":
        return _branches(machine, params["branches"], given[0], given[1:])
    inner = next((params[key] for key in INNER if key in params), None)
    if inner is not None:
        return _called(machine, inner, given)
    if all(isinstance(x, jax.Array) or np.all(x < 0) for x in given):
        values = [
            x if isinstance(x, jax.Array) else jnp.asarray(machine.value(x), v.aval.dtype)
            for x, v in zip(given, eqn.invars, strict=True)
        ]
        found = eqn.primitive.bind(*values, **params)
        return [_constant(machine, x) for x in (found if eqn.primitive.multiple_results else [found])]
    if name == "split":
        return np.split(given[0], np.cumsum(params["sizes"])[:-1], params["axis"])
    return [_value(machine, eqn, name, params, given)]


def _value(machine: Machine, eqn: Any, name: str, params: Mapping[str, Any], given: list[Cells]) -> Cells:
    """The result of an operation that has one and calls no function."""
    x, shape, emit = given[0], eqn.outvars[0].aval.shape, machine.emit
    number = machine.constant
    kind, made = (np.dtype(v.aval.dtype).kind for v in (eqn.invars[0], eqn.outvars[0]))
    if name in SAME:
        return x
    if name == "add_any":
        return emit("add", *given)
    if name in SHAPED:
        return x.reshape(shape)
    if name in SUMS:
        axes = tuple(params["axes"])
        parts = np.moveaxis(x, axes, range(len(axes))).reshape(-1, *shape)
        return _chain(machine, SUMS[name], list(parts))[-1]
    if name in RUNNING:
        axis, step = params["axis"], -1 if params["reverse"] else 1
        parts = list(np.moveaxis(x, axis, 0))[::step]
        return np.moveaxis(np.stack(_chain(machine, RUNNING[name], parts)[::step]), 0, axis)
    if name in ELEMENTWISE - {"div", "round", "not", "select"} or (name in ("div", "not") and kind in "fb"):
        return emit(name, *given)
    match name:
        case "div":
            return emit("trunc", emit("div", *given))
        case "round":
            if params["rounding_method"] == 1:
                return emit("round", x)
            return emit("mul", emit("sign", x), emit("floor", emit("add", emit("abs", x), number(0.5))))
        case "square":
            return emit("mul", x, x)
        case "integer_pow" if params["y"] == 2:
            return emit("mul", x, x)
        case "integer_pow":
            return emit("pow", x, number(params["y"]))
        case "exp2":
            return emit("pow", number(2.0), x)
        case "rsqrt":
            return emit("div", number(1.0), emit("sqrt", x))
        case "logistic":
            return emit("div", number(1.0), emit("add", number(1.0), emit("exp", emit("neg", x))))
        case "is_finite":
            return emit("lt", emit("abs", x), number(np.inf))
        case "clamp":
            return emit("min", emit("max", given[1], x), given[2])
        case "convert_element_type":
            if made == "b" != kind:
                return emit("ne", x, number(0.0))
            return emit("trunc", x) if made in "iu" and kind == "f" else x
        case "select_n":
            return _selected(machine, x, given[1:])
        case "argmax" | "argmin":
            return _extreme(machine, "gt" if name == "argmax" else "lt", np.moveaxis(x, params["axes"][0], 0))
        case "broadcast_in_dim":
            spread = np.ones(len(shape), int)
            spread[list(params["broadcast_dimensions"])] = x.shape
            return np.broadcast_to(x.reshape(spread), shape)
        case "transpose":
            return x.transpose(params["permutation"])
        case "concatenate":
            return np.concatenate(given, params["dimension"])
        case "stack":
            return np.stack(given, params["axis"])
        case "slice":
            strides = params["strides"] or (1,) * x.ndim
            return x[tuple(map(slice, params["start_indices"], params["limit_indices"], strides))]
        case "rev":
            return np.flip(x, params["dimensions"])
        case "pad":
            return _moves(machine, eqn, given)
        case "dot_general":
            return _product(machine, params["dimension_numbers"], *given)
        case "gather" | "dynamic_slice" | "dynamic_update_slice" | "scatter":
            return _indexed(machine, eqn, name, given)
        case "scatter-add" | "scatter-mul" | "scatter_add" | "scatter_mul" if np.all(given[1] < 0):
            return _combined(machine, eqn, name[-3:], given)
    raise NoInstructionError(
        f"computes by {name!r}, an operation of JAX for which the page has no instruction; accepted: arithmetic "
        "element by element, sums, products of matrices, choices and indices"
    )


def _chain(machine: Machine, operation: str, parts: list[Cells]) -> list[Cells]:
    """The running results of an operation of two numbers."""
    results = parts[:1]
    for part in parts[1:]:
        results.append(machine.emit(operation, results[-1], part))
    return results


def _extreme(machine: Machine, better: str, parts: Cells) -> Cells:
    """Index of the first part that is better than all others."""
    best, place = parts[0], machine.constant(np.zeros(parts.shape[1:]))
    for i, part in enumerate(parts[1:], 1):
        wins = machine.emit(better, part, best)
        best, place = machine.emit("select", wins, best, part), machine.emit("select", wins, place, machine.constant(i))
    return place


def _selected(machine: Machine, index: Cells, cases: Sequence[Cells]) -> Cells:
    found = cases[0]
    for i, case in enumerate(cases[1:], 1):
        chosen = index if len(cases) == 2 else machine.emit("eq", index, machine.constant(i))
        found = machine.emit("select", chosen, found, case)
    return found


def _branches(machine: Machine, branches: Sequence[Any], index: Cells, given: Sequence[Cells]) -> list[Cells]:
    """All branches are computed, and one is chosen."""
    results = [_called(machine, branch, given) for branch in branches]
    return [_selected(machine, index, cases) for cases in zip(*results, strict=True)]


def _scan(machine: Machine, params: Mapping[str, Any], given: list[Cells]) -> list[Cells]:
    """A loop, written out: each of its rounds has its own instructions."""
    fixed, carried = params["num_consts"], params["num_carry"]
    constants, carry, rows = given[:fixed], given[fixed : fixed + carried], given[fixed + carried :]
    order = range(params["length"])
    made: dict[int, list[Cells]] = {}
    for i in reversed(order) if params["reverse"] else order:
        results = _called(machine, params["jaxpr"], [*constants, *carry, *(x[i] for x in rows)])
        carry, made[i] = results[:carried], results[carried:]
    return [*carry, *(np.stack([made[i][k] for i in order]) for k in range(len(params["jaxpr"].out_avals) - carried))]


def _product(machine: Machine, numbers: Any, a: Cells, b: Cells) -> Cells:
    """A product of matrices. A large constant matrix becomes a table."""
    (left, right), (of_a, of_b) = numbers
    kept = [[i for i in range(x.ndim) if i not in (*c, *t)] for x, c, t in ((a, left, of_a), (b, right, of_b))]
    shape = [a.shape[i] for i in (*of_a, *kept[0])] + [b.shape[i] for i in kept[1]]
    batch, terms = (math.prod(a.shape[i] for i in axes) for axes in (of_a, left))
    a = a.transpose(*of_a, *kept[0], *left).reshape(batch, -1, terms)
    b = b.transpose(*of_b, *right, *kept[1]).reshape(batch, terms, -1)
    if batch == 1 and np.all(b < 0) and b.size > PLACES // 64:
        return np.stack([machine.dot(row, machine.value(b[0])) for row in a[0]]).reshape(shape)
    products = [machine.emit("mul", a[:, :, i, None], b[:, None, i]) for i in range(terms)]
    return _chain(machine, "add", products)[-1].reshape(shape)


def _moves(machine: Machine, eqn: Any, given: Sequence[Any]) -> Cells:
    """The result of an operation that moves numbers, for addresses in place of the numbers."""
    params = dict(eqn.params)
    if params.get("mode") == FILL and "fill_value" in params:
        dtype = eqn.outvars[0].aval.dtype
        lacking = np.nan if dtype.kind == "f" else np.iinfo(np.int32).min
        fill = lacking if params["fill_value"] is None else params["fill_value"]
        params["fill_value"] = int(machine.constant(fill))
    return np.asarray(eqn.primitive.bind(*(jnp.asarray(x, jnp.int32) for x in given), **params), np.int64)


def _indexed(machine: Machine, eqn: Any, name: str, given: list[Cells]) -> Cells:
    """Numbers at places that are computed: for each place that there can be, the result is worked out here."""
    x, params = given[0], eqn.params
    numbers = params.get("dimension_numbers")
    if name == "gather":
        (index,), axes, sizes, first = given[1:], numbers.start_index_map, params["slice_sizes"], 1
    elif name == "scatter":
        index, axes, sizes, first = given[1], numbers.scatter_dims_to_operand_dims, (1,) * x.ndim, 1
    else:
        first = 2 if name == "dynamic_update_slice" else 1
        index, axes = np.array(given[first:]).reshape(1, -1), range(x.ndim)
        sizes = given[1].shape if first == 2 else params["slice_sizes"]
    rest = given[2:] if numbers else []
    rows = index.reshape(-1, index.shape[-1])
    moving = [c for c in range(rows.shape[1]) if np.any(rows[:, c] >= 0)]
    edge = int(params.get("mode") == FILL)  # one place beyond each end
    counts = [x.shape[axes[c]] - sizes[axes[c]] + 1 + 2 * edge for c in moving]
    if math.prod(counts) > PLACES or (name == "scatter" and len(rows) > 1 and moving):
        raise NoInstructionError(
            f"chooses among {math.prod(counts)} places by {name!r}; accepted: up to {PLACES}, of one array"
        )
    fixed = np.where(rows < 0, machine.value(np.minimum(rows, -1)), 0).astype(int)
    results = []
    for place in product(*map(range, counts)):
        fixed[:, moving] = np.array(place, int) - edge
        where = [fixed.reshape(index.shape)] if numbers else list(fixed[0])
        results.append(_moves(machine, eqn, [*given[:first], *where, *rest]))
    if not moving:
        return results[0]
    flat = machine.constant(np.zeros(len(rows)))
    for c, count in zip(moving, counts, strict=True):
        place = machine.emit("add", rows[:, c], machine.constant(edge))
        nearest = machine.emit("min", machine.emit("max", place, machine.constant(0)), machine.constant(count - 1))
        flat = machine.emit("add", machine.emit("mul", flat, machine.constant(count)), nearest)
    shape = results[0].shape
    if name == "gather":
        spread = np.expand_dims(flat.reshape(index.shape[:-1]), tuple(numbers.offset_dims))
    else:
        spread = flat.reshape((1,) * len(shape))
    return machine.lookup(np.broadcast_to(spread, shape), np.stack(results))


def _combined(machine: Machine, eqn: Any, operation: str, given: list[Cells]) -> Cells:
    """An array with numbers added or multiplied at fixed places."""
    x, index, updates = given
    where = machine.value(index).astype(int)
    before, order = jnp.full(x.shape, -1, jnp.int32), jnp.arange(updates.size, dtype=jnp.int32).reshape(updates.shape)
    numbers = eqn.params["dimension_numbers"]
    placed = jax.lax.scatter(before, jnp.asarray(where, jnp.int32), order, numbers, mode=eqn.params["mode"])
    landed = np.asarray(placed)
    if np.count_nonzero(landed >= 0) < updates.size:
        raise NoInstructionError("changes a number several times by one index; accepted: each number once")
    changed = machine.emit(operation, x, updates.ravel()[np.maximum(landed, 0)])
    return np.where(landed >= 0, changed, x)
