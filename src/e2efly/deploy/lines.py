"""A stream of bytes as lines of bounded length."""

LONGEST = 4096
"""Most bytes of a line."""


class Lines:
    """Cuts a stream of bytes into lines of bounded length."""

    def __init__(self) -> None:
        self._rest = b""
        self._skip = False

    def feed(self, data: bytes, most: int | None = None) -> tuple[list[bytes], int, int]:
        """The complete lines that are not empty, how many overlong ones were dropped, and how many for their number.

        Args:
            data: the next bytes of the stream.
            most: of more complete lines than this the newest are cut out, and the others only counted; None: any.
        """
        *lines, rest = (self._rest + data).rsplit(b"\n", -1 if most is None else most + 1)
        dropped = 0
        if most is not None and len(lines) > most:  # the first may be many that were not cut
            older, *lines = lines
            dropped, self._skip = older.count(b"\n") + 1, False
        if lines and self._skip:  # the end of a line that was dropped already
            lines, self._skip = lines[1:], False
        overlong = sum(len(line) > LONGEST for line in lines)
        if len(rest) > LONGEST:
            overlong += not self._skip
            rest, self._skip = b"", True
        self._rest = b"" if self._skip else rest
        return [line for line in lines if line.strip() and len(line) <= LONGEST], overlong, dropped
