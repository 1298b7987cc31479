"""The speeds of the rotors over MSP on the rig: the SITL measures none, and a controller with such ESCs would."""

import math
import struct
from dataclasses import dataclass, field, replace

from e2efly.deploy.betaflight.codec import Decoder, encode
from e2efly.deploy.betaflight.link import Link
from e2efly.deploy.betaflight.messages import MotorTelemetry
from e2efly.validation.rig import Rig


@dataclass
class SpeedLink:
    """A link on which the firmware's answers about its motors tell how fast the rig's rotors turn."""

    link: Link
    """To the firmware."""
    rig: Rig
    """Whose rotors they are."""
    _decoder: Decoder = field(default_factory=Decoder)

    @property
    def alive(self) -> bool:
        """See `Link`."""
        return self.link.alive

    @property
    def reason(self) -> str:
        """See `Link`."""
        return self.link.reason

    @property
    def connections(self) -> int:
        """See `Link`."""
        return self.link.connections

    def poll(self, now: float) -> None:
        """See `Link`."""
        self.link.poll(now)

    def send(self, data: bytes) -> None:
        """See `Link`."""
        self.link.send(data)

    def receive(self) -> bytes:
        """What the firmware answers, with the speeds where it tells of its motors."""
        frames = self._decoder.feed(self.link.receive())
        told = (replace(f, payload=self._speeds()) if f.code == MotorTelemetry.CODE else f for f in frames)
        return b"".join(map(encode, told))

    def close(self) -> None:
        """See `Link`."""
        self.link.close()

    def _speeds(self) -> bytes:
        turns = (round(float(speed) * 60 / math.tau) for speed in self.rig.state.rotor_speed)
        return struct.pack("<B" + "I9x" * 4, 4, *turns)
