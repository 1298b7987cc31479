"""The kinds of image sources, one file each, and which one serves each image of a policy's contract: `--image
NAME=URI`.
"""

import importlib
import pkgutil
from collections.abc import Sequence

from e2efly.config.registry import check_methods
from e2efly.flight.pose.registry import selected
from e2efly.flight.sight.image_source import ImageSource
from e2efly.flight.sight.registry import METHODS, SOURCES
from e2efly.policy.contract import Contract
from e2efly.policy.images import Image

for _file in pkgutil.iter_modules(__path__, f"{__name__}."):
    importlib.import_module(_file.name)


def forms() -> str:
    """How sources are written."""
    return "; ".join(kind.form for kind in SOURCES.values()) + "; or path/to/file.py:Name[:...]"


def open_cameras(texts: Sequence[str], contract: Contract) -> list[ImageSource]:
    """The cameras of a policy, in the order of its contract. `texts` has NAME=URI for each of its images.

    Raises:
        ValueError: naming the image or the text and what is accepted.
    """
    chosen = by_image(texts, contract)
    if lacking := [image for image in contract.images if image.name not in chosen]:
        image = lacking[0]
        raise ValueError(f"{image.lacking}; accepted: --image {image.name}=URI, with URI {forms()}")
    cameras: list[ImageSource] = []
    try:
        for image in contract.images:
            cameras.append(open_image(chosen[image.name], image))
    except BaseException:
        for camera in cameras:
            camera.close()
        raise
    return cameras


def by_image(texts: Sequence[str], contract: Contract) -> dict[str, str]:
    """The URI of each image by its name, from texts of the form NAME=URI.

    Raises:
        ValueError: naming the text and what is accepted: an unknown image, or an image that is given twice.
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


def open_image(text: str, image: Image) -> ImageSource:
    """Open an image source: NAME:... of a registered kind, also of an installed package, written as its form says. Or a
    reference to a class or a function, path/to/file.py:Name or module:Name, optionally followed by another colon and
    the text that it is given. `image` is the camera of the policy's contract.

    Raises:
        ValueError: naming the text and what is accepted, or with what the source reports about its failure.
    """
    if chosen := selected(SOURCES, text):
        kind, where = chosen
        source = kind.open(where, image)
        check_methods(source, METHODS)
        return source
    raise ValueError(f"--image {image.name} is {text!r}; accepted: {forms()}")
