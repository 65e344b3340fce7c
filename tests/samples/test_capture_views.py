"""Images of a still head from many sides: they and their landmarks are of the mesh that lies beside them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from samples.capture.views import LANDMARKS, in_sight, person, projected, radical_inverse, write_views

from avatar_trainer.asm.views.files import read

SIZE = 48


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_views(tmp_path_factory.mktemp("views"), 3, identity=4, size=SIZE, noise=0.0).parent


def test_landmarks_are_where_the_true_mesh_has_them(folder: Path) -> None:
    found, cameras = read(folder), json.loads((folder / "truth.json").read_text())["cameras"]
    with np.load(folder / "truth.npz", allow_pickle=False) as file:
        points = file["vertices"][file["landmarks"]]
    for n, camera in enumerate(cameras):
        place, _ = projected(points, found.intrinsics, np.array(camera["R"]), np.array(camera["t"]))
        seen = found.seen[n]
        assert 40 <= seen.sum() <= 66
        np.testing.assert_allclose(found.landmarks[n, seen], place[seen], atol=6e-4)
        x, y = place[seen].astype(int).T
        assert found.mask[n, y.clip(0, SIZE - 1), x.clip(0, SIZE - 1)].mean() > 0.9


def test_a_side_view_hides_the_other_side() -> None:
    head, rows = person(0), np.array(LANDMARKS)
    seen = in_sight(head, rows, np.array([0.7, 0.0, 0.4]))  # from the subject's left
    assert seen[12:16].all() and not seen[:7].any()


def test_the_same_seed_is_the_same_person(folder: Path, tmp_path: Path) -> None:
    write_views(tmp_path, 3, identity=4, size=SIZE, noise=0.0)
    for name in ("views.json", "truth.json", "images/02.png", "masks/01.png"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes(), name
    assert np.abs(person(4).vertices - person(5).vertices).max() > 1e-3


def test_images_show_a_lit_head(folder: Path) -> None:
    image = np.asarray(Image.open(folder / "images" / "00.png"))
    assert image.shape == (SIZE, SIZE, 3) and image[SIZE // 2, SIZE // 2].min() > 60


def test_the_sequence_fills_the_interval() -> None:
    assert [radical_inverse(i, 2) for i in range(1, 6)] == [0.5, 0.25, 0.75, 0.125, 0.625]
    assert sorted(radical_inverse(i, 3) for i in range(9)) == pytest.approx(np.arange(9) / 9)


def test_no_views_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="one is the least"):
        write_views(tmp_path, 0, 0, SIZE, 1.0)
