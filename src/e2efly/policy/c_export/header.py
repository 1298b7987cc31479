"""The header of an exported policy: its contract, for people, for compilers and for the program that supplies its
inputs.
"""

import re
from dataclasses import dataclass
from typing import Literal

from e2efly.policy.c_export.text import comment, number, string
from e2efly.policy.contract import Contract
from e2efly.policy.images import Image
from e2efly.policy.observation import PAST_ACTIONS

Precision = Literal["double", "float"]
"""The type that the network computes in."""
BYTES: dict[Precision, int] = {"double": 8, "float": 4}
"""Bytes of a number in each precision."""


@dataclass(frozen=True)
class Sizes:
    """The memory that a policy needs."""

    scratch: int
    """Count of numbers for the network's intermediate results."""
    state: int
    """Bytes of the state that changes from step to step, scratch included."""
    images: int
    """Bytes of the images, which the caller holds."""
    constants: int
    """Bytes of weights and tables, which never change."""

    @property
    def memory(self) -> int:
        """Bytes that are written in flight."""
        return self.state + self.images


def sizes(contract: Contract, scratch: int, constants: int, precision: Precision) -> Sizes:
    """The memory that a policy needs, from its contract, the count of scratch numbers and the bytes of constants."""
    kept = contract.observation_size + contract.memory_size + contract.action.size * contract.past_actions
    images = sum(image_size(image) for image in contract.images)
    width = BYTES[precision]
    state = -(-(width * max(scratch, 1) + BYTES["float"] * kept) // width) * width  # C aligns it
    return Sizes(scratch, state, BYTES["float"] * images, constants)


def image_size(image: Image) -> int:
    """Count of numbers in an image."""
    height, width, *colours = image.shape
    return height * width * (colours[0] if colours else 1)


def field_name(name: str) -> str:
    """The name of an observation field in C. With its prefix, it is no keyword or macro of any version of C or C++."""
    return f"field_{_plain(name)}"


def image_name(name: str) -> str:
    """The name of an image in C. See `field_name`."""
    plain = _plain(name)
    return plain if plain.startswith("image_") else f"image_{plain}"


def image_parameters(contract: Contract) -> str:
    """The parameters of a function of C for the images."""
    return "".join(f" const float *{image_name(image.name)}," for image in contract.images)


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", "_", name, flags=re.ASCII)


def check_names(contract: Contract) -> None:
    """Check that the fields and the images have different names in C, where macros have them in capital letters.

    Raises:
        ValueError: naming both.
    """
    for kind, named, names in (
        ("fields", field_name, [field.name for field in contract.observation]),
        ("images", image_name, [image.name for image in contract.images]),
    ):
        taken: dict[str, str] = {}
        for name in names:
            other = taken.setdefault(named(name).upper(), name)
            if other != name:
                raise ValueError(
                    f"the {kind} {other!r} and {name!r} are both {named(name)} in C; accepted: names that differ in "
                    "their letters and digits, whatever their case"
                )


def header(contract: Contract, name: str, digest: str, needs: Sizes, precision: Precision) -> str:
    """The file NAME.h. The digest is the SHA-256 of the policy.onnx; see `e2efly.policy.c_export.c_source.sources`."""
    big = name.upper()
    parts = [
        comment(f"{name}: a policy of e2efly {contract.e2efly_version} for the task {contract.task}, as C99."),
        comment(
            f"Made by e2efly export --c from the policy.onnx whose SHA-256 stands below; not to be edited. {name}.c "
            "needs <math.h> alone. Nothing is allocated and nothing is static but constants: what changes lies in "
            f"{name}_state, so that several may fly at once. All numbers that go in and out are float; SI units; "
            "the world is east, north, up, the body forward, left, up; quaternions are w, x, y, z, unit, from body to "
            f"world. The network computes in {precision}."
        ),
        f"#ifndef E2EFLY_{big}_H\n#define E2EFLY_{big}_H\n",
        '#ifdef __cplusplus\nextern "C" {\n#endif\n',
        _about(contract, big, digest, needs),
        _fields(contract, name),
        _state(contract, name, needs, precision),
        _calls(contract, name),
        "#ifdef __cplusplus\n}\n#endif\n\n#endif",
    ]
    return "\n".join(parts) + "\n"


def _about(c: Contract, big: str, digest: str, needs: Sizes) -> str:
    low, high = c.latency_range_s
    seen = c.observation_latency_range_s
    words = {
        "CONTRACT_VERSION": str(c.contract_version),
        "E2EFLY_VERSION": string(c.e2efly_version),
        "ONNX_SHA256": string(digest),
        "TASK": string(c.task),
        "VEHICLE": string(c.vehicle),
        "COMMAND_MODE": string(c.action.mode),
    }
    if c.vehicle_hash is not None:
        words["VEHICLE_HASH"] = string(c.vehicle_hash)
    numbers = {
        "CONTROL_RATE_HZ": (c.control_rate_hz, "how often it is to be asked"),
        "LATENCY_S": (c.latency_s, "from observation to command, for which it is made"),
        "LATENCY_MIN_S": (low, "the least of it in training"),
        "LATENCY_MAX_S": (high, "the most of it"),
        "OBSERVATION_AGE_MIN_S": (seen[0], "of the observed state in training"),
        "OBSERVATION_AGE_MAX_S": (seen[1], "the most of it"),
    }
    counts = {
        "OBSERVATION_SIZE": (c.observation_size, "numbers of the observation"),
        "MEMORY_SIZE": (c.memory_size, "numbers that it remembers from step to step"),
        "PAST_ACTIONS": (c.past_actions, "of its own that it sees"),
        "STATE_BYTES": (needs.state, "of the state below"),
        "IMAGE_BYTES": (needs.images, "of the images that its caller holds"),
        "CONSTANT_BYTES": (needs.constants, "of weights and tables, beside the code"),
    }
    lines = [f"#define {big}_{key} {value}" for key, value in words.items()]
    lines += [f"#define {big}_{key} {number(value)} {comment(about)}" for key, (value, about) in numbers.items()]
    lines += [f"#define {big}_{key} {value} {comment(about)}" for key, (value, about) in counts.items()]
    if c.domain:
        those = f"any vehicle of the family {c.vehicle}" if c.of_family else f"{c.vehicle} and vehicles about it,"
        lines.append(comment(f"It flies {those} within these ranges, in SI units:"))
    for kind, domain, about in (
        ("VEHICLE", c.domain, ""),
        ("COURSE", c.courses or (), "The courses and worlds that it was trained for, in SI units:"),
        ("SENSING", c.sensing or (), "The lags, ages and holes of what it saw in training, in SI units:"),
    ):
        lines += [comment(about)] if domain and about else []
        for part in domain:
            lines.append(f"#define {big}_{kind}_{part.name.upper()}_MIN {number(part.low)}")
            lines.append(f"#define {big}_{kind}_{part.name.upper()}_MAX {number(part.high)}")
    return "\n".join(lines) + "\n"


def _fields(c: Contract, name: str) -> str:
    lines = [
        comment(
            "What it sees, field by field, in the order of the observation. The network divides each by its scale "
            "itself. The past actions are missing here: the state has them."
        ),
        "typedef struct {",
    ]
    for part in c.observation:
        if part.name != PAST_ACTIONS:
            about = f"{part.unit}, frame {part.frame}, scale {part.scale:g}: {part.description}"
            lines += [comment(about, "    "), f"    float {field_name(part.name)}[{part.size}];"]
    lines.append(f"}} {name}_seen;\n")
    lines.append(comment("Where each field begins in the observation."))
    starts = [f"    {name.upper()}_AT_{_plain(n).upper()} = {part.start}" for n, part in c.slices.items()]
    lines += ["enum {", ",\n".join(starts), "};\n"]
    for image in c.images:
        big = f"{name.upper()}_{image_name(image.name).upper()}"
        about = (
            f"{image.name}: {image.sees}{'' if image.sees != 'mask' else f' of {image.of}'}, {image.projection}, "
            f"field of view {image.fov_rad[0]:.6g} x {image.fov_rad[1]:.6g} rad; the camera at "
            f"{', '.join(f'{x:g}' for x in image.position_m)} m of the body, {image.pitch_rad:.6g} rad downwards; "
            f"its age in training {image.latency_range_s[0]:g} to {image.latency_range_s[1]:g} s. Row by row from the "
            f"top, columns from the left{', three numbers for each' if len(image.shape) > 2 else ''}. A value is "
            f"{image.description}. Between two images it is shown the last one. Done by the network itself: "
            f"{image.preprocessing.removeprefix('inside the graph: ')}."
        )
        low, high = image.limits
        lines += [comment(about), f"#define {big}_HEIGHT {image.height}", f"#define {big}_WIDTH {image.width}"]
        lines += [f"#define {big}_SIZE {image_size(image)}", f"#define {big}_RATE_HZ {number(image.rate_hz)}"]
        lines += [f"#define {big}_MIN {number(low)}", f"#define {big}_MAX {number(high)}\n"]
    return "\n".join(lines)


def _state(c: Contract, name: str, needs: Sizes, precision: Precision) -> str:
    lines = [
        f"typedef {precision} {name}_real;\n",
        comment("All that changes from step to step; begin it before the first."),
        "typedef struct {",
    ]
    if c.memory_size:
        lines.append(f"    float memory[{c.memory_size}];")
    if c.past_actions:
        lines.append(f"    float past_actions[{c.action.size * c.past_actions}]; {comment('newest first')}")
    lines += [f"    float observation[{c.observation_size}];", f"    {name}_real scratch[{max(needs.scratch, 1)}];"]
    return "\n".join([*lines, f"}} {name}_state;\n"])


def _calls(c: Contract, name: str) -> str:
    big, images, size = name.upper(), image_parameters(c), c.action.size
    low, high = c.action.limits
    commands = "; ".join(
        f"{field} {a:g} to {b:g} {unit}"
        for field, unit, a, b in zip(c.action.fields, c.action.units, c.action.low, c.action.high, strict=True)
    )
    problems = {
        "OK": "all is well",
        "NOT_FINITE": "an entry of the observation is NaN or infinite",
        "NO_UNIT_QUATERNION": "the attitude's length is farther than 0.01 from 1",
        "BAD_IMAGE": "an image has a value out of its range, or NaN",
        "BAD_ACTION": "the network left its range: the observation is far outside of what flies",
    }
    entries = [f"    {big}_{key} = {i}{',' if i < len(problems) - 1 else ' '} {comment(about)}"
               for i, (key, about) in enumerate(problems.items())]  # fmt: skip
    return "\n".join(
        [
            comment("Why there is no action. The state and the action are then as they were."),
            "typedef enum {",
            *entries,
            f"}} {name}_status;\n",
            comment("The policy takes over: it has no memory yet, and is shown hovering actions as its last ones."),
            f"void {name}_begin({name}_state *state);\n",
            comment(
                f"One step, {big}_CONTROL_RATE_HZ times a second: the action, of {size} numbers in "
                f"[{low:g}, {high:g}], for what is seen now. Memory and past actions go on in the state."
            ),
            f"{name}_status {name}_act({name}_state *state, const {name}_seen *seen,{images} float action[{size}]);\n",
            comment("The same from a whole observation, past actions included; those of the state stay as they are."),
            f"{name}_status {name}_network({name}_state *state, const float observation[{c.observation_size}],"
            f"{images} float action[{size}]);\n",
            comment(f"From action to command: {c.action.mapping}. {commands}."),
            f"void {name}_command(const float action[{size}], float command[{size}]);\n",
        ]
    )
