"""Rotor speeds over MSP on the rig. The SITL measures none; a controller with such ESCs would report them."""

import math
import struct
from dataclasses import dataclass, field, replace

from e2efly.flight.betaflight.codec import Decoder, encode
from e2efly.flight.betaflight.messages import MotorTelemetry
from e2efly.flight.link import Link
from e2efly.validation.rig import Rig


@dataclass
class SpeedLink:
    """A link whose motor messages from the firmware contain the rotor speeds of the rig."""

    link: Link
    """The link to the firmware."""
    rig: Rig
    """The rig with the rotors."""
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
        """The firmware's answers, with rotor speeds added to those about its motors."""
        frames = self._decoder.feed(self.link.receive())
        told = (replace(f, payload=self._speeds()) if f.code == MotorTelemetry.CODE else f for f in frames)
        return b"".join(map(encode, told))

    def close(self) -> None:
        """See `Link`."""
        self.link.close()

    def _speeds(self) -> bytes:
        turns = (round(float(speed) * 60 / math.tau) for speed in self.rig.state.rotor_speed)
        return struct.pack("<B" + "I9x" * 4, 4, *turns)
