"""Record what Betaflight of several versions, set as docs/hardware.md asks, says: `tests/data/msp_releases.json`.

It takes the paths of SITL programs, and keeps what was recorded of others:

    python -m tests.flight.record_releases PATH/TO/betaflight_SITL ...
"""

import json
import sys
import tempfile
from pathlib import Path

from e2efly.flight.betaflight import settings_by_name
from e2efly.flight.betaflight.client import MESSAGES, Client, ask
from e2efly.flight.betaflight.codec import Decoder, encode
from e2efly.flight.betaflight.controller import identify
from e2efly.flight.link import Link, open_link
from e2efly.validation import binary
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle

RELEASES = Path(__file__).parents[1] / "data" / "msp_releases.json"


class Recorder:
    """A link that keeps the frames that come."""

    def __init__(self, inner: Link) -> None:
        self.inner, self.decoder = inner, Decoder()
        self.frames: dict[int, bytes] = {}

    def receive(self) -> bytes:
        data = self.inner.receive()
        for frame in self.decoder.feed(data):
            self.frames[frame.code] = encode(frame)
        return data

    def __getattr__(self, name: str) -> object:
        return getattr(self.inner, name)


def record(program: Path) -> tuple[str, dict[str, str]]:
    """The version, and its replies by code."""
    with tempfile.TemporaryDirectory() as text, Rig(binary.keep(program), Path(text), load_vehicle("vis_r")) as rig:
        link = Recorder(open_link(rig.sitl.msp))
        client = Client(link)  # type: ignore[arg-type]
        for code in MESSAGES:
            ask(client, code, 5.0, clock=rig)
        info = identify(client, 5.0, clock=rig)
        told = {}
        for name, _ in info.by_name:
            ask(client, settings_by_name.CODE, 5.0, settings_by_name.request(name), clock=rig)
            told[f"{settings_by_name.CODE} {name}"] = link.frames[settings_by_name.CODE].hex()
        link.inner.close()
    return info.firmware, {str(code): link.frames[code].hex() for code in MESSAGES} | told


if __name__ == "__main__":
    kept = json.loads(RELEASES.read_text()) if RELEASES.is_file() else {}
    kept |= dict(record(Path(path)) for path in sys.argv[1:])
    RELEASES.write_text(json.dumps(kept, indent=1) + "\n")
