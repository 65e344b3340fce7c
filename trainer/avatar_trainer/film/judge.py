"""What is wrong with a film of a face, before hours are spent on it: from its track, and a look at its pictures.

Notes are data; their sentences, which tell how to film again, stand with those of all notes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_export.notes import note
from avatar_runtime import F64
from avatar_trainer.film.track import FILE, Looked, Track

# Where a film becomes doubtful. Twelve films of talking heads from the net were measured; "usual" is what they had.
FACES = 10  # frames with a face: fewer are a mistake of the network, or nothing to learn from
FACE_PX = 110.0  # height of the face in the film: half of that at which the tracker's figures were measured
TURN = 20.0  # degrees to either side; unseen sides of a head cost some 5 dB
GAPS = 0.05  # of the frames show no face: one in twenty is a hand before the mouth, more is another matter
SEVERAL = 0.02  # of the frames show more faces: less is a mistake of the network
EDGE = 0.02  # of the frames show a part of the face only
CUT_STEP = 0.12  # sizes of the face that the landmarks move from one frame to the next; usual: 0.05 at most
CUT_TURN = 10.0  # degrees from one frame to the next; usual: 6 at most
CUT_CHANGE = 8.0  # grey levels of a small picture; usual: 6 at most, between two scenes 16 to 107
CUT_ALONE = 3.0  # times the largest step around: a fast movement has fast neighbours
CUT_AROUND = 3  # frames before and after
BLUR_SHARE = 0.2  # of the frames are blurred: have less than BLURRED of the detail of the sharp ones
BLURRED = 0.5  # usual: 0.6 in the worst twentieth
SOFT = 0.02  # detail of a film out of focus: a blur by 0.015 of the face's height; usual: 0.05 to 0.6
LIGHT = 0.3  # of its brightness by which a face changes; usual: 0.02 to 0.2, from turning alone
STILL = (
    0.01  # sizes of the face that some landmark moves in the liveliest tenth; usual: 0.07, a picture 0.0024
)
SIDEWAYS = 45.0  # degrees
SHOWN = 0.1  # seconds for which an expression must be seen: a blink keeps the lids closed for no longer

# Weights of MediaPipe: where an expression is shown they reach 0.5 to 0.99, where it is not 0 to 0.25.
Expression = tuple[
    str, tuple[tuple[str, ...], ...], float
]  # what, any of groups of names, that all reach a weight
EXPRESSIONS: tuple[Expression, ...] = (
    ("the mouth wide open", (("jawOpen",),), 0.35),
    ("a smile", (("mouthSmileLeft", "mouthSmileRight"),), 0.4),
    ("moved brows", (("browOuterUpLeft", "browOuterUpRight"), ("browDownLeft", "browDownRight")), 0.35),
    ("pursed lips", (("mouthPucker",),), 0.5),
)
LIDS = ("eyeBlinkLeft", "eyeBlinkRight")
CLOSED = 0.45  # of LIDS; open ones have 0.34 at most
TEMPLES, TOP_AND_CHIN = (234, 454), (10, 152)  # of MediaPipe's landmarks
PATCH, THUMB = (80, 100), (32, 32)  # pixels, width and height

Picture = npt.NDArray[np.uint8]


def glance(
    picture: Picture, landmarks: F64 | None, before: F64 | None
) -> tuple[tuple[float, float, float], F64]:
    """(detail of the face, its light, change of the picture) of [H, W, 3], and the small picture for the next `before`.

    Detail: variance of the Laplacian by that of the face; light and change: grey levels. NaN where there is no face, or
    no picture before.
    """
    grey = Image.fromarray(picture).convert("L")
    small = _pixels(grey.resize(THUMB, Image.Resampling.BOX))
    change = np.nan if before is None else float(np.abs(small - before).mean())
    if landmarks is None:
        return (np.nan, np.nan, change), small
    box = _inside(landmarks.min(axis=0), landmarks.max(axis=0), grey.size)
    face = _pixels(grey.resize(PATCH, Image.Resampling.BOX, box=box))
    edges = face[1:-1, 1:-1] * 4 - face[:-2, 1:-1] - face[2:, 1:-1] - face[1:-1, :-2] - face[1:-1, 2:]
    light = float(face[25:75, 20:60].mean())
    return (float(edges.var() / max(face.var(), 1.0)), light, change), small


def judge(film: Looked, scale: float = 1.0, turned: int = 0) -> list[note.Note]:
    """What should be known before a training; a misfit is no film to train on.

    `scale`: pixels of the landmarks in one of the film. `turned`: degrees clockwise by which the film was turned.
    """
    if (count := int(film.seen.sum())) < FACES:
        return [note.Note("film_no_face", {"count": count, "frames": len(film.times)}, "misfit")]
    found = [one for check in CHECKS for one in check(film)]
    return [*_sideways(film, turned), *_small(film, scale), *found]


def judge_film(folder: Path) -> list[note.Note]:
    """What is wrong with the film that the capture in `folder` was made from; nothing for another capture.

    Raises AvatarError for a damaged track.
    """
    path = folder / FILE
    if not path.is_file():
        return []
    track = Track.load(path)
    return judge(track.looked, track.scale, track.turned)


def upright(pictures: Iterable[Picture], roll: Callable[[Picture], float | None]) -> int:
    """Degrees clockwise by which pictures show an upright face most often; 0 where no turn is better than none.

    `roll` finds the degrees by which a face leans clockwise; None: no face.
    """
    counts = [0, 0, 0, 0]
    for picture in pictures:
        for quarters in range(4):
            leans = roll(np.ascontiguousarray(np.rot90(picture, -quarters)))
            counts[quarters] += leans is not None and abs(leans) < SIDEWAYS
    return 90 * int(np.argmax(counts))


def lying(leans: float, turned: int = 0) -> note.Note:
    """The note on a face that leans by degrees clockwise in a film that was turned clockwise by others."""
    return note.doubt("film_sideways", leans=leans % 360, rotation=(turned + round(-leans / 90) * 90) % 360)


def roll(rotation: F64) -> F64:
    """Degrees by which heads [..., 3, 3] (camera from head) lean clockwise in the picture."""
    leans: F64 = np.degrees(np.arctan2(rotation[..., 0, 1], -rotation[..., 1, 1]))
    return leans


def _inside(low: F64, high: F64, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """A box of a face, at least a pixel large, within the picture."""
    left, top = (float(np.clip(low[k], 0, size[k] - 1)) for k in (0, 1))
    right, bottom = (float(np.clip(high[k], (left, top)[k] + 1, size[k])) for k in (0, 1))
    return left, top, right, bottom


def _pixels(image: Image.Image) -> F64:
    return np.asarray(image, np.float64)


def _size(film: Looked) -> F64:
    """[T] the larger side of the face, pixels."""
    sides: F64 = np.ptp(film.landmarks, axis=1).max(axis=1)
    return np.maximum(sides, 1.0)


def _gaps(film: Looked) -> Iterator[note.Note]:
    if (share := float(1 - film.seen.mean())) > GAPS:
        yield note.doubt("film_gaps", share=share)


def _several(film: Looked) -> Iterator[note.Note]:
    if (share := float((film.faces > 1).mean())) > SEVERAL:
        yield note.doubt("film_faces", share=share)


def _still(film: Looked) -> Iterator[note.Note]:
    places = film.landmarks[film.seen]
    away = np.abs(places - np.median(places, axis=0)).max(axis=(1, 2)) / _size(film)[film.seen]
    if np.percentile(away, 90) < STILL:
        yield note.Note("film_still", {}, "misfit")


def _sideways(film: Looked, turned: int) -> Iterator[note.Note]:
    leans = float(roll(np.median(film.rotation[film.seen], axis=0)))
    if abs(leans) > SIDEWAYS:
        yield lying(leans, turned)


def _small(film: Looked, scale: float) -> Iterator[note.Note]:
    points = film.landmarks[film.seen]
    sides = [np.linalg.norm(points[:, a] - points[:, b], axis=1) for a, b in (TEMPLES, TOP_AND_CHIN)]
    pixels = float(np.median(np.maximum(*sides))) / scale
    if pixels < FACE_PX:
        yield note.doubt("film_small", pixels=pixels, least=FACE_PX)


def _turns(film: Looked) -> Iterator[note.Note]:
    camera = -film.rotation[film.seen][:, 2]  # where it is, in the head's space
    yaw = np.degrees(np.arctan2(-camera[:, 0], camera[:, 2]))
    right, left = (float(max(side, 0)) for side in (-np.percentile(yaw, 1), np.percentile(yaw, 99)))
    if min(left, right) < TURN:
        yield note.doubt("film_turns", left=left, right=right)


def _edges(film: Looked) -> Iterator[note.Note]:
    points = film.landmarks[film.seen]
    outside = (points < 0).any(axis=(1, 2)) | (points > (film.width, film.height)).any(axis=(1, 2))
    if (share := float(outside.mean())) > EDGE:
        yield note.doubt("film_edge", share=share)


def _expressions(film: Looked) -> Iterator[note.Note]:
    missing = [
        what
        for what, groups, least in EXPRESSIONS
        if not any(_reached(film, names, least) for names in groups)
    ]
    if missing:
        yield note.doubt("film_expressions", names=missing)
    if not _reached(film, LIDS, CLOSED):
        yield note.doubt("film_lids")


def _reached(film: Looked, names: tuple[str, ...], least: float) -> bool:
    """Whether all of these weights were that high at once, for SHOWN seconds."""
    if not set(names) <= set(film.score_names):
        return False
    together = film.scores[:, [film.score_names.index(name) for name in names]].min(axis=1)
    frames = round(SHOWN / float(np.median(np.diff(film.times))))
    return int((together[film.seen] > least).sum()) >= max(frames, 1)


def _cuts(film: Looked) -> Iterator[note.Note]:
    """Steps that stand alone, of the landmarks, the pose or the picture."""
    step = np.linalg.norm(np.diff(film.landmarks, axis=0), axis=2).mean(axis=1) / _size(film)[1:]
    cosine = (np.einsum("tij,tij->t", film.rotation[1:], film.rotation[:-1]) - 1) / 2
    turn = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    both = film.seen[1:] & film.seen[:-1]
    cut = _alone(step * both, CUT_STEP) | _alone(turn * both, CUT_TURN)
    cut |= _alone(np.nan_to_num(film.glances[1:, 2].astype(np.float64)), CUT_CHANGE)
    if cut.any():
        yield note.doubt("film_cuts", seconds=[f"{time:.1f}" for time in film.times[1:][cut]])


def _alone(steps: F64, least: float) -> npt.NDArray[np.bool_]:
    around = np.lib.stride_tricks.sliding_window_view(np.pad(steps, CUT_AROUND), 2 * CUT_AROUND + 1).copy()
    around[:, CUT_AROUND] = 0
    alone: npt.NDArray[np.bool_] = steps > np.maximum(CUT_ALONE * around.max(axis=1), least)
    return alone


def _blur(film: Looked) -> Iterator[note.Note]:
    detail = film.glances[film.seen, 0]
    share = float((detail < BLURRED * np.percentile(detail, 90)).mean())
    if np.median(detail) < SOFT:
        yield note.doubt("film_soft")
    elif share > BLUR_SHARE:
        yield note.doubt("film_blur", share=share)


def _light(film: Looked) -> Iterator[note.Note]:
    dark, middle, bright = np.percentile(film.glances[film.seen, 1], (2, 50, 98))
    if (change := float((bright - dark) / max(middle, 1.0))) > LIGHT:
        yield note.doubt("film_light", change=change)


CHECKS = (_still, _gaps, _several, _turns, _edges, _expressions, _cuts, _blur, _light)
