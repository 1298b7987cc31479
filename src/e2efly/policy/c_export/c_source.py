"""The C code of a policy: its graph as straight-line code, and around it the work that `Policy.act` and the runtime do
in Python.
"""

from dataclasses import dataclass
from hashlib import sha256

import numpy as np

from e2efly.policy.c_export.c_graph import network
from e2efly.policy.c_export.header import (
    BYTES,
    Precision,
    Sizes,
    check_names,
    field_name,
    header,
    image_name,
    image_parameters,
    image_size,
    sizes,
)
from e2efly.policy.c_export.program import CProgram, Operand, layout
from e2efly.policy.c_export.text import array, comment, number
from e2efly.policy.contract import Contract
from e2efly.policy.images import ROUNDING as IMAGE_ROUNDING
from e2efly.policy.loader import INPUT, MEMORY, NEXT_MEMORY, OUTPUT, ROUNDING, UNIT_TOLERANCE
from e2efly.policy.observation import PAST_ACTIONS


@dataclass(frozen=True)
class Sources:
    """The files that an export to C writes."""

    header: str
    source: str
    needs: Sizes


def sources(contract: Contract, content: bytes, name: str, precision: Precision) -> Sources:
    """Header and source of a policy. `content` is that of its policy.onnx. `name` is the name of the files and the
    prefix of the symbols.

    Raises:
        ValueError: for a graph that cannot be converted to C, and for names that would be the same in C.
    """
    check_names(contract)
    inputs = {INPUT: Operand("observation", (contract.observation_size,))}
    inputs |= {image.name: Operand(image_name(image.name), image.shape) for image in contract.images}
    if contract.memory_size:
        inputs[MEMORY] = Operand("state->memory", (contract.memory_size,))
    graph = network(content, inputs)
    program, outputs = graph.program, graph.outputs
    places, scratch = layout(program, {x.buffer for x in outputs.values() if x.buffer is not None})
    constants = BYTES["float"] * sum(x.size for x in program.floats.values())
    constants += 2 * sum(x.size for x in program.indices.values())
    needs = sizes(contract, scratch, constants, precision)
    parts = [
        comment(f"See {name}.h, the contract. Made by e2efly export --c; not to be edited."),
        f'#include "{name}.h"\n\n#include <math.h>\n',
        '#ifdef __FAST_MATH__\n#error "without -ffast-math: it takes the checks for numbers that are not finite away"\n'
        "#endif\n",
        f"typedef {name}_real real;\n#define REAL(name) name{'' if precision == 'double' else '##f'}\n",
        *(array("static const unsigned short", key, map(str, x)) for key, x in program.indices.items()),
        *(array("static const float", key, map(number, x.reshape(-1))) for key, x in program.floats.items()),
        "",
        _network(contract, name, program, places, outputs),
        _around(contract, name),
    ]
    return Sources(header(contract, name, sha256(content).hexdigest(), needs, precision), "\n".join(parts), needs)


def _network(c: Contract, name: str, program: CProgram, places: list[int], outputs: dict[str, Operand]) -> str:
    big = name.upper()
    lines = [
        f"{name}_status {name}_network({name}_state *state, const float observation[{c.observation_size}],"
        f"{image_parameters(c)} float action[{c.action.size}])",
        "{",
        "    real *const s = state->scratch;",
        *(f"    real *const b{i} = s + {place};" for i, place in enumerate(places) if _is_used(program, i)),
        "",
        f"    for (int i = 0; i < {c.observation_size}; i++)",
        f"        if (!isfinite(observation[i])) return {big}_NOT_FINITE;",
        *_unit(c, big),
        *_in_range(c, big),
    ]
    for step in program.steps:
        lines += ["", comment(step.about, "    "), "    {", *(f"        {line}" for line in step.lines), "    }"]
    action, most = outputs[OUTPUT], number(1 + ROUNDING)
    lines += [
        "",
        f"    for (int i = 0; i < {c.action.size}; i++)",
        f"        if (!(REAL(fabs)({action.text}[i]) <= {most})) return {big}_BAD_ACTION;",
        f"    for (int i = 0; i < {c.action.size}; i++) {{",
        f"        const float a = (float){action.text}[i];",
        "        action[i] = a < -1.0f ? -1.0f : a > 1.0f ? 1.0f : a;",
        "    }",
    ]
    if c.memory_size:
        kept = outputs[NEXT_MEMORY]
        lines.append(f"    for (int i = 0; i < {c.memory_size}; i++) state->memory[i] = (float){kept.text}[i];")
    return "\n".join([*lines, f"    return {big}_OK;", "}\n"])


