"""The pilot of a Crazyflie: a Crazyflie has no receiver, so its pilot types words into the terminal of `e2efly fly`.

`arm`, `hover`, `policy`, `off`, each with Enter; a word holds until the next. Any other line lands, also an empty one:
in need, Enter is enough.
"""

import os
import select
from collections.abc import Callable
from dataclasses import dataclass, field

from e2efly.flight.pilot.flight_state import Mission


@dataclass(frozen=True)
class TypedWish:
    """What the pilot wants."""

    armed: bool = False
    """The motors may turn."""
    mission: Mission = Mission.LAND


Wishes = Callable[[], TypedWish | None]
"""The pilot's newest wish. None: the pilot is not heard."""


def wish_of(word: str, before: TypedWish) -> TypedWish:
    """The wish after a word."""
    known = {
        "arm": TypedWish(armed=True),
        "off": TypedWish(),
        "hover": TypedWish(before.armed, Mission.HOVER),
        "policy": TypedWish(before.armed, Mission.POLICY),
    }
    return known.get(word.strip().lower(), TypedWish(before.armed))


@dataclass
class Words:
    """The wishes that are typed. When the terminal is gone, or another program has it, the pilot is not heard."""

    descriptor: int = 0
    """Where words are read: the standard input."""
    _wish: TypedWish | None = field(default_factory=TypedWish)
    _rest: bytes = b""

    def __call__(self) -> TypedWish | None:
        """The newest wish. This neither blocks nor raises."""
        try:
            if os.isatty(self.descriptor) and os.tcgetpgrp(self.descriptor) != os.getpgrp():
                return None  # in the background: to read would stop this process
            while self._wish is not None and select.select([self.descriptor], [], [], 0)[0]:
                data = os.read(self.descriptor, 4096)
                if not data:
                    self._wish = None
                    break
                *lines, self._rest = (self._rest + data)[-4096:].split(b"\n")
                for line in lines:
                    self._wish = wish_of(line.decode("ascii", "replace"), self._wish)
        except (OSError, ValueError):
            self._wish = None
        return self._wish
