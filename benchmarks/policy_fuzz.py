"""Policies under fuzzing: files of the zoo with changed bytes, fields and contracts, with a digest that fits them.

Each must load and act, or be refused by a `ValueError` that names the file. Anything else, and a file that takes longer
than a second of the processor, ends the run. ONNX Runtime runs in this process, without the trial in another one that
`load_policy` makes for files that are new to a machine: what the checks let through must be harmless by itself.
"""

import faulthandler
import random
import tempfile
import time
from collections import Counter
from pathlib import Path

import common
import numpy as np
from tests.policy_mutations import mutated_policy

from e2efly.policy import loader, onnx_session
from e2efly.policy.random_inputs import random_images, random_observations
from e2efly.policy.zoo import FOLDER

LIMIT = 1.0
"""Longest time of the processor for a file, s."""


def main() -> None:
    """Fuzz, and write figures."""
    args = common.arguments(__doc__ or "", count=10_000, seed=0)
    rng, draws = random.Random(args.seed), np.random.default_rng(args.seed)
    files = [path.read_bytes() for path in sorted(FOLDER.glob("*/*.onnx"))]
    onnx_session._try_out = lambda content, inputs: None
    onnx_session.remember = lambda content: None
    found, slowest = Counter(), 0.0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "policy.onnx"
        for number in range(args.count):
            path.write_bytes(mutated_policy(rng.choice(files), rng))
            faulthandler.dump_traceback_later(30, exit=True)
            start = time.process_time()
            found[outcome(path, draws)] += 1
            slowest = max(slowest, time.process_time() - start)
            if slowest > LIMIT:
                raise SystemExit(f"file {number} of seed {args.seed} took {slowest:.1f} s")
    faulthandler.cancel_dump_traceback_later()
    rows = [{"outcome": name, "files": count} for name, count in found.most_common()]
    print(common.table(rows), f"slowest: {slowest:.2f} s", sep="\n")
    common.write("policy_fuzz", args.json, {"table": rows, "slowest_s": slowest})


def outcome(path: Path, draws: np.random.Generator) -> str:
    """How a file fares. Raises every error that a user must not see."""
    try:
        policy = loader.load_policy(path)
    except ValueError as error:
        assert str(error).startswith(f"{path}: "), error
        said = str(error).removeprefix(f"{path}: ").partition(":")[0]
        return "refused: " + " ".join(word for word in said.split()[:4] if word.isalpha())
    contract = policy.contract
    images = [random_images(draws, image, 2) for image in contract.images]
    try:
        action, memory = policy.act(random_observations(draws, contract.observation, 2), images)
        assert np.isfinite(action).all()
        assert np.isfinite(memory).all()
    except ValueError:
        return "loaded, its action refused"
    return "loaded, flies"


if __name__ == "__main__":
    main()
