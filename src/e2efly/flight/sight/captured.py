"""An image source whose driver runs in its own process: `scripts/capture.py`, which publishes in shared memory."""

import math
import os
import secrets
from collections.abc import Sequence

from e2efly.flight.child import Child, first_opened, text_of
from e2efly.flight.sight.image_source import Frame
from e2efly.flight.sight.shared import SharedCamera, place
from e2efly.policy.images import Image

SCRIPT = "capture.py"
"""The script that runs in the process."""


class Captured:
    """Images of a capture process. Reading them needs no thread, and no camera driver in this process."""

    def __init__(self, name: str, image: Image, python: str, kind: str, where: str, fov: str = "") -> None:
        """Start the process and wait for its first image. `where` is what this kind needs to know, such as a path or a
        topic. `fov` is the field of view, as `field_of_view` gives it.

        Raises:
            ValueError: with what the process reports about its failure. Also if no image comes in time, or if the
                images are not what the policy sees.
        """
        self._name = name
        self._memory = f"capture-{os.getpid()}-{secrets.token_hex(4)}"  # a name that no other program uses
        self._problem: str | None = None
        self._closed = False
        try:
            self._child = Child(python, SCRIPT, kind, self._memory, image.sees, fov, where)
        except ValueError as error:
            self._forget()
            raise ValueError(f"image source {name}: {error}") from None
        try:
            self._camera = SharedCamera(self._memory, image, called=f"image source {name}")
        except ValueError:
            self._child.close()
            self._forget()
            raise

    @property
    def problem(self) -> str | None:
        """Why the process has ended, or otherwise the last problem with an image."""
        ended = self._child.ended
        return f"{self._name}: {ended}" if ended else self._problem or self._camera.problem

    def read(self, now: float) -> list[Frame]:
        """The newest image, if it is new."""
        if self._closed:
            return []
        for line in self._child.lines():
            word, _, said = line.partition(b" ")
            self._problem = None if word == b"solved" else f"{self._name}: {text_of(said)}"
        return self._camera.read(now)

    def close(self) -> None:
        """End the process. This takes up to 2 s."""
        if not self._closed:
            self._closed = True
            self._child.close()
            self._camera.close()
            self._forget()

    def describe(self) -> str:
        """The name of the source, the image size, and the package that it uses."""
        size = self._camera.describe().partition(", ")[2]
        return f"{self._name}, {size} ({self._child.detail})"

    def _forget(self) -> None:
        place(self._memory).unlink(missing_ok=True)


def open_captured(text: str, image: Image, pythons: Sequence[str], advice: str, where: str, fov: str = "") -> Captured:
    """Start a capture process with the first interpreter that has the required package. `text` is KIND:WHERE. The other
    arguments are those of `Captured`.

    Raises:
        ValueError: with what each interpreter reports, and the advice.
    """
    kind = text.partition(":")[0]
    return first_opened(list(pythons), advice, lambda python: Captured(text, image, python, kind, where, fov))


def field_of_view(text: str, name: str) -> tuple[str, str]:
    """Split WHERE[?fov=ACROSSxDOWN] into WHERE and the field of view: `ACROSSxDOWN` in rad, `policy`, or empty.

    Raises:
        ValueError: naming the option and what is accepted.
    """
    where, _, option = text.partition("?")
    if not option and "?" not in text:
        return where, ""
    key, _, value = option.partition("=")
    accepted = "fov=ACROSSxDOWN, each in rad, below pi; or fov=policy, where it is that of the policy's camera"
    if key != "fov" or not (value == "policy" or _angles(value)):
        raise ValueError(f"image source {name}: option is {option!r}; accepted: {accepted}")
    return where, value


def _angles(value: str) -> bool:
    across, _, down = value.partition("x")
    try:
        return all(0 < float(angle) < math.pi for angle in (across, down))
    except ValueError:
        return False