def _is_used(program: CProgram, buffer: int) -> bool:
    return any(buffer == step.writes for step in program.steps)


def _unit(c: Contract, big: str) -> list[str]:
    squares = " + ".join(f"q[{i}] * q[{i}]" for i in range(4))
    return [
        "    {",
        f"        const float *q = observation + {c.slices[c.attitude].start};",
        f"        const float off = {squares} - 1.0f;",
        f"        if (!(fabsf(off) <= {number(2 * UNIT_TOLERANCE)})) return {big}_NO_UNIT_QUATERNION;",
        "    }",
    ]


def _in_range(c: Contract, big: str) -> list[str]:
    lines = []
    for image in c.images:
        low, high = image.limits
        room, x = IMAGE_ROUNDING * (high - low), f"{image_name(image.name)}[i]"
        lines += [
            f"    for (int i = 0; i < {image_size(image)}; i++)",
            f"        if (!({x} >= {number(low - room)} && {x} <= {number(high + room)})) return {big}_BAD_IMAGE;",
        ]
    return lines


def _around(c: Contract, name: str) -> str:
    big, size = name.upper(), c.action.size
    past = size * c.past_actions
    begin = [f"    for (int i = 0; i < {c.memory_size}; i++) state->memory[i] = 0.0f;"] if c.memory_size else []
    begin += [f"    for (int i = 0; i < {c.observation_size}; i++) state->observation[i] = 0.0f;"]
    begin += (
        [f"    for (int i = 0; i < {past}; i++) state->past_actions[i] = hover_action[i % {size}];"] if past else []
    )
    copies = [
        f"    for (int i = 0; i < {field.size}; i++) state->observation[{c.slices[field.name].start} + i] = "
        + (f"state->{PAST_ACTIONS}[i];" if field.name == PAST_ACTIONS else f"seen->{field_name(field.name)}[i];")
        for field in c.observation
    ]
    shift = [
        f"    for (int i = {past - 1}; i >= {size}; i--) state->past_actions[i] = state->past_actions[i - {size}];",
        f"    for (int i = 0; i < {size}; i++) state->past_actions[i] = action[i];",
    ]
    given, images = "".join(f" {image_name(image.name)}," for image in c.images), image_parameters(c)
    span = np.asarray(c.action.high) - np.asarray(c.action.low)
    return "\n".join(
        [
            *([array("static const float", "hover_action", map(number, c.hover_action))] if past else []),
            array("static const float", "low", map(number, c.action.low)),
            array("static const float", "span", map(number, span)),
            "",
            f"void {name}_begin({name}_state *state)",
            "{",
            *begin,
            "}",
            "",
            f"{name}_status {name}_act({name}_state *state, const {name}_seen *seen,{images} float action[{size}])",
            "{",
            f"    {name}_status status;",
            *copies,
            f"    status = {name}_network(state, state->observation,{given} action);",
            f"    if (status != {big}_OK) return status;",
            *(shift if past else []),
            "    return status;",
            "}",
            "",
            f"void {name}_command(const float action[{size}], float command[{size}])",
            "{",
            f"    for (int i = 0; i < {size}; i++) {{",
            "        const float a = action[i] < -1.0f ? -1.0f : action[i] > 1.0f ? 1.0f : action[i];",
            "        command[i] = low[i] + (a + 1.0f) / 2.0f * span[i];",
            "    }",
            "}",
            "",
        ]
    )
