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
from e2efly.deploy.sight.segment import chosen, opencv
from e2efly.deploy.sight.watch import Seen, see

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


def capture(output: Any, where: str) -> None:
    """What the process does: a kind of `process/capture.py`.

    A camera that is covered or frozen would give masks that look like those of a ground without the object, so colours
    are checked as those of a policy would be: of what does not pass there is no mask.

    Args:
        output: of that script.
        where: JSON: `segmenter`, `uri` and `image`, the camera of the policy's contract.

    Raises:
        ValueError: where either does not open.
    """
    from e2efly.deploy.sight.sources import open_image  # which imports this module's source

    asked = json.loads(where)
    camera, segmenter = colours_for(Image.of_json(asked["image"], "image")), chosen(asked["segmenter"])
    opencv().setNumThreads(1)  # more would take the cores of the control loop
    source, told = open_image(asked["uri"], camera), None
    try:
        seen = Seen(camera)
        while not output.speech.closing.is_set():
            now = time.monotonic()
            frames = source.read(now)[-1:]
            if frames and seen.frame is None:
                height, width = frames[0].image.shape[:2]
                seen = Seen(dataclasses.replace(camera, height=height, width=width))
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
