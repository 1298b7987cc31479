"""What the tests of the documentation share: pages, and running what stands on them."""

import os
import re
import subprocess
import sys
from pathlib import Path

from tests.conftest import QUICK

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))

BRIEF = """
e2efly() {
  case "$1" in
    train) python -m e2efly "$@" --steps 20000 --no-plots ;;
    eval | validate) case "$*" in
      *betaflight*) python -m e2efly "$@" ;;
      *) python -m e2efly "$@" --episodes 2 ;;
    esac ;;
    *) python -m e2efly "$@" ;;
  esac
}
"""
"""The commands of a page, but with few steps and episodes: the last value of an option counts."""
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(page: Path) -> list[tuple[str, str]]:
    """What a page asks its reader to run, in order: (sh or python, code)."""
    return BLOCK.findall(page.read_text(encoding="utf-8"))


def needs_firmware(code: str) -> bool:
    return "betaflight" in code or "e2efly firmware" in code


def run_block(language: str, code: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    """Run it in a folder, as the reader would who has activated the virtual environment."""
    environment = os.environ | {
        "XLA_FLAGS": QUICK,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    }
    if language == "python":
        (folder / "block.py").write_text(code, encoding="utf-8")
        command = [sys.executable, "block.py"]
    else:
        command = ["bash", "-euo", "pipefail", "-c", BRIEF + code]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
