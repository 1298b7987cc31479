"""Images of the training beside a policy's file."""

import dataclasses
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from e2efly.flight.sight.picture import GAP, sheet
from e2efly.flight.sight.samples import COUNT, LARGEST, packed, read_samples, samples_file
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file

IMAGE = load_policy(policy_file("avoid")).contract.images[0]


def test_images_lie_beside_the_policy(tmp_path: Path) -> None:
    policy = tmp_path / "policy.onnx"
    assert read_samples(policy, IMAGE) is None
    images = np.random.default_rng(0).uniform(0, 6, (COUNT + 2, *IMAGE.shape)).astype(np.float32)
    samples_file(policy).write_bytes(packed({IMAGE.name: images}))
    found = read_samples(policy, IMAGE)
    assert found is not None
    np.testing.assert_allclose(found, images[:COUNT], rtol=1e-3)
    assert read_samples(policy, dataclasses.replace(IMAGE, name="other")) is None


def _archive(name: str, content: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, content)
    return file.getvalue()


def _array(header: str, content: bytes = b"") -> bytes:
    """An archive of one array with this header."""
    text = header.encode().ljust(118) + b"\n"
    return _archive(f"{IMAGE.name}.npy", b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + content)


@pytest.mark.parametrize(
    "content",
    [
        b"", b"PK no archive", packed({IMAGE.name: np.zeros((2, 3, 4))}),
        _archive(f"{IMAGE.name}.npy", b"no array"), _archive("bomb.npy", bytes(LARGEST + 1)),
        _array("{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000000,)}"),
        _array("{'descr': '|O', 'fortran_order': False, 'shape': (1,)}", bytes(8)),
        _array("{'descr': '<U1', 'fortran_order': False, 'shape': (1,)}", bytes(4)),
        _array("[" * 100), _array("{'descr': '<f4'}"), _archive(f"{IMAGE.name}.npy", b"\x93NUMPY\x09\x00"),
    ],
)  # fmt: skip
def test_another_file_in_their_place_is_named(content: bytes, tmp_path: Path) -> None:
    policy = tmp_path / "policy.onnx"
    samples_file(policy).write_bytes(content)
    with pytest.raises(ValueError, match=r"policy\.images\.npz: .*; accepted: "):
        read_samples(policy, IMAGE)


def test_the_zoo_keeps_them() -> None:
    for vehicle, task in (("vis_r", "avoid"), ("vis_h", "race_clutter"), ("vis_h", "land_visual")):
        policy = policy_file(f"{vehicle}/{task}")
        (image,) = load_policy(policy).contract.images
        found = read_samples(policy, image)
        assert len(found) == COUNT
        image.check(found[0], ())


def test_a_picture_stands_beside_others() -> None:
    shown, other = np.full((2, 3, 3), 1, np.uint8), np.full((2, 3, 3), 2, np.uint8)
    assert sheet(shown, []) is shown
    one = sheet(shown, [other])
    assert one.shape == (2, 6 + GAP, 3)
    assert (one[:, :3] == 1).all()
    assert (one[:, 3 + GAP :] == 2).all()
    three = sheet(shown, [other] * 3)
    assert three.shape == (4, 9 + GAP, 3)
    assert (three[:2, 3 + GAP :] == 2).all()
    assert (three[2:, :3] == 255).all()
