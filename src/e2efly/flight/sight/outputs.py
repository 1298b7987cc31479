"""Where `e2efly hil` sends its images: `--image NAME=KIND:WHERE`, as often as needed for each image.

All images go into shared memory. For each further output, a separate process reads them there and sends them on. A
reader that stalls can therefore delay nothing else.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass

from e2efly.flight.child import ROS_PYTHON, Child, first_opened, pythons
from e2efly.policy.contract import Contract
from e2efly.policy.images import Image

EXACT = "exact"
"""After a port: send exact values instead of rounded ones."""
FORMS = "shm:NAME, tcp:PORT, tcp:PORT:exact, ros1:/topic or ros2:/topic"
"""How outputs are written."""


@dataclass(frozen=True)
class Output:
    """An output of an image."""

    kind: str
    """shm, tcp, ros1 or ros2."""
    where: str
    """Name, port or topic."""
    exact: bool = False
    """Whether the values are exact. Only for tcp."""

    @property
    def taken(self) -> tuple[str, ...]:
        """The resources that no other output may use."""
        if self.kind in ("ros1", "ros2"):
            return f"{self.kind}:{self.where}", f"{self.kind}:{camera_info(self.where)}"
        return (f"{self.kind}:{self.where}",)


def camera_info(topic: str) -> str:
    """The topic of the camera's intrinsics that belongs to a topic of images."""
    return f"{topic.rpartition('/')[0]}/camera_info"


def outputs(texts: Sequence[str], contract: Contract) -> dict[str, list[Output]]:
    """The outputs of each image of a contract.

    Raises:
        ValueError: naming the text and what is accepted. The cause is an unknown image or kind, a resource that another
            output uses, an image without an output, or an image with two places in shared memory.
    """
    found: dict[str, list[Output]] = {image.name: [] for image in contract.images}
    taken: dict[str, str] = {}
    for text in texts:
        name, _, uri = text.partition("=")
        if name not in found or not uri:
            raise ValueError(f"--image is {text!r}; accepted: NAME=URI, NAME one of {', '.join(found)}")
        output = _output(text, uri)
        for resource in output.taken:
            if resource in taken:
                raise ValueError(f"--image is {text}; accepted: not {resource} again, which {taken[resource]} has")
            taken[resource] = text
        if output.kind == "shm" and any(other.kind == "shm" for other in found[name]):
            raise ValueError(f"--image is {text}; accepted: one shm:NAME for each image, as any number can read it")
        found[name].append(output)
    for name, given in found.items():
        if not given:
            raise ValueError(f"--image lacks {name}; accepted: --image {name}=URI, with URI {FORMS}")
    return found


def _output(text: str, uri: str) -> Output:
    kind, _, where = uri.partition(":")
    if kind == "shm" and where:
        return Output(kind, where)
    if kind == "tcp":
        port, _, more = where.partition(":")
        if port.isascii() and port.isdigit() and 1 <= int(port) <= 65535 and more in ("", EXACT):
            return Output(kind, port, more == EXACT)
    if kind in ("ros1", "ros2") and where.startswith("/") and where.strip("/") and not where.endswith("/"):
        return Output(kind, where)
    raise ValueError(f"--image is {text}; accepted: {FORMS}")


def give(image: Image, name: str, output: Output, host: str) -> Child:
    """Start the process that sends an image on from shared memory. `name` is that of the shared memory that holds it,
    float32. The output is any but shared memory. TCP is served on `host`.

    Raises:
        ValueError: naming the output and why it is not possible: a port in use, no ROS, or no pinhole camera for ROS.
    """
    where = f"--image {image.name}={output.kind}:{output.where}"
    pinhole = image.projection == "pinhole"
    across, down = image.fov_rad if pinhole else (0.0, 0.0)
    common = (output.kind, name, image.sees, repr(image.reach_m[1]), f"{across!r}x{down!r}")
    try:
        if output.kind == "tcp":
            return Child(sys.executable, "give.py", *common, host, output.where, EXACT if output.exact else "")
        if not pinhole:
            raise ValueError(f"is {image.projection}; accepted: a pinhole camera, as CameraInfo can say no other")
        further = (output.where, camera_info(output.where), image.name)
        return first_opened(
            pythons(ROS_PYTHON),
            f"install ROS, or name a Python that has it in {ROS_PYTHON}",
            lambda python: Child(python, "give.py", *common, *further),
        )
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
