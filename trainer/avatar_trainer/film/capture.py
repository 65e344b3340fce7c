"""From a film to a capture, in stages whose results are kept, so that a run that was stopped goes on."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from threadpoolctl import threadpool_limits

from avatar_export.notes import note, text
from avatar_runtime import AvatarError
from avatar_runtime.io import write_text
from avatar_trainer.captures import own
from avatar_trainer.film import judge, source
from avatar_trainer.film.fit.landmark_fit import face_pixels
from avatar_trainer.film.follow import KEYFRAMES, follow
from avatar_trainer.film.look import look, square
from avatar_trainer.film.networks import Networks
from avatar_trainer.film.pictures import Picture, Pictures, cut
from avatar_trainer.film.plate import FRAMES, Plate
from avatar_trainer.film.shots import Person, shots
from avatar_trainer.film.torso import Chest, still_chest
from avatar_trainer.film.track import FILE as TRACK_FILE
from avatar_trainer.film.track import Looked, Track
from avatar_trainer.head import HEAD_LICENCE, HEAD_SOURCE

VERSION = 1  # of what the stages keep
WORK = "film"  # folder of what the stages keep
LOOKED_AT = 1280  # pixels: larger frames are made smaller before the network sees them
FOCAL = 1.3  # times the longer side of a frame: of a film whose lens is not known

Said = Callable[[str], None]


@dataclass(frozen=True)
class FilmSettings:
    """What a user says about a film; seconds, pixels of the upright frame, degrees."""

    focal: float | None = None
    fov: float | None = None  # of the longer side
    rotation: int | None = None
    crop: tuple[int, int, int, int] | None = None
    first: float = 0.0
    last: float | None = None
    fps: float | None = None  # the film's own at most; None: at most MOST_FPS
    size: int = 512
    seed: int = 0


MOST_FPS = 30.0
NOT_STATED = "terms of the film: not stated"


@dataclass(frozen=True)
class Texts:
    """What a capture says about itself."""

    name: str
    license: str = ""
    consent: str = ""
    author: str = ""


def make_capture(
    video: Path,
    out: Path,
    settings: FilmSettings,
    texts: Texts,
    said: Said,
    told: Callable[[list[note.Note]], None] = lambda _: None,
) -> Path:
    """Write the capture of a film into `out` and return the path of its capture.json; goes on where a run was stopped.

    `told` is called with what should be known of the film, before the long work begins.
    Raises AvatarError for a film that cannot be used, and if `out` holds something else.
    """
    # Its products are small: threads of BLAS cost more than they save, and sums would depend on their number.
    with threadpool_limits(1, "blas"):
        run = _Run(video, out, settings, said)
        try:
            looked = run.looked()
            told(run.judged(looked))
        except AvatarError:
            run.forget()
            raise
        corner, side = run.images(looked)
        track = run.track(looked, corner, side)
        return run.capture(track, texts)


class _Run:
    def __init__(self, video: Path, out: Path, settings: FilmSettings, said: Said) -> None:
        self.settings, self.out, self.work, self.said = settings, out, out / WORK, said
        self.facts = source.probe(video)
        self.fps = min(settings.fps or MOST_FPS, self.facts.fps)
        with video.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        facts = {"tracker": VERSION, "film": digest, **asdict(settings)}
        self._expect_same(json.loads(json.dumps(facts)))
        self.pictures = Pictures(self.work)
        self.pictures.begin()
        write_text(self.work / "film.json", json.dumps(facts, indent=1) + "\n", force=True)

    def _expect_same(self, facts: dict[str, Any]) -> None:
        told = self.work / "film.json"
        if told.is_file():
            try:
                before = dict(json.loads(told.read_text("utf-8")))
            except (ValueError, TypeError):
                raise AvatarError(f"is damaged; remove {self.out}, and begin again", file=told) from None
            other = sorted(key for key in facts if before.get(key) != facts[key])
            if other:
                raise AvatarError(
                    f"holds the capture of another film, or of other options ({', '.join(other)}); "
                    "name another folder, or remove this one",
                    file=self.out,
                )
        elif self.out.exists() and (not self.out.is_dir() or any(self.out.iterdir())):
            what = "is not empty" if self.out.is_dir() else "is a file"
            raise AvatarError(f"{what}; name a new folder", file=self.out)

    def forget(self) -> None:
        """Remove what was begun for a film that is refused, so that other options may be tried."""
        shutil.rmtree(self.work)
        with suppress(OSError):  # it holds something
            self.out.rmdir()

    def frames(self, **options: Any) -> Iterator[tuple[int, float, Picture]]:
        s = self.settings
        return source.frames(
            self.facts, first=s.first, last=s.last, fps=self.fps, rotation=s.rotation, **options
        )

    def looked(self) -> Looked:
        """The landmarks of all frames; from the file, if they are there."""
        path = self.work / Looked.FILE
        if (before := Looked.load(path)) is None:
            with Networks() as networks:
                self._expect_upright(networks)
                found = look(
                    self.frames(crop=self.settings.crop, longest=LOOKED_AT),
                    networks,
                    lambda count: self.said(f"looking for the face: frame {count}"),
                )
            found.save(path)
            return found
        return before

    def _expect_upright(self, networks: Networks) -> None:
        """Raise AvatarError if the first two seconds show a face on its side, unless a rotation was asked for."""
        s = self.settings
        if s.rotation is not None:
            return
        every = max(round(self.facts.fps / 2), 1)
        few = source.frames(
            self.facts, first=s.first, last=s.first + 2, every=every, longest=LOOKED_AT, crop=s.crop
        )

        def leans(picture: Picture) -> float | None:
            face = networks.face(picture)
            return None if face is None else float(judge.roll(face.rotation))

        if turn := judge.upright((picture for _, _, picture in few), leans):
            lying = judge.lying(-turn if turn < 270 else 90, self.facts.rotation)
            raise AvatarError(text.text(lying), file=self.facts.path)

    def judged(self, looked: Looked) -> list[note.Note]:
        """What should be known of the film. Raises AvatarError for what is none to track a face in."""
        found = judge.judge(looked, self._shrunk(), self._turned())
        for one in found:
            if one.severity == "misfit":
                raise AvatarError(text.text(one), file=self.facts.path)
        return [*source.said(self.facts, self.settings.first, self.settings.last), *found]

    def images(self, looked: Looked) -> tuple[tuple[float, float], float]:
        """The square that becomes the capture's image, of the looked-at frames; writes images and masks of it."""
        left, top, side = square(looked)
        size, rows = self.settings.size, np.flatnonzero(looked.seen)
        wanted = {int(row) for row in rows if not self.pictures.there(int(row))}
        if wanted:
            small, shrunk = (
                source.shape(self.facts, LOOKED_AT, self.settings.crop, self.settings.rotation)[:2],
                self._shrunk(),
            )
            with Networks() as networks:
                for row, (_, _, picture) in enumerate(self.frames(crop=self.settings.crop)):
                    if row not in wanted:
                        continue
                    whole = networks.person(
                        np.asarray(cv2.resize(picture, small, interpolation=cv2.INTER_AREA))
                    )
                    image = cut(picture, left / shrunk, top / shrunk, side / shrunk, size)
                    mask = cut(whole, left, top, side, size)
                    self.pictures.write(row, image.astype(np.uint8), np.rint(mask * 255).astype(np.uint8))
                    self.said(f"images and masks: {row + 1} of {len(looked.times)}")
        return (left, top), side

    def track(self, looked: Looked, corner: tuple[float, float], side: float) -> Track:
        """Identity, pose and expression; from the file, if they are there."""
        path = self.out / TRACK_FILE
        if path.is_file():
            return Track.load(path)
        size, scale, shrunk = self.settings.size, self.settings.size / side, self._shrunk()
        start = np.array(self.settings.crop[:2] if self.settings.crop else (0, 0))
        places = (looked.landmarks - corner) * scale
        middle = (
            np.array(source.upright(self.facts, self.settings.rotation)) / 2
        )  # of the film, not of the crop
        lens = self._focal() * shrunk * scale, ((middle - start) * shrunk - corner) * scale
        fit, residual = follow(looked, places, size, lens, self.pictures, self.settings.seed, self.said)
        track = Track.of(
            fit,
            residual,
            looked,
            places,
            size,
            self.fps,
            start + np.array(corner) / shrunk,
            scale * shrunk,
            self._turned(),
        )
        track.save(path.with_suffix(".part"))
        path.with_suffix(".part").replace(path)
        return track

    def _focal(self) -> float:
        """Pixels of the film."""
        s, longer = self.settings, max(self.facts.width, self.facts.height)
        if s.focal:
            return s.focal
        if s.fov:
            return longer / 2 / float(np.tan(np.radians(s.fov) / 2))
        return self.facts.focal_px or FOCAL * longer

    def _turned(self) -> int:
        """Degrees clockwise by which the film is turned."""
        asked = self.settings.rotation
        return self.facts.rotation if asked is None else asked

    def _shrunk(self) -> float:
        """Pixels of the frames that were looked at, in one of the film."""
        return source.shape(self.facts, LOOKED_AT, self.settings.crop, self.settings.rotation)[2]

    def capture(self, track: Track, texts: Texts) -> Path:
        """capture.json, with masks that end at neck or chest, and the body model."""
        person = Person.of(track.identity, self.out / "body")
        rows = np.flatnonzero(track.seen)
        some = rows[np.linspace(0, len(rows) - 1, min(len(rows), KEYFRAMES)).astype(int)]
        still = still_chest(track.fit, person.head, self.pictures.masks(some), some)
        chest = Chest.of(person.head, person.body, still)

        few = rows[np.linspace(0, len(rows) - 1, min(len(rows), FRAMES)).astype(int)]
        plate = Plate.of(self.pictures.colour(few), self.pictures.masks(few))

        def pictures() -> Iterator[tuple[int, Picture, Picture]]:
            for count, row in enumerate(rows):
                self.said(f"writing images and masks: {count + 1} of {len(rows)}")
                one = rows[count : count + 1]
                yield int(row), *plate.mended(self.pictures.colour(one)[0], self.pictures.masks(one)[0])

        return own.write(
            self.out,
            name=texts.name,
            fps=track.fps,
            head_pose_in="camera" if still is None else "mesh",
            expressions=person.names,
            body={
                "kind": "body_model",
                "model": "body/body_model.npz",
                "eyelids": "body",
                "anchor_faces": "body/back_of_head.txt",
            },
            frames=shots(
                person, chest, track.fit, pictures(), face_pixels(track.landmarks[rows].astype(np.float64))
            ),
            source=HEAD_SOURCE,
            license=f"{texts.license or NOT_STATED}; {HEAD_LICENCE}",
            author=texts.author,
            consent=texts.consent,
            poses="estimated",
        )
