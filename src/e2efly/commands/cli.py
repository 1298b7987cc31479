"""The command line: a table of commands. The file of a command is imported only when the command runs, and so is JAX.

The file `commands/NAME.py` holds a dataclass with the command's options, and `run(options)`, which returns the exit
status.
"""

import gc
import sys
from typing import NoReturn

from e2efly import __version__
from e2efly.commands.terminal import Terminal
from e2efly.config.names import nearest
from e2efly.flight.process import UNREAD, need_system, write_nowhere

_EXAMPLES = {
    "train hover": "learn to hover, evaluate, export policy.onnx",
    "train race --algo bptt": "another task, another algorithm",
    "eval runs/hover-bptt-0": "fly a policy from 1000 unseen starts, draw plots",
    "benchmark POLICY": "a card of anybody's policy: latency, stress, plants, from starts of its own",
    "watch hover": "fly a policy in a browser: drag its goal, throw it, change the wind",
    "ablate hover": "what each reward term is good for: a figure and a table",
    "sweep hover --seeds 5": "over seeds and options, side by side on Ray",
    "export RUN": "write policy.onnx from a checkpoint again",
    "export race --web DIR": "a page in which a policy flies, in any browser",
    "export race --c DIR": "a policy as C, for machines without Python",
    "validate POLICY": "fly it on another physics, or through the real firmware",
    "fly POLICY": "fly it on a Betaflight quadrotor",
    "hil POLICY": "put a real vehicle into a virtual world: poses in, images out",
    "fly-report LOG": "draw a flight",
    "identify flight LOG": "a vehicle file from flights, parts, a pendulum, a thrust stand",
    "predict LOG --vehicle FILE": "how well a vehicle file predicts a flight, beside trivial predictions",
    "build PARTS.toml": "from a list of parts to a vehicle file and the policies of six tasks",
    "tune LOG --task race": "from logs of your vehicle to a policy for it",
    "align LOG": "fit delay, rate loop and motor lag to a flight, lay its replay over it",
    "alignment-report FOLDER": "identification, latency, randomisation and noise on one page",
    "render forest": "what cameras and LiDARs see of a world: pictures and a video",
    "firmware": "build the real Betaflight firmware for this machine",
    "airsim-settings VEHICLE": "AirSim's settings.json for a vehicle",
    "bench": "how fast this machine simulates and learns (scores of policies: benchmark)",
    "completion bash": "a script with which bash or zsh completes what you type",
    "list": "tasks, vehicles, presets, algorithms; `list zoo`, `list rewards`, ... in full",
}
WHOLE = ("jax", "jaxlib", "jaxtyping", "matplotlib", "onnx", "optax", "safetensors", "scipy", "tensorboardX")
"""Packages that the distribution `e2efly` needs, but `e2efly-fly` (the part that flies, see onboard/) does not need."""
_MOVES = ("fly", "hil")
"""Commands that move a real vehicle."""
_SYSTEMS = {"fly": ("linux",), "hil": ("linux",), "firmware": ("linux",), "sweep": ("linux", "darwin")}
"""Operating systems on which a command runs, as `sys.platform` names them. The others run on every one."""
_MEANT = {
    "watch": ("play", "show", "view", "demo", "run", "simulate", "visualize"),
    "eval": ("test", "evaluate"),
    "benchmark": ("score", "rate", "card"),
    "train": ("learn", "fit"),
    "render": ("draw", "picture"),
}
"""Words that other programs use for a command."""
COMMANDS = dict.fromkeys(example.split()[0] for example in _EXAMPLES)
"""The names of all commands."""


def main() -> NoReturn:
    """Run the command line and exit: 0 when it did what was asked, 2 for bad input, 130 after Ctrl-C.

    When nobody reads its output any more, it ends silently with status 141.
    """
    # importing and tracing make many objects and no garbage: looking for it costs a third of a second
    gc.set_threshold(100_000)
    try:
        status = run(sys.argv[1:])
        sys.stdout.flush()
    except BrokenPipeError:  # whoever reads, as `head`, has enough
        write_nowhere()
        status = UNREAD
    sys.exit(status)


def run(arguments: list[str]) -> int:
    """Run one command; returns the exit status."""
    console = Terminal(stderr=True)
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_about())
        return 0
    if arguments[0] in ("-V", "--version"):
        print(__version__)
        return 0
    try:
        return _command(arguments[0], arguments[1:])
    except BrokenPipeError:
        raise
    except ModuleNotFoundError as error:
        missing = error.name or ""
        if missing.split(".")[0] not in WHOLE and not missing.startswith("e2efly."):
            raise
        console.print("error:", style="bold red", end=" ")
        console.print(
            f"`e2efly {arguments[0]}` needs {missing}, which is not installed: this is the part of e2efly that "
            "flies, e2efly-fly; accepted: `fly`, or an environment with the whole, `pip install e2efly`"
        )
        return 2
    except (ValueError, OSError, FloatingPointError, MemoryError, RuntimeError) as error:
        full = isinstance(error, MemoryError) or "RESOURCE_EXHAUSTED" in str(error)  # NumPy's word, and XLA's
        if isinstance(error, RuntimeError) and not full:
            raise
        console.print("error:", style="bold red", end=" ")
        console.print(f"{'out of memory: ' if full else ''}{error}")
        return 2
    except KeyboardInterrupt:
        console.print("interrupted")
        return 130


def _command(name: str, arguments: list[str]) -> int:
    if name not in COMMANDS:
        raise ValueError(_unknown(name))
    need_system(f"`e2efly {name}`", *_SYSTEMS.get(name, (sys.platform,)))
    from e2efly.commands.options import of_command

    module, options = of_command(name, arguments)
    return module.run(options)


def _unknown(name: str) -> str:
    """The error text for a command that does not exist. It never suggests one that moves a real vehicle."""
    words = {word: command for command, others in _MEANT.items() for word in (command, *others)}
    words |= {command: command for command in COMMANDS if command not in _MOVES}
    guess = nearest(name, words)
    hint = f"; did you mean {words[guess]!r}?" if guess else ""
    return f"unknown command {name!r}{hint} (there are: {', '.join(sorted(COMMANDS))})"


def _about() -> str:
    lines = "\n".join(f"  e2efly {example:<24} {what}" for example, what in _EXAMPLES.items())
    return (
        f"e2efly {__version__}: train an end-to-end quadrotor policy in seconds, check it, and fly it.\n\n{lines}\n\n"
        "`e2efly COMMAND --help` tells what a command does; `--help-all` lists every option of it."
    )
