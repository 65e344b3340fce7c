"""A film becomes a capture: tracked where its truth is, the same bytes each time, also if it was stopped."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from bench.films.avatars import camera_round
from bench.films.tracks import face_region, figures, mean_head, tracked
from samples.films.render import scene
from samples.films.table import film
from samples.films.truth import load as load_truth
from samples.films.truth import side_camera
from samples.films.write import write_film

from avatar_runtime import F32, F64, AvatarError, Camera, posed_mesh
from avatar_runtime.stages.joints import joints
from avatar_trainer.captures.checks.verdict import judge
from avatar_trainer.captures.load import check_pixels, load
from avatar_trainer.film.capture import WORK, FilmSettings, Texts, make_capture
from avatar_trainer.film.track import Looked, Track
from avatar_trainer.head import load_tracking_head

SECONDS, SIZE = 0.7, 256
TEXTS = Texts("joan", "CC BY 4.0", "she agreed")


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A film of somebody whom the tracker never saw."""
    folder = tmp_path_factory.mktemp("joan")
    return write_film(scene(film("joan"), SECONDS, SIZE), folder)


@pytest.fixture(scope="module")
def capture(filmed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("capture") / "joan"
    make_capture(filmed, out, FilmSettings(size=SIZE), TEXTS, lambda _: None)
    return out


def contents(folder: Path) -> dict[str, bytes]:
    """What a capture is made of, without the folder of work."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and WORK not in path.parts]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files if path.name != "track.npz"}


def test_the_head_is_tracked_where_it_is(filmed: Path, capture: Path) -> None:
    found = figures(load_truth(filmed.parent), tracked(capture / "track.npz"))
    assert found["pose"] < 3
    assert found["vertices"] < 4
    assert found["jawOpen"] > 0.8 or np.isnan(found["jawOpen"])


def test_the_side_is_judged_about_where_the_film_shows_the_head(filmed: Path, capture: Path) -> None:
    """At 0 degrees each vertex is at the film's pixel; from the side the face is where the true one is, though the lens
    is another."""
    truth, scene_, track = load_truth(filmed.parent), load(capture), tracked(capture / "track.npz")
    frame, lens = scene_.frames[3], float(track.data["focal"]) / track.zoom / truth.focal
    mesh = posed_mesh(scene_.rig, frame.pose, joints(scene_.rig, frame.pose))
    rows = load_tracking_head(mean_head())[1]
    face = face_region(mean_head())[rows]

    def pixels(camera: Camera, points: F32) -> F64:
        clip = np.c_[points, np.ones(len(points))] @ camera.clip_from_world.T
        places: F64 = (clip[:, :2] / clip[:, 3:] + 1) / 2 * (camera.width, camera.height)
        return places

    ahead, aside = (camera_round(truth, scene_, frame, yaw, lens) for yaw in (0, 30))
    filmed_at = pixels(frame.camera, mesh) / track.zoom + track.data["corner"]
    assert np.abs(pixels(ahead, mesh) - filmed_at).max() < 0.1
    turn = ahead.camera_from_world[:3, :3] @ aside.camera_from_world[:3, :3].T
    assert np.degrees(np.arccos((np.trace(turn) - 1) / 2)) == pytest.approx(30, abs=1e-3)
    rotation, shift = side_camera(truth, int(frame.name), 30)
    there = truth.vertices(int(frame.name))[rows][face] @ rotation.T + shift
    wanted = truth.focal * there[:, :2] / there[:, 2:] + truth.principal
    assert lens > 1.4 and np.abs((pixels(aside, mesh[face]) - wanted).mean(axis=0)).max() < 1.5


def test_masks_end_below_the_neck(capture: Path) -> None:
    """Of the person that the network found, the upper part is kept but for its edge, nothing is added, shoulders go."""
    for path in (capture / "masks").iterdir():
        kept, whole = (
            cv2.imread(str(at), cv2.IMREAD_GRAYSCALE) for at in (path, capture / WORK / "masks" / path.name)
        )
        assert kept is not None and whole is not None
        wide, sure = (change(whole, np.ones((3, 3), np.uint8)) for change in (cv2.dilate, cv2.erode))
        assert (kept <= np.maximum(whole, 255 * (wide > 0))).all()
        assert (kept[: SIZE // 4] >= whole[: SIZE // 4] * (sure[: SIZE // 4] == 255)).all()
        assert np.count_nonzero(kept[-1]) < 0.9 * np.count_nonzero(whole[-1])


def test_the_capture_is_one_that_trainers_take(capture: Path) -> None:
    scene_ = load(capture)
    check_pixels(scene_)
    judge(scene_).refuse(scene_)
    assert scene_.poses == "estimated"
    assert {frame.split for frame in scene_.frames} == {"train", "test"}
    document = json.loads((capture / "capture.json").read_text("utf-8"))
    assert document["consent"] == "she agreed"
    assert "CC BY 4.0" in document["licence"] and "ICT-FaceKit" in document["licence"]


def test_a_capture_that_was_stopped_has_the_same_bytes(filmed: Path, capture: Path, tmp_path: Path) -> None:
    """Some masks, the track and all that follows are made again."""
    out = tmp_path / "again"
    shutil.copytree(capture, out)
    for path in [*sorted((out / WORK / "masks").iterdir())[::3], out / "track.npz", out / "capture.json"]:
        path.unlink()
    for path in (
        out / WORK / "masks" / "00001.png",
        out / WORK / "images" / "00002.png",
        out / WORK / Looked.FILE,
    ):
        path.write_bytes(path.read_bytes()[:-99])  # half written
    filmed = Path(shutil.copy(filmed, tmp_path / "other name.mp4"))
    make_capture(filmed, out, FilmSettings(size=SIZE), TEXTS, lambda _: None)
    assert contents(out) == contents(capture)


def test_the_seed_chooses_what_is_compared(filmed: Path, capture: Path, tmp_path: Path) -> None:
    """Another seed compares other points of the skin: nearly the same head, not the same numbers."""
    out, settings = tmp_path / "seed", FilmSettings(size=SIZE, seed=1)
    shutil.copytree(capture, out)
    for name in ("track.npz", "capture.json"):
        (out / name).unlink()
    told = out / WORK / "film.json"
    told.write_text(json.dumps({**json.loads(told.read_text()), "seed": 1}))
    make_capture(filmed, out, settings, TEXTS, lambda _: None)
    mine, other = (Track.load(folder / "track.npz").rotation for folder in (out, capture))
    assert 0 < np.abs(mine - other).max() < 0.1


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (FilmSettings(size=128), "other options (size)"),
        (FilmSettings(size=SIZE, first=0.2), "other options (first)"),
    ],
)
def test_other_options_do_not_go_on_there(
    filmed: Path, capture: Path, settings: FilmSettings, said: str
) -> None:
    before = contents(capture)
    with pytest.raises(AvatarError, match=re.escape(said)):
        make_capture(filmed, capture, settings, TEXTS, lambda _: None)
    assert contents(capture) == before


def test_a_crop_changes_neither_lens_nor_middle(filmed: Path, capture: Path, tmp_path: Path) -> None:
    """A pixel of the film has the same ray, whether the film is cut to a part or not."""
    out = tmp_path / "part"
    make_capture(
        filmed, out, FilmSettings(size=SIZE, crop=(20, 0, SIZE - 20, SIZE - 8)), TEXTS, lambda _: None
    )
    whole, part = Track.load(capture / "track.npz"), Track.load(out / "track.npz")
    assert part.focal / part.scale == pytest.approx(whole.focal / whole.scale)
    for track in (whole, part):
        assert track.corner + track.principal / track.scale == pytest.approx(SIZE / 2)


def test_a_damaged_folder_says_so(filmed: Path, tmp_path: Path) -> None:
    told = tmp_path / WORK / "film.json"
    told.parent.mkdir()
    for text in ("{", "[1]"):
        told.write_text(text)
        with pytest.raises(AvatarError, match="damaged"):
            make_capture(filmed, tmp_path, FilmSettings(), TEXTS, lambda _: None)
    with pytest.raises(AvatarError, match="is a file"):
        make_capture(filmed, told, FilmSettings(), TEXTS, lambda _: None)


def test_a_folder_of_something_else_stays(filmed: Path) -> None:
    with pytest.raises(AvatarError, match="not empty"):
        make_capture(filmed, filmed.parent, FilmSettings(size=SIZE), TEXTS, lambda _: None)
    assert {path.name for path in filmed.parent.iterdir()} == {"film.mp4", "truth.npz"}
