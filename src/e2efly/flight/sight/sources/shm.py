"""Images that another program on this computer publishes in shared memory."""

from e2efly.flight.sight.registry import register
from e2efly.flight.sight.shared import SharedCamera
from e2efly.policy.images import Image


@register("shm", "shm:NAME")
def open_shm(where: str, image: Image) -> SharedCamera:
    """Read the images that are published under a name."""
    return SharedCamera(where, image)
