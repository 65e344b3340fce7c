"""What a synthetic head wears: where it stands, what it hides, and that the tracked body model knows nothing of it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from samples.capture import __main__ as command
from samples.capture import shots as capture_shots
from samples.capture.extras import EXTRAS, glasses, hair
from samples.capture.head import DARK, LIT, Model, perform, write_head
from samples.capture.shots import Noise
from samples.subjects.body_model import BodyModel
from samples.subjects.head import Head
from samples.subjects.take import Take

from avatar_runtime.camera import Camera
from avatar_trainer.captures.mesh_raster import MeshImage

Array = npt.NDArray[Any]
SIZE, FRAMES = 32, 3
WORN = tuple(EXTRAS)


@pytest.fixture(scope="module", autouse=True)
def fewer_rays() -> Iterator[None]:
    """Images of tests need not be as fine as those for training."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(capture_shots, "RAYS", 96)
        yield


@pytest.fixture(scope="module")
def take(body: BodyModel) -> Take:
    return perform(body, FRAMES, ())


@pytest.fixture(scope="module")
def models(head: Head, body: BodyModel) -> dict[str, Model]:
    """The bare head, and one for each thing worn."""
    return {"": Model(head, body), **{name: Model(head, body, (EXTRAS[name](head),)) for name in WORN}}


def from_yaw(yaw: float, size: int = 96) -> Camera:
    return Camera.orbit(np.array([0, 0.02, 0]), 0.86, yaw, 0.0, 0.43, size, size)


def off_the_head(vertices: Array, head: Head) -> Array:
    """Metres [V] to the nearest vertex of face and scalp."""
    skin = head.vertices[head.in_part("face", "head")]
    return np.array([np.linalg.norm(skin - vertex, axis=1).min() for vertex in vertices])


def over_white(image: MeshImage) -> Array:
    alpha = image.alpha[..., None]
    result: Array = image.colour * alpha + 1 - alpha
    return result


def test_glasses_stand_off_the_face(head: Head) -> None:
    """Rims and bridge everywhere by a millimetre, mostly by one or two centimetres; nothing in the eyes' way."""
    made = glasses(head)
    front = made.vertices[:, 2] > 0.10
    distance = off_the_head(made.vertices[front][::5], head)
    assert distance.min() > 0.001
    assert 0.008 < np.median(distance) < 0.03
    assert np.abs(made.vertices[:, 0]).max() < 0.10
    np.testing.assert_allclose(made.vertices[:, 0].max(), -made.vertices[:, 0].min(), atol=1e-9)


def test_hair_stands_1_to_3_centimetres_off_the_scalp(head: Head) -> None:
    made = hair(head)
    distance = off_the_head(made.vertices[::200], head)
    assert 0.015 < np.percentile(distance, 95) < 0.035
    assert len(distance) > 300
    assert (distance > 0.01).mean() > 0.3
    assert distance.max() < 0.05
    eyes = np.abs(made.vertices[:, None] - head.eye_centres).max(axis=2).min(axis=1)
    assert eyes.min() > 0.02


@pytest.mark.parametrize("name", WORN)
def test_the_same_every_time(name: str, head: Head) -> None:
    one, other = EXTRAS[name](head), EXTRAS[name](head)
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.rgb, other.rgb)


@pytest.mark.parametrize("name", WORN)
def test_triangles_look_outwards(name: str, head: Head) -> None:
    """Away from the middle line of their tube: a closed tube of them has a positive volume."""
    made = EXTRAS[name](head)
    tubes = made.triangles if name == "glasses" else made.triangles[: len(made.triangles) // 2]
    a, b, c = (made.vertices[tubes[:, i]] for i in range(3))
    assert np.sum(np.cross(a, b) * c) > 0


@pytest.mark.parametrize("name", WORN)
@pytest.mark.parametrize("yaw", [0.0, 0.9])
def test_the_region_is_where_the_image_differs(
    name: str, yaw: float, models: dict[str, Model], take: Take
) -> None:
    """Outside it the head is as without, to the bit; all inside it is of the extra's own colours."""
    bare, dressed = models[""], models[name]
    camera = from_yaw(yaw)
    region = dressed.region(take, 2, camera, 2)
    with_it, without = dressed.image(take, 2, camera, 2), bare.image(take, 2, camera, 2)
    outside = region == 0
    np.testing.assert_array_equal(with_it.alpha[outside], without.alpha[outside])
    np.testing.assert_allclose(with_it.colour[outside], without.colour[outside], rtol=0, atol=1e-6)
    inside = region > 0.999
    assert inside.sum() > 40
    assert (with_it.alpha[inside] > 0.999).all()
    brightest = dressed.worn[0].rgb.max() * (DARK + LIT) * 1.05 + dressed.worn[0].gloss[0]
    assert with_it.colour[inside].max() <= brightest + 1e-6
    assert np.abs(over_white(with_it) - over_white(without))[inside].max(axis=1).mean() > 0.2


def test_the_head_hides_what_is_behind_it(models: dict[str, Model], take: Take) -> None:
    """From behind, of the glasses only the ends beside the ears are seen; from in front much more."""
    front, back = (models["glasses"].region(take, 0, from_yaw(yaw), 2) for yaw in (0.0, np.pi))
    assert back.sum() < 0.25 * front.sum()
    middle = back[:, 33:63]  # half a head to either side
    assert not middle.any()
    assert front[:, 33:63].sum() > 0.4 * front.sum()


def test_a_capture_with_hair_and_glasses(tmp_path: Path) -> None:
    """Regions for every frame; what is tracked is to the byte what a bare head has."""
    write_head(tmp_path / "worn", SIZE, FRAMES, Noise(), worn=WORN)
    write_head(tmp_path / "bare", SIZE, FRAMES, Noise())
    names = [f"{k:05d}.png" for k in range(FRAMES)]
    assert sorted(path.name for path in (tmp_path / "worn" / "regions").iterdir()) == names
    assert not (tmp_path / "bare" / "regions").exists()
    for path in (tmp_path / "bare" / "body").iterdir():
        assert path.read_bytes() == (tmp_path / "worn" / "body" / path.name).read_bytes(), path.name
    stated = [(tmp_path / which / "capture.json").read_text() for which in ("bare", "worn")]
    assert stated[1] == stated[0].replace("synthetic", "synthetic, glasses, hair", 1)
    for name in names:
        region = np.asarray(Image.open(tmp_path / "worn" / "regions" / name)).astype(float) / 255
        assert region.shape == (SIZE, SIZE)
        mask = np.asarray(Image.open(tmp_path / "worn" / "masks" / name)).astype(float) / 255
        assert 0.05 < region.mean() < 0.4
        assert mask[region > 0.99].mean() > 0.95  # of fewer rays


def test_the_body_wears_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "argv", ["capture", str(tmp_path / "out"), "--subject", "body", "--glasses"])
    with pytest.raises(SystemExit) as ended:
        command.main()
    assert ended.value.code == 2
    assert "the body wears no glasses" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
