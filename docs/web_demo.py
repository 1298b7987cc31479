"""A step of the site's build: the page of the race that its front page shows."""

import subprocess
import sys
from pathlib import Path
from typing import Any


def on_post_build(config: Any) -> None:
    """Write the page into the built site.

    Raises:
        subprocess.CalledProcessError: when the export fails, with what it said.
    """
    folder = Path(config["site_dir"]) / "race"
    subprocess.run([sys.executable, "-m", "e2efly", "export", "race", "--web", str(folder)], check=True)
