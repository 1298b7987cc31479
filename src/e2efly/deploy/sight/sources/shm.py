"""Images that another program on this computer publishes in shared memory."""

from e2efly.deploy.policy.images import Image
from e2efly.deploy.sight.registry import register
from e2efly.deploy.sight.shared import SharedCamera


@register("shm", "shm:NAME")
def open_shm(where: str, image: Image) -> SharedCamera:
    """Read the images that are published under a name."""
    return SharedCamera(where, image)
