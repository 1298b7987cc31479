"""This program's end of a link to a Crazyflie: what has come from it, and what is sent to it."""

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from e2efly.flight.clock import Clock
from e2efly.flight.crazyflie.contents import INFO, ITEM, TableEntry, entry
from e2efly.flight.crazyflie.crtp import LINK_SERVICE, LOGS, PARAMETERS, PLATFORM, CrtpPacket, PacketReader
from e2efly.flight.echoes import Echoes
from e2efly.flight.link import Link

AGAIN_S = 0.1
"""What was asked for and did not come is asked for again after this time, s."""
AT_ONCE = 8
"""Most requests that are under way: the Crazyflie's queue is short."""
CREATE, START, RESET = 6, 3, 5
"""Requests for log blocks."""
VERSIONS = {"protocol": 0, "firmware": 1, "device": 2}
"""Requests of versions."""
T = TypeVar("T")
TICK_S = 0.01
"""Unit of the period of a log block, s."""


@dataclass(frozen=True)
class LogBlock:
    """Variables that the Crazyflie sends together. Their values take at most 26 bytes."""

    id: int
    period: float
    """s."""
    names: tuple[str, ...]


@dataclass
class CrtpStation:
    """Sends and receives. Nothing here blocks or raises, but for `read_*` and `start`, which wait, on the ground."""

    link: Link
    clock: Clock
    latest: dict[int, tuple[dict[str, float], float]] = field(default_factory=dict)
    """The newest values of each log block by name, and when they came, s."""
    heard: float = -math.inf
    """When the newest packet came, s."""
    counts: dict[int, int] = field(default_factory=dict)
    """How often each log block has come."""
    echoes: Echoes = field(default_factory=Echoes)
    """The time stamps that come back."""
    malformed: int = 0
    """Number of packets so far that could not be read."""
    reader: PacketReader = field(default_factory=PacketReader)
    _versions: dict[int, bytes] = field(default_factory=dict)
    _tables: dict[int, dict[int, TableEntry]] = field(default_factory=dict)
    _sums: dict[int, bytes] = field(default_factory=dict)
    _values: dict[int, bytes] = field(default_factory=dict)
    _blocks: dict[int, tuple[TableEntry, ...]] = field(default_factory=dict)
    _answers: dict[bytes, int] = field(default_factory=dict)
    _info: dict[int, bytes] = field(default_factory=dict)
    _connection: int = 0

    def poll(self, now: float) -> None:
        """Read what has come, and send what is due. `now` is in s."""
        self.link.poll(now)
        if self.link.connections != self._connection:
            self._connection, self.reader = self.link.connections, PacketReader()
            self.latest.clear()
            self.echoes.forget()
        for packet in self.reader.feed(self.link.receive()):
            self.heard = now
            try:
                self._take(packet, now)
            except (struct.error, IndexError):
                self.malformed += 1
        if self.link.alive and self.echoes.due(now):
            self.send(CrtpPacket(LINK_SERVICE, 0, struct.pack("<d", now)))

    def send(self, packet: CrtpPacket) -> bool:
        """Send a packet. Returns whether the link is alive."""
        self.link.send(packet.framed())
        return self.link.alive

    def newest(self, block: LogBlock, now: float, oldest: float) -> tuple[dict[str, float], float] | None:
        """The newest values of a log block, and when they came, s. None: that is more than `oldest` s ago."""
        found = self.latest.get(block.id)
        return found if found is not None and now - found[1] <= oldest else None

    # -- on the ground -------------------------------------------------------------------------------------------------

    def read_versions(self, timeout: float) -> dict[str, bytes] | None:
        """The answers to `VERSIONS`. Without one within `timeout` s, None."""
        self._versions.clear()
        numbers = list(VERSIONS.values())
        missing = self._collected(
            numbers, lambda n: n in self._versions, lambda n: CrtpPacket(PLATFORM, 1, bytes([n])), timeout
        )
        return None if missing else {name: self._versions[number] for name, number in VERSIONS.items()}

    def read_table(self, port: int, timeout: float) -> dict[str, TableEntry] | None:
        """The table of parameters or log variables by name. If nothing comes for `timeout` s, None."""
        self._info.pop(port, None)
        if self._collected([port], lambda p: p in self._info, lambda p: CrtpPacket(p, 0, bytes([INFO])), timeout):
            return None
        info = self._info[port]
        if self._sums.get(port) != info:  # another firmware than the one whose table is known
            self._sums[port] = info
            self._tables[port] = {}
        table = self._tables[port]
        missing = self._collected(
            list(range(int.from_bytes(info[:2], "little"))),
            lambda n: n in table,
            lambda n: CrtpPacket(port, 0, bytes([ITEM]) + n.to_bytes(2, "little")),
            timeout,
        )
        return None if missing else {one.name: one for one in table.values()}

    def read_parameters(self, wanted: Sequence[TableEntry], timeout: float) -> dict[str, float]:
        """The values of parameters by name. Those that are not told are left out."""
        self._values.clear()
        entries = {one.id: one for one in wanted}
        self._collected(
            list(entries),
            lambda n: n in self._values,
            lambda n: CrtpPacket(PARAMETERS, 1, n.to_bytes(2, "little")),
            timeout,
        )
        return {one.name: one.value(self._values[n]) for n, one in entries.items() if n in self._values}

    def start(self, blocks: Sequence[LogBlock], table: dict[str, TableEntry], timeout: float) -> str:
        """Let the Crazyflie send log blocks. Returns what is wrong; empty if nothing is."""
        self.latest.clear()
        self._answers.clear()
        lacking = sorted({name for block in blocks for name in block.names} - set(table))
        if lacking:
            return f"it has no log variable {', '.join(lacking)}"
        self._blocks = {block.id: tuple(table[name] for name in block.names) for block in blocks}
        orders = [bytes([RESET])]
        for block in blocks:
            parts = (bytes([one.kind]) + one.id.to_bytes(2, "little") for one in self._blocks[block.id])
            orders.append(bytes([CREATE, block.id]) + b"".join(parts))
            orders.append(bytes([START, block.id, round(block.period / TICK_S)]))
        for order in orders:
            key = order[:2]
            if self._collected([order], lambda _, key=key: key in self._answers,
                               lambda sent: CrtpPacket(LOGS, 1, sent), timeout):  # fmt: skip
                return "it does not answer a request for logs"
            if self._answers[key] not in (0, 17):  # 17: the block exists already, from a request that was repeated
                return f"it refuses log block {key[1:].hex()}: error {self._answers[key]}"
        return ""

    def _collected(
        self, wanted: Sequence[T], come: Callable[[T], bool], request: Callable[[T], CrtpPacket], timeout: float
    ) -> list[T]:
        """Ask for things until all have come, or nothing more has for `timeout` s. Returns what has not come."""
        missing, under_way = list(wanted), list(wanted[:0])
        progress = asked = self.clock.now()
        while missing:
            now = self.clock.now()
            left = [one for one in missing if not come(one)]
            if len(left) < len(missing):
                missing, progress = left, now
            under_way = [one for one in under_way if not come(one)]
            if now - progress > timeout:
                break
            if missing and (not under_way or now - asked > AGAIN_S):
                under_way, asked = missing[:AT_ONCE], now
                for one in under_way:
                    self.send(request(one))
            self.poll(now)
            self.clock.sleep(0.002)
        return missing

    def _take(self, packet: CrtpPacket, now: float) -> None:
        data = packet.data
        match packet.port, packet.channel:
            case (port, 2) if port == LOGS and data[0] in self._blocks:
                at, values = 4, dict[str, float]()  # after the block's number come 3 bytes with the Crazyflie's time
                for one in self._blocks[data[0]]:
                    values[one.name] = one.value(data[at : at + one.size])
                    at += one.size
                self.latest[data[0]] = values, now
                self.counts[data[0]] = self.counts.get(data[0], 0) + 1
            case (port, 1) if port == LOGS:
                self._answers[data[: 1 if data[0] == RESET else 2]] = data[2]
            case (port, 0) if port in (LOGS, PARAMETERS) and data[0] == INFO:
                self._info[port] = data[1:7]
            case (port, 0) if port in (LOGS, PARAMETERS) and (found := entry(port, data)) is not None:
                self._tables.setdefault(port, {})[found.id] = found
            case (port, 1) if port == PARAMETERS and data[2] == 0:
                self._values[int.from_bytes(data[:2], "little")] = data[3:]
            case (port, 1) if port == PLATFORM:
                self._versions[data[0]] = data[1:]
            case (port, 0) if port == LINK_SERVICE:
                (sent,) = struct.unpack_from("<d", data)
                self.echoes.hear(sent, now)
            case _:
                pass
