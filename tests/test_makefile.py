"""The Makefile's targets that nobody tries twice."""

import subprocess
from pathlib import Path


def test_clean_leaves_what_was_learned_alone() -> None:
    """Runs took hours; what is built is built again in minutes."""
    command = ["make", "--no-print-directory", "--dry-run", "clean"]
    done = subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("rm -rf ")
    assert "runs" not in done.stdout.split()
