"""Which camera shows what of a policy's contract: `--image NAME=URI`."""

from collections.abc import Sequence

from e2efly.deploy.policy.contract import Contract
from e2efly.deploy.policy.images import Image
from e2efly.deploy.sight.shared import SharedCamera
from e2efly.deploy.sight.source import ImageSource
from e2efly.registry import check_methods, load, referenced

METHODS = ("problem", "read", "close", "describe")
"""What an image source must have."""
FORMS = "shm:NAME; or path/to/file.py:Name[:...]"
"""How sources are written."""


def open_cameras(texts: Sequence[str], contract: Contract) -> list[ImageSource]:
    """The cameras of a policy, in the order of its contract.

    Args:
        texts: NAME=URI of each of its images.
        contract: of the policy.

    Raises:
        ValueError: naming the image or the text and what is accepted.
    """
    chosen = by_image(texts, contract)
    if lacking := [image for image in contract.images if image.name not in chosen]:
        image = lacking[0]
        raise ValueError(
            f"image {image.name!r} ({image.sees}, {image.height} rows, {image.width} columns): there is no camera; "
            f"accepted: --image {image.name}=URI, with URI {FORMS}"
        )
    return [_opened(chosen[image.name], image) for image in contract.images]


def by_image(texts: Sequence[str], contract: Contract) -> dict[str, str]:
    """NAME=URI of each image as URI by name.

    Raises:
        ValueError: naming the text and what is accepted: no such image, or one twice.
    """
    wanted = [image.name for image in contract.images]
    chosen: dict[str, str] = {}
    for text in texts:
        name, _, where = text.partition("=")
        if name not in wanted or not where:
            accepted = f"NAME=URI, NAME one of {', '.join(wanted)}" if wanted else "none, as the policy sees nothing"
            raise ValueError(f"--image is {text!r}; accepted: {accepted}")
        if name in chosen:
            raise ValueError(f"--image {name} is {chosen[name]!r} and {where!r}; accepted: one URI for each image")
        chosen[name] = where
    return chosen


def _opened(text: str, image: Image) -> ImageSource:
    kind, _, where = text.partition(":")
    if kind == "shm":
        return SharedCamera(where, image)
    if found := referenced(text):
        source = load(found[0])(found[1], image)
        check_methods(source, METHODS)
        return source
    raise ValueError(f"--image {image.name} is {text!r}; accepted: {FORMS}")
