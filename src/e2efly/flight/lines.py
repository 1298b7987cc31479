"""Splits a stream of bytes into lines of bounded length."""

LONGEST = 4096
"""The largest length of a line, bytes."""


class Lines:
    """Splits a stream of bytes into lines of bounded length."""

    def __init__(self) -> None:
        self._rest = b""
        self._skip = False

    def feed(self, data: bytes, most: int | None = None) -> tuple[list[bytes], int, int]:
        """The complete non-empty lines, the number of lines dropped as too long, and the number dropped as too many. If
        there are more complete lines than `most`, the newest are kept and the others are only counted. None: no limit.
        """
        *lines, rest = (self._rest + data).rsplit(b"\n", -1 if most is None else most + 1)
        dropped = 0
        if most is not None and len(lines) > most:  # the first element may hold many lines that were not split
            older, *lines = lines
            dropped, self._skip = older.count(b"\n") + 1, False
        if lines and self._skip:  # the end of a line that was already dropped
            lines, self._skip = lines[1:], False
        overlong = sum(len(line) > LONGEST for line in lines)
        if len(rest) > LONGEST:
            overlong += not self._skip
            rest, self._skip = b"", True
        self._rest = b"" if self._skip else rest
        return [line for line in lines if line.strip() and len(line) <= LONGEST], overlong, dropped
