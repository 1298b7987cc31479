"""Masks of an object that another source sees."""

import dataclasses
import json
import sys

from e2efly.flight.sight.captured import Captured, open_captured
from e2efly.flight.sight.mask_source import FORM, colours_for, parts_of
from e2efly.flight.sight.registry import register
from e2efly.flight.sight.segment import chosen
from e2efly.policy.images import Image

ADVICE = f"accepted: {FORM}, with the URI of a source of colours"


@register("mask", "mask:SEGMENTER@URI")
def open_mask(text: str, image: Image) -> Captured:
    """Open the other source in a process that makes masks of its images. `text` is written as
    `e2efly.flight.sight.mask_source.FORM`. The camera of the policy's contract has to be a mask.

    Raises:
        ValueError: for a policy that sees no mask, with what is wrong with the segmenter, or with what the process
            reports about the other source.
    """
    segmenter, uri = parts_of(text)
    colours_for(image)
    chosen(segmenter)  # report its problems before a process starts
    where = json.dumps({"segmenter": segmenter, "uri": uri, "image": dataclasses.asdict(image)})
    return open_captured(f"mask:{text}", image, [sys.executable], ADVICE, where, "policy")
