"""Write a policy as C code into a folder, for `e2efly export --c`."""

import re
from pathlib import Path

from e2efly.config.storage import write_atomically
from e2efly.policy.c_export.c_source import sources
from e2efly.policy.c_export.check_program import check_source
from e2efly.policy.c_export.header import Precision, Sizes, image_size
from e2efly.policy.contract import Contract
from e2efly.policy.loader import load_policy

KIB = 1024


def write_c(
    folder: Path, file: Path, name: str, precision: Precision, memory: float | None = None, flash: float | None = None
) -> Sizes:
    """Write NAME.h, NAME.c and NAME_check.c.

    Args:
        folder: the folder to write to. It is created if it does not exist.
        file: the policy.onnx.
        name: name of the files and prefix of all symbols.
        precision: the precision in which the network computes.
        memory: memory of the target for the state and the images, KiB. None: no limit.
        flash: memory of the target for weights and tables, KiB. None: no limit.

    Returns:
        The memory that the policy needs.

    Raises:
        ValueError: for a name that C does not accept, a policy that cannot be loaded or is too large for the target, a
            graph that cannot be converted to C, and a path that is not a folder.
        OSError: when a file cannot be written.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]{0,30}", name):
        raise ValueError(f"--name is {name!r}; accepted: a name of C: a to z, then a to z, 0 to 9 and _, 31 at most")
    for option, limit in (("memory", memory), ("flash", flash)):
        if limit is not None and not limit > 0:
            raise ValueError(f"--{option} is {limit}; accepted: more than 0 KiB")
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"--c is {str(folder)!r}, a file; accepted: a folder, which is made where it is not there")
    policy = load_policy(file)
    contract, content = policy.contract, policy.content
    try:
        made = sources(contract, content, name, precision)
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None
    _check_sizes(contract, made.needs, precision, memory, flash)
    checked = check_source(contract, content, name, precision)
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in ((f"{name}.h", made.header), (f"{name}.c", made.source), (f"{name}_check.c", checked)):
        write_atomically(folder / path, text.encode())
    return made.needs


def _check_sizes(
    contract: Contract, needs: Sizes, precision: Precision, memory: float | None, flash: float | None
) -> None:
    if memory is not None and needs.memory > memory * KIB:
        images = "".join(
            f", {_kib(4 * image_size(i))} for {i.name} ({i.sees}, {i.height} x {i.width})" for i in contract.images
        )
        smaller = ["a policy of smaller images"] if images else []
        smaller += ["--precision float, which halves most of the state"] if precision == "double" else []
        raise ValueError(
            f"--memory is {memory:g} KiB; the policy needs {_kib(needs.memory)}: {_kib(needs.state)} for its "
            f"state{images}; accepted: {', or '.join([f'{_kib(needs.memory)} or more', *smaller])}"
        )
    if flash is not None and needs.constants > flash * KIB:
        raise ValueError(
            f"--flash is {flash:g} KiB; the policy needs {_kib(needs.constants)} for its weights, and its code "
            f"comes on top; accepted: {_kib(needs.constants)} or more, or a policy with fewer weights"
        )


def _kib(size: int) -> str:
    """Bytes in KiB, rounded up."""
    return f"{-(-10 * size // KIB) / 10:.1f} KiB"
