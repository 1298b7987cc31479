"""Write a policy as C into a folder: what `e2efly export --c` does."""

import re
from pathlib import Path

from e2efly.c_policy.check import check_source
from e2efly.c_policy.header import KEYWORDS, Precision, Sizes, image_size
from e2efly.c_policy.source import sources
from e2efly.deploy.policy.contract import Contract
from e2efly.deploy.policy.loader import load_policy
from e2efly.storage import write_atomically

KIB = 1024


def write_c(
    folder: Path, file: Path, name: str, precision: Precision, memory: float | None = None, flash: float | None = None
) -> Sizes:
    """Write NAME.h, NAME.c and NAME_check.c.

    Args:
        folder: where to; made where it is not there.
        file: the policy.onnx.
        name: of the files and of all symbols.
        precision: that the network computes in.
        memory: KiB that the target has for the state and the images; None: enough.
        flash: KiB that it has for weights and tables; None: enough.

    Returns:
        What the policy needs.

    Raises:
        ValueError: for a name that C does not take, a policy that cannot be loaded or is too large for the target, a
            graph that is not known as C, and a folder that is none.
        OSError: when a file cannot be written.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]{0,30}", name) or name in KEYWORDS:
        raise ValueError(f"--name is {name!r}; accepted: a name of C: a to z, then a to z, 0 to 9 and _, 31 at most")
    for option, limit in (("memory", memory), ("flash", flash)):
        if limit is not None and not limit > 0:
            raise ValueError(f"--{option} is {limit}; accepted: more than 0 KiB")
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"--c is {str(folder)!r}, a file; accepted: a folder, which is made where it is not there")
    contract, content = load_policy(file).contract, file.read_bytes()
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
