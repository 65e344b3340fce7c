"""The rendered films: a film decodes as it was drawn, and its truth is where the images show it."""

from __future__ import annotations

from typing import Any

import av
import numpy as np
import numpy.typing as npt
import pytest
from bench.films.tracks import Tracked, face_region, figures, mean_head, table
from samples.films.render import Scene, scene
from samples.films.table import FILMS, SCAN, film
from samples.films.truth import Truth, load, side_camera, side_view
from samples.films.write import write_film

from avatar_runtime.camera import Camera
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.captures.mesh_raster import depth_of
from avatar_trainer.head import load_head_model

Array = npt.NDArray[Any]

SIZE, FRAMES = 128, 3


@pytest.fixture(scope="module")
def shot() -> Scene:
    """The start of the film of the scan without hair: its outline is the mesh's."""
    return scene(film("emil"), FRAMES / 30, SIZE)


@pytest.fixture(scope="module")
def truth(shot: Scene, tmp_path_factory: pytest.TempPathFactory) -> Truth:
    folder = tmp_path_factory.mktemp("film")
    write_film(shot, folder)
    return load(folder)


def test_the_table_varies_what_it_must() -> None:
    assert len(FILMS) == 12 == len({one.name for one in FILMS})
    assert len({one.skin for one in FILMS}) == 6
    assert len({one.focal for one in FILMS}) == 3
    assert len({one.light for one in FILMS}) == 2
    assert {one.seconds for one in FILMS} >= {10, 30}
    assert any(one.identity == SCAN for one in FILMS) and any(one.glasses and one.hair for one in FILMS)


def test_the_file_shows_what_was_drawn(shot: Scene, truth: Truth) -> None:
    with av.open(str(truth.folder / "film.mp4")) as container:
        (stream,) = container.streams.video
        assert (stream.codec_context.name, float(stream.average_rate)) == ("h264", 30.0)
        decoded = np.stack([image.to_ndarray(format="rgb24") for image in container.decode(stream)])
    drawn = np.stack(list(shot.filmed()))
    assert decoded.shape == drawn.shape == (FRAMES, SIZE, SIZE, 3)
    blocks = (
        pixels.reshape(FRAMES, SIZE // 4, 4, SIZE // 4, 4, 3).mean((2, 4)) for pixels in (decoded, drawn)
    )
    assert np.abs(np.subtract(*blocks)).mean() < 2.5  # the noise is gone in the mean
    assert np.abs(decoded.mean(axis=(0, 1, 2)) - drawn.mean(axis=(0, 1, 2))).max() < 2


def test_the_truth_is_where_the_image_shows_it(truth: Truth) -> None:
    """Another rasteriser finds the head where the film does, from the truth's numbers alone."""
    head, frame = truth.scene.person.head, FRAMES - 1
    k = np.array([[truth.focal, 0, SIZE / 2], [0, truth.focal, SIZE / 2], [0, 0, 1]])
    for view in (None, side_camera(truth, frame, 30.0)):
        colour, alpha = side_view(truth, frame, 30.0) if view else truth.scene.rgba(frame)
        turn, shift = view or (np.eye(3), np.zeros(3))
        camera = Camera.from_opencv(turn, shift, k, SIZE, SIZE)
        covered = np.isfinite(depth_of(truth.vertices(frame), head.triangles, camera))
        above = np.arange(SIZE)[:, None] < 0.6 * SIZE  # of the shirt
        assert ((alpha >= 0.5) != covered)[above & np.ones_like(covered)].mean() < 0.003
        assert colour[covered].mean() > 0.15


def test_the_pose_is_that_of_the_skull(truth: Truth) -> None:
    person = truth.scene.person
    still = np.abs(person.body.shapedirs_expression).max(axis=(1, 2)) < 1e-6
    skull = still & (person.body.lbs_weights[:, 1] > 1 - 1e-6)
    assert skull.sum() > 500
    for frame in range(FRAMES):
        placed = person.head.vertices[skull] @ truth.R[frame].T + truth.t[frame]
        assert np.abs(placed - truth.vertices(frame)[skull]).max() < 1e-5


def perfect(truth: Truth) -> dict[str, Any]:
    """A track that is right: of the identity, what the modes of the head model can say."""
    model, face = load_head_model(), face_region(mean_head())
    modes = model.identity[:, face].reshape(len(model.identity), -1).T.astype(float)
    wanted = (truth.neutral - model.vertices)[face].reshape(-1)
    return {
        "width": SIZE,
        "times": truth.times,
        "focal": truth.focal,
        "principal": truth.principal,
        "identity": np.linalg.lstsq(modes, wanted, rcond=None)[0],
        "names": np.array(truth.names),
        "weights": truth.weights,
        "rotation": truth.R,
        "translation": truth.t,
        "seen": np.ones(len(truth.times), bool),
    }


def turned(degrees: Array) -> Array:
    """Rotations [T, 3, 3] of the head about its upright axis."""
    return matrix_from_rotvec(np.radians(np.outer(degrees, (0.0, 1.0, 0.0))))


def test_the_figures_of_a_right_track_and_of_wrong_ones(truth: Truth) -> None:
    right = perfect(truth)
    found = figures(truth, Tracked(right))
    assert found["pose"] < 0.01 and found["absolute"] < 1 and found["focal"] == 1
    assert found["vertices"] < 2.5 and found["face share"] < 0.9
    assert found["median"] > 0.999
    # The same, of images that are a part of the film at another size.
    crop = {"scale": 2.0, "corner": np.array([7.0, 3.0]), "focal": 2 * truth.focal}
    crop["principal"] = 2 * (truth.principal - crop["corner"])
    assert figures(truth, Tracked(right | crop)) == pytest.approx(found, nan_ok=True)
    wrong = right | {"rotation": truth.R @ turned(np.full(FRAMES, 5.0))}
    constant = figures(truth, Tracked(wrong))
    assert constant["pose"] < 0.01 and constant["absolute"] == pytest.approx(5, abs=1)
    wrong = right | {"rotation": truth.R @ turned(np.linspace(-6, 6, FRAMES))}
    assert figures(truth, Tracked(wrong))["pose"] == pytest.approx(4, abs=0.1)
    wrong = right | {"translation": truth.t * 1.0 + (0.01, 0, 0), "weights": truth.weights[::-1]}
    off = figures(truth, Tracked(wrong))
    pixels = 0.01 * truth.focal / truth.t[0, 2] * 512 / SIZE
    assert off["vertices"] == pytest.approx(pixels, rel=0.25) and off["median"] < 0.999
    lines = list(table({("emil", "all"): found}))
    assert any("holds" in line and line.startswith("pose") for line in lines)
