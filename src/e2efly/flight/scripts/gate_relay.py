"""Finds the corners of gates in the images of a camera, and passes them on as lines of text.

It runs in a separate process, because that takes milliseconds that the control loop does not have. Its arguments are
the camera's image as a contract's JSON, and the image source. It writes the lines of `speech.py`, and for each image
`message RECEIVED JSON`: the time of arrival on the monotonic clock, s, and `stamp`, `pixel` and `inward`.
"""

import json
import sys
import time

import numpy as np
from speech import Speech, main  # type: ignore[import-not-found]

from e2efly.flight.sight.gate_corners import gate_corners
from e2efly.flight.sight.segment import opencv
from e2efly.flight.sight.sources import open_image
from e2efly.policy.images import Image

WAIT_S = 0.001
"""Time between two checks for a new image, s."""


def relay(speech: Speech, about: str, uri: str) -> None:
    """Open the source, and pass on the corners of each image until the other process ends."""
    image = Image.of_json(json.loads(about), "image")
    opencv().setNumThreads(1)  # more would take the cores of the control loop
    source, told = open_image(uri, image), None
    try:
        speech.say("ready", source.describe())
        while not speech.closing.is_set():
            frames = source.read(time.monotonic())
            if source.problem != told:
                told = source.problem
                words = ("problem", told) if told else ("solved",)
                speech.say(*words)
            for frame in frames:
                found = gate_corners(np.asarray(frame.image))
                content = {"stamp": frame.time, "pixel": found.pixel.tolist(), "inward": found.inward.tolist()}
                speech.say("message", repr(time.monotonic()), json.dumps(content))
            if not frames:
                speech.closing.wait(WAIT_S)
    finally:
        source.close()


if __name__ == "__main__":
    main({"gates": relay}, ["gates", *sys.argv[1:]])
