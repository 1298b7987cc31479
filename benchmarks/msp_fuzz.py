"""MSP codec under fuzzing: random bytes and mutated frames of real firmware through decoder and message parsers.

Between one piece of fuzz and the next lies one good frame, after a silence: each must be found. Anything but a
`ValueError` of a parser ends the run.
"""

import json
import random
import time
from collections.abc import Callable
from pathlib import Path

import common
from tests.mutations import mutated

from e2efly.flight.betaflight.client import MESSAGES
from e2efly.flight.betaflight.codec import REPLY, Decoder, MspFrame, encode

GOLDEN = Path(__file__).parents[1] / "tests" / "data" / "msp_golden.json"
STARTS = (b"$", b"$M>", b"$X<", b"\xff\xff")


def sources(frames: list[bytes], rng: random.Random) -> dict[str, Callable[[], bytes]]:
    """Kinds of fuzz."""
    return {
        "random": lambda: rng.randbytes(rng.randint(1, 4000)),
        "mutated": lambda: b"".join(
            mutated(rng.choice(frames), rng, frames, STARTS) for _ in range(rng.randint(1, 60))
        ),
        "starts": lambda: b"".join(
            rng.choice([b"$", b"$M>", b"$X>", b"$M>\xff\x01", b"$M!", b"\x20", rng.randbytes(2)])
            for _ in range(rng.randint(1, 800))
        ),
    }


def main() -> None:
    """Fuzz, and write figures."""
    args = common.arguments(__doc__ or "", size=10_000_000, seed=0)
    rng = random.Random(args.seed)
    replies = json.loads(GOLDEN.read_text())["replies"]
    frames = [bytes.fromhex(data) for of_version in replies.values() for data in of_version.values()]
    rows = []
    for name, piece in sources(frames, rng).items():
        decoder, size, found, parsed, refused, pieces, good_found, busy = Decoder(), 0, 0, 0, 0, 0, 0, 0.0
        while size < args.size / 3:
            fuzz, good = piece(), MspFrame(rng.randrange(255), rng.randbytes(rng.randrange(300)), REPLY)
            cut = rng.randint(0, len(fuzz))
            start = time.perf_counter()
            seen = decoder.feed(fuzz[:cut]) + decoder.feed(fuzz[cut:]) + decoder.flush()
            last = decoder.feed(encode(good))
            for frame in seen:
                # fuzzed payloads under every message's eyes, good checksum or not
                for code in (frame.code, rng.choice(list(MESSAGES))):
                    try:
                        parsed += code in MESSAGES and MESSAGES[code].parse(frame.payload) is not None
                    except ValueError:
                        refused += 1
            busy += time.perf_counter() - start
            for code in MESSAGES:
                try:
                    MESSAGES[code].parse(fuzz[: rng.randrange(64)])
                    parsed += 1
                except ValueError:
                    refused += 1
            size, pieces, found = size + len(fuzz), pieces + 1, found + len(seen)
            good_found += last == [good]
        row = {
            "fuzz": name,
            "bytes": size,
            "MB/s": round(size / busy / 1e6, 2),
            "frames in it": found,
            "bad checksums": decoder.bad_checksums,
            "parsed": parsed,
            "refused": refused,
            "next good frame found": f"{good_found} of {pieces}",
        }
        rows.append(row)
        if good_found != pieces:
            raise SystemExit(f"{name}: {pieces - good_found} good frames were lost; seed {args.seed}")
    print(common.table(rows))
    common.write("msp_fuzz", args.json, {"table": rows})


if __name__ == "__main__":
    main()
