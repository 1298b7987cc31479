"""The recording of hardware in the loop is read back; what it cannot take is dropped."""

import base64
import json
import socket
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader

from e2efly.flight.sight.recorder import Recorder
from e2efly.flight.sight.shared import SharedImages, place
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.viewing.latencies import plot_latencies
from tests.waiting import free_port

CAMERA = load_policy(policy_file("avoid")).contract.images[0]
NAME = "e2efly-test-record"


def test_images_and_messages_are_read_back(tmp_path: Path) -> None:
    place(NAME).unlink(missing_ok=True)
    shared = SharedImages(NAME, CAMERA.shape)
    path = tmp_path / "flight" / "hil.mcap"
    recorder = Recorder(path, [CAMERA], [NAME])
    shown = np.random.default_rng(0).uniform(0, 10, CAMERA.shape).astype(np.float32)
    began = time.monotonic()
    for k in range(3):
        shared.publish(began + 0.1 * k, shown)
        recorder.tell("shown", {"time": began + 0.1 * k, "position": [1, 2, 3], "pose_to_image": 0.004})
        time.sleep(0.3)
    recorder.tell("event", {"time": began + 1, "text": "virtual collision"})
    time.sleep(0.2)
    recorder.close()
    shared.close()
    place(NAME).unlink()
    assert recorder.dropped == 0
    with path.open("rb") as file:
        read = [(s.name, c.topic, m.log_time, json.loads(m.data)) for s, c, m in make_reader(file).iter_messages()]
    images = [(at, message) for schema, _, at, message in read if schema == "foxglove.CompressedImage"]
    assert len(images) == 3
    np.testing.assert_allclose(np.diff([at for at, _ in images]), 1e8, atol=1e3)
    picture = np.frombuffer(base64.b64decode(images[0][1]["data"]), np.uint8)
    depth = cv2.imdecode(picture, cv2.IMREAD_UNCHANGED)
    assert depth is not None and depth.dtype == np.uint16
    np.testing.assert_allclose(1e-3 * depth, shown, atol=0.51e-3)
    assert [m["position"] for _, topic, _, m in read if topic == "shown"] == [[1, 2, 3]] * 3
    assert [m["text"] for _, topic, _, m in read if topic == "event"] == ["virtual collision"]
    recorder.tell("event", {"time": 0.0, "text": "late"})  # nobody is there: it neither waits nor raises
    assert recorder.dropped == 1
    with pytest.raises(ValueError, match=r"hil.mcap; accepted: a new file whose name ends in .mcap"):
        Recorder(path, [CAMERA], [NAME])


@pytest.mark.whole
def test_the_command_writes_a_recording_and_a_report(tmp_path: Path) -> None:
    port, tcp = free_port(udp=True), free_port()
    recording, report = tmp_path / "hil.mcap", tmp_path / "report"
    command = [sys.executable, "-m", "e2efly", "hil", "avoid", "--pose", f"udp:{port}", "--seconds", "2"]
    command += ["--image", f"image_0=tcp:{tcp}", "--record", str(recording), "--report", str(report)]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as node,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out,
    ):
        while node.poll() is None:
            now = time.monotonic()
            pose = {"position": [0, 1e-3 * (now % 1), 3], "quaternion": [1, 0, 0, 0], "velocity": [0, 0, 0]}
            out.sendto(json.dumps({**pose, "body_rate": [0, 0, 0], "stamp": now}).encode(), ("127.0.0.1", port))
            time.sleep(0.01)
        assert node.stdout is not None
        said = " ".join(node.stdout.read().split())
    assert node.returncode == 0, said
    assert f"--image image_0=hil:127.0.0.1:{tcp}" in said
    numbers = json.loads((report / "latency.json").read_text())
    assert 0 < numbers["p50_s"] <= numbers["p99_s"] <= numbers["max_s"]
    assert (report / "latency.png").stat().st_size > 5000
    with recording.open("rb") as file:
        topics = [(c.topic, json.loads(m.data)) for _, c, m in make_reader(file).iter_messages()]
    late = [message["pose_to_image"] for topic, message in topics if topic == "shown"]
    assert max(late) == pytest.approx(numbers["max_s"])
    assert sum(topic == "image_0" for topic, _ in topics) > 0
    assert not list(Path(place("x")).parent.glob(f"e2efly_hil-{node.pid}-*"))


def test_the_picture_of_latencies_says_its_quantiles(tmp_path: Path) -> None:
    plot_latencies(np.linspace(0.001, 0.010, 100), 30.0, tmp_path / "late.png")
    assert cv2.imread(str(tmp_path / "late.png")) is not None
