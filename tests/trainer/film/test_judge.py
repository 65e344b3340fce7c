"""What is wrong with a film is said, once; a good film is left in peace."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.notes.note import Note
from avatar_export.notes.text import text
from avatar_runtime import AvatarError
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.film import judge
from avatar_trainer.film.judge import roll, upright
from avatar_trainer.film.track import Track
from tests.trainer.film import films
from tests.trainer.film.tracks import FACING, FRAMES, SCORES, SIZE, good, turned


def judged(track: Track) -> list[Note]:
    return judge.judge(track.looked, track.scale, track.turned)


def without(*names: str) -> Callable[[Track], Track]:
    """The track in which these weights stay low."""
    columns = [SCORES.index(name) for name in names]
    return lambda track: replace(
        track, scores=np.where(np.isin(np.arange(len(SCORES)), columns), 0.2, track.scores)
    )


def moved(track: Track, rows: slice, by: tuple[float, float]) -> Track:
    landmarks = track.landmarks.copy()
    landmarks[rows] += np.float32(by)
    return replace(track, landmarks=landmarks)


def some(share: float) -> np.ndarray:
    return np.arange(FRAMES) < share * FRAMES


def lying(track: Track) -> Track:
    """On its right side: the picture shows the face turned clockwise by 90 degrees."""
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    return replace(track, rotation=quarter @ track.rotation, turned=90)


def jump(track: Track) -> Track:
    rotation = track.rotation.copy()
    rotation[200:] = rotation[200:] @ matrix_from_rotvec(np.array([[0.0, 0.3, 0.0]]))
    return replace(track, rotation=rotation)


TRACKS: list[tuple[str, Callable[[Track], Track], list[str]]] = [
    ("film_no_face", lambda t: replace(t, faces=1 * some(0.03)), ["in 9 of 300 frames"]),
    ("film_still", lambda t: replace(t, landmarks=t.landmarks[:1].repeat(FRAMES, 0)), ["still picture"]),
    ("film_sideways", lying, ["leans 90 degrees clockwise:", "--rotation 0"]),
    ("film_gaps", lambda t: replace(t, faces=1 - some(0.1)), ["10% of the frames"]),
    ("film_faces", lambda t: replace(t, faces=1 + some(0.05)), ["5% of the frames"]),
    ("film_small", lambda t: replace(t, scale=2.5), ["80 pixels", "110"]),
    ("film_turns", lambda t: replace(t, rotation=turned(np.linspace(-12, 30, FRAMES), 1)), ["30 degrees to its left",
     "12 to its right"]),
    ("film_edge", lambda t: moved(t, slice(0, 300), (150, 0)), ["cut off"]),
    ("film_expressions", without("jawOpen", "mouthSmileLeft", "mouthPucker"), ["wide open, a smile, pursed lips;"]),
    ("film_expressions", without("browOuterUpLeft", "browDownRight"), ["never seen: moved brows;"]),
    ("film_lids", without("eyeBlinkRight"), ["closed eyes"]),
    ("film_cuts", lambda t: moved(t, slice(150, 300), (40, 0)), ["at second 5.0:"]),
    ("film_cuts", jump, ["at second 6.7:"]),
]  # fmt: skip


def seen(column: int, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Track], Track]:
    """The track with a column of its glances changed."""

    def changed(track: Track) -> Track:
        glances = track.glances.copy()
        glances[:, column] = change(glances[:, column])
        return replace(track, glances=glances)

    return changed


TRACKS += [
    ("film_cuts", seen(2, lambda change: np.where(np.arange(FRAMES) == 60, 20, change)), ["at second 2.0:"]),
    ("film_blur", seen(0, lambda detail: np.where(some(0.3), 0.05, detail)), ["30% of the frames"]),
    ("film_soft", seen(0, lambda detail: detail / 20), ["out of focus"]),
    ("film_light", seen(1, lambda light: np.where(some(0.5), 80, light)), ["by 47%"]),
]


def test_a_good_film_is_left_in_peace() -> None:
    assert judged(good()) == []


@pytest.mark.parametrize("kind, spoilt, words", TRACKS)
def test_a_bad_film_is_told_once(kind: str, spoilt: Callable[[Track], Track], words: list[str]) -> None:
    (note,) = judged(spoilt(good()))
    assert note.kind == kind
    assert note.severity == ("misfit" if kind in ("film_no_face", "film_still") else "doubt")
    assert all(word in text(note) for word in words), text(note)


@pytest.mark.parametrize(
    ("fps", "frames", "told"), [(30, 2, True), (30, 3, False), (10, 0, True), (10, 1, False)]
)
def test_a_blink_of_a_tenth_of_a_second_is_seen(fps: int, frames: int, told: bool) -> None:
    track = without("eyeBlinkLeft", "eyeBlinkRight")(good())
    scores = track.scores.copy()
    scores[60 : 60 + frames, [SCORES.index(name) for name in judge.LIDS]] = 0.8
    film = replace(track, scores=scores, times=np.arange(FRAMES) / fps)
    assert [note.kind for note in judged(film)] == ["film_lids"] * told


def test_fast_movement_is_no_cut() -> None:
    track = good()
    step = np.cumsum(np.where(np.abs(np.arange(FRAMES) - 150) < 4, 30, 0))
    for row in range(FRAMES):
        track = moved(track, slice(row, row + 1), (0, float(step[row]) - 105))
    assert "film_cuts" not in [note.kind for note in judged(track)]


def pictures(count: int = 8) -> list[np.ndarray]:
    """Noise, as a face with much detail, brighter from picture to picture, one cut."""
    chance = np.random.default_rng(2)
    noise = chance.uniform(40, 120, (SIZE // 2, SIZE // 2)).repeat(2, 0).repeat(2, 1)
    made = [noise + 2 * k for k in range(count)]
    made[5:] = [255 - one for one in made[5:]]
    return [one[..., None].repeat(3, 2).astype(np.uint8) for one in made]


def glances(made: list[np.ndarray], landmarks: np.ndarray | None) -> np.ndarray:
    rows, small = [], None
    for picture in made:
        row, small = judge.glance(picture, landmarks, small)
        rows.append(row)
    return np.array(rows)


def test_pictures_are_measured() -> None:
    sharp = pictures()
    soft = [
        one.reshape(64, 8, 64, 8, 3).mean((1, 3)).repeat(8, 0).repeat(8, 1).astype(np.uint8) for one in sharp
    ]
    face = good().looked.landmarks[0]
    found, blurred = glances(sharp, face), glances(soft, face)
    assert (found[:, 0] > 2 * blurred[:, 0]).all()
    np.testing.assert_allclose(np.diff(found[:5, 1]), 2, atol=0.5)
    assert np.isnan(found[0, 2]) and found[5, 2] > 50 and (np.delete(found[1:, 2], 4) < 3).all()
    assert np.isnan(glances(sharp, None)[1:, :2]).all()
    assert np.isfinite(judge.glance(sharp[0], face - 2 * SIZE, None)[0][:2]).all(), (
        "a face outside the picture"
    )


@pytest.mark.parametrize("degrees", (0, 90, 180, 270))
def test_the_turn_that_makes_a_face_upright_is_found(degrees: int) -> None:
    """A picture whose upper edge is white is upright; a film that lies shows it elsewhere."""
    picture = np.zeros((40, 60, 3), np.uint8)
    picture[:5] = 255
    lying = [np.rot90(picture, degrees // 90)] * 3

    def leans(one: np.ndarray) -> float | None:
        edges = {0: one[0], 90: one[:, -1], 180: one[-1], -90: one[:, 0]}
        return next((float(angle) for angle, edge in edges.items() if edge.min() == 255), None)

    assert upright(lying, leans) == degrees
    assert upright(lying, lambda _: None) == 0


def test_roll_is_clockwise() -> None:
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # right becomes down: clockwise in the picture
    assert roll(quarter @ FACING) == pytest.approx(90)


def test_a_track_is_read_as_it_was_written(tmp_path: Path) -> None:
    track = replace(good(), scale=1.5, turned=270)
    track.save(tmp_path / "track.npz")
    again = Track.load(tmp_path / "track.npz")
    assert vars(again).keys() == vars(track).keys() and (again.scale, again.turned) == (1.5, 270)
    assert judged(again) == judged(track) == []
    for name, value in (
        ("landmarks", track.landmarks[1:]),
        ("scores", track.scores * np.nan),
        ("times", track.times[:9]),
    ):
        replace(track, **{name: value}).save(tmp_path / "track.npz")
        with pytest.raises(AvatarError, match=r"track\.npz: \w+: is damaged; make the capture again"):
            Track.load(tmp_path / "track.npz")
    shapeless: dict[str, Any] = {"scale": np.ones(2), "score_names": ()}
    replace(track, **shapeless).save(tmp_path / "track.npz")
    with pytest.raises(AvatarError, match="is no track of a film"):
        Track.load(tmp_path / "track.npz")
    for bad in (b"", b"PK\3\4", (tmp_path / "track.npz").read_bytes()[:-50]):
        (tmp_path / "track.npz").write_bytes(bad)
        with pytest.raises(AvatarError, match="is no track of a film"):
            Track.load(tmp_path / "track.npz")


def test_check_tells_what_was_wrong_with_the_film(
    folder: Path, tmp_path: Path, avatar_train: Callable[..., tuple[int, str, str]]
) -> None:
    shutil.copytree(folder, tmp_path / "take")
    track = without("jawOpen")(good())
    track.save(tmp_path / "take" / "track.npz")
    code, _, err = avatar_train("check", tmp_path / "take")
    assert code == 0 and [line for line in err.splitlines() if "never seen: the mouth wide open" in line]
    (tmp_path / "take" / "track.npz").write_bytes(b"no track")
    code, _, err = avatar_train("check", tmp_path / "take")
    assert code == 2 and "track.npz: is no track of a film" in err and err.count("\n") == 1


def test_a_refused_film_leaves_nothing_behind(
    tmp_path: Path, avatar_train: Callable[..., tuple[int, str, str]]
) -> None:
    film = films.write(tmp_path / "film.mp4", [films.picture(80 + k) for k in range(20)])
    code, _, err = avatar_train("capture", film, "-o", tmp_path / "out")
    assert code == 2 and err.count("\n") == 1 and "film.mp4: a face was found in 0 of 20 frames" in err, err
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]
