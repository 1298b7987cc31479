"""What ROS 1 and ROS 2 have in common: images are given on a topic, and a subscriber tells what it got."""

import json
import math
import subprocess
import time

import numpy as np

from e2efly.flight.sight.outputs import Output, give
from e2efly.flight.sight.shared import SharedImages, place
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file

CAMERA = load_policy(policy_file("avoid")).contract.images[0]


def check_given(kind: str, python: str, subscriber: str) -> None:
    """Depth arrives in metres, with the time of its exposure and its camera.

    Args:
        kind: ros1 or ros2.
        python: the interpreter of the subscriber.
        subscriber: its program; it prints an `image` and an `info` as JSON.
    """
    name = f"e2efly-test-give-{kind}"
    place(name).unlink(missing_ok=True)
    shared = SharedImages(name, CAMERA.shape)
    shown = np.random.default_rng(0).uniform(0, 10, CAMERA.shape).astype(np.float32)
    giver = give(CAMERA, name, Output(kind, "/front/image"), "")
    listener = subprocess.Popen([python, "-c", subscriber], stdout=subprocess.PIPE, text=True)
    try:
        end = time.monotonic() + 60
        while listener.poll() is None and time.monotonic() < end:
            shared.publish(time.monotonic() - 0.5, shown)
            time.sleep(0.05)
        got = json.loads(listener.stdout.readline())
    finally:
        listener.kill()
        listener.communicate()
        giver.close()
        shared.close()
        place(name).unlink()
    encoding, height, width, step, frame, stamp, data = got["image"]
    assert (encoding, height, width, step, frame) == ("32FC1", *CAMERA.shape, 4 * CAMERA.width, "image_0")
    assert 0.4 < time.time() - stamp < 10  # of the exposure, by the wall clock
    np.testing.assert_array_equal(np.frombuffer(bytes(data), "<f4").reshape(CAMERA.shape), shown)
    k, *size, of = got["info"]
    assert (size, of) == (list(CAMERA.shape), "image_0")
    np.testing.assert_allclose(CAMERA.width / 2 / k[0], math.tan(CAMERA.fov_rad[0] / 2))  # the definition of a pinhole
    np.testing.assert_allclose(CAMERA.height / 2 / k[4], math.tan(CAMERA.fov_rad[1] / 2))
