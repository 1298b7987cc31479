"""Masks made from the colours of another image source.

Finding a tag takes milliseconds and needs the camera's own resolution. It is therefore done before the image is
resampled, in a separate process. That process opens the other source and publishes masks, which the bridge reads like
the images of any camera.
"""

import dataclasses
import json
import time
from typing import Any

import numpy as np

from e2efly.flight.sight.quality import SeenImages, see
from e2efly.flight.sight.segment import chosen, opencv
from e2efly.policy.images import NONE, Image

WAIT_S = 0.001
"""Time between two checks for a new image, s."""
FORM = "mask:apriltag:FAMILY[:ID[xFACTOR],...]@URI, mask:colour:H,S,V,H,S,V@URI or mask:onnx[:pads|:gates|:FILE]@URI"


def parts_of(text: str) -> tuple[str, str]:
    """Split SEGMENTER@URI into its two parts at the first @.

    Raises:
        ValueError: if one part is missing.
    """
    segmenter, _, uri = text.partition("@")
    if not segmenter or not uri:
        raise ValueError(f"image source mask:{text} lacks {'its URI' if segmenter else 'SEGMENTER'}; accepted: {FORM}")
    return segmenter, uri


def colours_for(image: Image) -> Image:
    """The camera from which a mask is made: the policy's camera, in colours, with all pixels that the source has.

    Raises:
        ValueError: for a policy that sees no mask.
    """
    if image.sees != "mask":
        raise ValueError(f"image {image.name!r} is {image.sees}; accepted with a source mask:...: a mask")
    return dataclasses.replace(image, sees="rgb", of=NONE, encoding=NONE, width=0, height=0, pool=(0, 0))


def capture(output: Any, where: str) -> None:
    """Run the process: a kind of `scripts/capture.py`.

    A camera that is covered or frozen would give masks that look like masks of a ground without the object. Colours are
    therefore checked like the colours of a policy. An image that fails the checks gives no mask. `where` is JSON with
    `segmenter`, `uri` and `image`, the camera of the policy's contract.

    Raises:
        ValueError: if the segmenter or the source does not open.
    """
    from e2efly.flight.sight.sources import open_image  # which imports this module's source

    asked = json.loads(where)
    camera, segmenter = colours_for(Image.of_json(asked["image"], "image")), chosen(asked["segmenter"])
    opencv().setNumThreads(1)  # more would take the cores of the control loop
    source, told = open_image(asked["uri"], camera), None
    try:
        seen = SeenImages(camera)
        while not output.speech.closing.is_set():
            now = time.monotonic()
            frames = source.read(now)[-1:]
            if frames and seen.frame is None:
                height, width = frames[0].image.shape[:2]
                seen = SeenImages(dataclasses.replace(camera, height=height, width=width))
            seen = see(seen, frames, now, trouble=source.problem)
            problem = seen.problem(now) if frames else source.problem
            if problem != told and problem:
                output.speech.say("problem", problem)
            told = problem
            if frames and not problem and seen.frame is not None:
                mask = 255 * segmenter(np.round(255 * seen.frame.image).astype(np.uint8))
                detail = f"{segmenter.describe()}; {source.describe()}"
                output.put(seen.frame.time, mask.tobytes(), mask.shape, "uint8", (0.0, 0.0), detail)
            if not frames:
                output.speech.closing.wait(WAIT_S)
    finally:
        source.close()
