"""Masks made of the colours of another image source.

Finding a tag takes milliseconds and needs the camera's own resolution, so it happens before the image is resampled, in
a process of its own: that opens the other source and publishes masks, which the bridge reads as any camera's images.
"""

import dataclasses
import json
import time
from typing import Any

import numpy as np

from e2efly.deploy.policy.images import NONE, Image
from e2efly.deploy.sight.segment import Segmenter, chosen, opencv
from e2efly.deploy.sight.source import Frame

WAIT_S = 0.001
"""Between two looks for a new image, s."""
FORM = "mask:apriltag:FAMILY[:ID[xFACTOR],...]@URI, mask:colour:H,S,V,H,S,V@URI or mask:onnx[:FILE]@URI"


def parts_of(text: str) -> tuple[str, str]:
    """SEGMENTER@URI as its two parts; the first @ parts them.

    Raises:
        ValueError: where one is missing.
    """
    segmenter, _, uri = text.partition("@")
    if not segmenter or not uri:
        raise ValueError(f"image source mask:{text} lacks {'its URI' if segmenter else 'SEGMENTER'}; accepted: {FORM}")
    return segmenter, uri


def colours_for(image: Image) -> Image:
    """The camera that a mask is made of: that of the policy, in colours, with all pixels that the source has.

    Raises:
        ValueError: for a policy that sees no mask.
    """
    if image.sees != "mask":
        raise ValueError(f"image {image.name!r} is {image.sees}; accepted with a source mask:...: a mask")
    return dataclasses.replace(image, sees="rgb", of=NONE, encoding=NONE, width=0, height=0, pool=(0, 0))


def segmented(frame: Frame, segmenter: Segmenter) -> np.ndarray:
    """The mask of a frame, uint8 (h, w), 255 for 1.

    Args:
        frame: colours in [0, 1], (h, w, 3); grey, (h, w), is taken as colours.
        segmenter: makes the mask.

    Raises:
        ValueError: for values that are no colours.
    """
    image = frame.image if frame.image.ndim == 3 else np.repeat(frame.image[..., None], 3, axis=-1)
    if not (image.min() >= 0 and image.max() <= 1):  # false for NaN
        raise ValueError(f"gives values from {image.min():g} to {image.max():g}; accepted: colours in [0, 1]")
    return 255 * segmenter(np.round(255 * image).astype(np.uint8))


def capture(output: Any, where: str) -> None:
    """What the process does: a kind of `process/capture.py`.

    Args:
        output: of that script.
        where: JSON: `segmenter`, `uri` and `image`, the camera of the policy's contract.

    Raises:
        ValueError: where either does not open, or the other source gives no colours.
    """
    from e2efly.deploy.sight.sources import open_image  # which imports this module's source

    asked = json.loads(where)
    image = Image.of_json(asked["image"], "image")
    segmenter = chosen(asked["segmenter"])
    opencv().setNumThreads(1)  # more would take the cores of the control loop
    source = open_image(asked["uri"], colours_for(image))
    try:
        told = None
        while not output.speech.closing.is_set():
            frames = source.read(time.monotonic())
            if source.problem != told and source.problem:
                output.speech.say("problem", source.problem)
            told = source.problem
            if not frames:
                output.speech.closing.wait(WAIT_S)
                continue
            mask = segmented(frames[-1], segmenter)
            detail = f"{segmenter.describe()}; {source.describe()}"
            output.put(frames[-1].time, mask.tobytes(), mask.shape, "uint8", (0.0, 0.0), detail)
    finally:
        source.close()
