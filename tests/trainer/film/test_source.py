"""Films are read as frames with their times; what is no film is one line."""

from __future__ import annotations

import io
import os
import random
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from avatar_export.notes.text import text
from avatar_runtime import AvatarError
from avatar_trainer.film import boxes
from avatar_trainer.film.source import Facts, Picture, frames, probe, said, shape
from tests.trainer.film import films

COUNT = 24
TURNS = {0: (1, 0, 0, 1), 90: (0, 1, -1, 0), 180: (-1, 0, 0, -1), 270: (0, -1, 1, 0)}


@pytest.fixture(scope="session")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second of film at 24 frames a second, each of another grey."""
    path = tmp_path_factory.mktemp("film") / "film.mp4"
    return films.write(path, [films.picture(10 * k) for k in range(COUNT)], fps=24)


def changed(tmp_path: Path, data: bytes, name: str = "changed.mp4") -> Path:
    (tmp_path / name).write_bytes(data)
    return tmp_path / name


def number(picture: Picture) -> int:
    """Which picture it was, by its grey."""
    return round(float(picture[-4:, -4:].mean()) / 10)


def read(facts: Facts, **options: Any) -> list[tuple[int, float, int]]:
    return [(k, round(time, 4), number(picture)) for k, time, picture in frames(facts, **options)]


def test_facts_and_frames(film: Path) -> None:
    facts = probe(film)
    assert (facts.width, facts.height, facts.fps, facts.frames, facts.seconds) == (64, 32, 24, COUNT, 1)
    assert (facts.rotation, facts.transfer, facts.codec, facts.focal_px) == (0, "sdr", "mp4v", None)
    assert read(facts) == [(k, round(k / 24, 4), k) for k in range(COUNT)]
    assert [k for k, _, _ in read(facts, every=5)] == [0, 5, 10, 15, 20]
    assert [k for k, _, _ in read(facts, first=0.25, last=0.5)] == [6, 7, 8, 9, 10, 11]
    np.testing.assert_allclose(next(frames(facts))[2][4, 4], (200, 30, 30), atol=12)  # RGB


@pytest.mark.parametrize(
    "name, code", [("a.avi", "MJPG"), ("a.mkv", "MJPG"), ("a.webm", "VP80"), ("100%d.mov", "mp4v")]
)
def test_containers(tmp_path: Path, name: str, code: str) -> None:
    facts = probe(films.write(tmp_path / name, [films.picture(10 * k) for k in range(COUNT)], 24, code))
    assert (facts.width, facts.height, facts.rotation, facts.constant) == (64, 32, 0, True)
    assert facts.fps == pytest.approx(24, rel=0.01) and facts.seconds == pytest.approx(1, abs=0.05)
    assert [grey for _, _, grey in read(facts)] == [*range(COUNT)]


def test_a_film_that_states_no_length_is_measured(tmp_path: Path) -> None:
    """As browsers record them."""
    path = films.write(tmp_path / "a.mkv", [films.picture(10 * k) for k in range(COUNT)], 24, "MJPG")
    facts = probe(changed(tmp_path, path.read_bytes().replace(b"\x44\x89\x88", b"\xec\x89\x44"), "b.mkv"))
    assert (facts.frames, facts.seconds) == (COUNT, pytest.approx(1, abs=0.05))


def test_pixels_become_square(film: Path, tmp_path: Path) -> None:
    wide = films.box(b"pasp", struct.pack(">II", 2, 1))
    data = films.edited(
        film.read_bytes(), (*films.TABLE, b"stsd", b"mp4v"), lambda old: old.replace(b"pasp", b"free") + wide
    )
    facts = probe(changed(tmp_path, data))
    assert (facts.width, facts.height) == (128, 32) and next(frames(facts))[2].shape == (32, 128, 3)


@pytest.mark.parametrize("degrees", TURNS)
def test_a_film_with_a_rotation_flag_is_upright_once(film: Path, tmp_path: Path, degrees: int) -> None:
    path = changed(tmp_path, films.turned(film.read_bytes(), TURNS[degrees]))
    facts = probe(path)
    assert facts.rotation == degrees
    upright = next(frames(facts))[2]
    assert upright.shape == (facts.height, facts.width, 3) == (*((64, 32) if degrees % 180 else (32, 64)), 3)
    other = cv2.VideoCapture(str(path)).read()[1]  # OpenCV turns by the flag, too
    np.testing.assert_array_equal(upright, other[:, :, ::-1])
    stored = next(frames(facts, rotation=0))[2]
    np.testing.assert_array_equal(stored, next(frames(probe(film)))[2])


def test_a_film_with_a_mirroring_flag_is_mirrored(film: Path, tmp_path: Path) -> None:
    facts = probe(changed(tmp_path, films.turned(film.read_bytes(), (-1, 0, 0, 1))))
    assert (facts.rotation, facts.mirrored) == (0, True)
    np.testing.assert_array_equal(next(frames(facts))[2][:, ::-1], next(frames(probe(film)))[2])


def test_frames_of_unequal_length_keep_their_times(film: Path, tmp_path: Path) -> None:
    data = film.read_bytes()
    unit = 512  # of the clock of OpenCV's films at 24 frames a second
    runs = [(8, unit), (8, 3 * unit), (8, unit)]
    facts = probe(changed(tmp_path, films.timed(data, runs)))
    times = np.cumsum([0] + [n for count, step in runs for n in [step] * count])[:-1] / unit / 24
    assert not facts.constant and probe(film).constant
    assert facts.fps == pytest.approx(24 / (40 / 24)) and facts.seconds == pytest.approx(40 / 24)
    assert [time for _, time, _ in read(facts)] == pytest.approx(times, abs=1e-3)
    even = read(facts, fps=12)
    assert [k for k, _, _ in even] == [*range(20)]
    for k, time, grey in even:
        assert time == round(k / 12, 4)
        assert abs(times[grey] - time) <= np.abs(times - time).min() + 1e-3


def test_frames_become_smaller_while_they_are_read(tmp_path: Path) -> None:
    pictures = [films.picture(10 * k, 1280, 720) for k in range(10)]
    facts = probe(films.write(tmp_path / "large.mp4", pictures))
    assert shape(facts, longest=160) == (160, 90, 0.125)
    assert next(frames(facts, longest=160))[2].shape == (90, 160, 3)
    crop = 0, 360, 640, 360
    assert shape(facts, 80, crop) == (80, 45, 0.125)
    cut = next(frames(facts, longest=80, crop=crop))[2]
    assert cut.shape == (45, 80, 3) and cut.max() < 20  # nothing of the red quarter


def test_hdr_becomes_sdr(film: Path, tmp_path: Path) -> None:
    """OpenCV's FFmpeg does it: the middle of HLG becomes brighter, greys stay nearly grey."""
    facts = probe(changed(tmp_path, films.coloured(film.read_bytes(), 18)))
    assert facts.transfer == "hlg"
    made = np.stack([picture[-4:, -4:].mean((0, 1)) for _, _, picture in frames(facts)])
    assert np.ptp(made, axis=1).max() <= 10 and (np.diff(made[:, 1]) >= 0).all()
    assert made[12, 1] == pytest.approx(135, abs=8)
    assert probe(changed(tmp_path, films.coloured(film.read_bytes(), 16))).transfer == "pq"


@pytest.mark.parametrize("where", [films.TRACK[:1], films.TRACK])
@pytest.mark.parametrize(
    "kind, value",
    [(22, b"\0\x1a"), (21, b"\x1a"), (1, b"26"), (23, struct.pack(">f", 26)), (67, struct.pack(">i", 26))],
)
def test_the_lens_is_read(
    film: Path, tmp_path: Path, where: tuple[bytes, ...], kind: int, value: bytes
) -> None:
    facts = probe(changed(tmp_path, films.lensed(film.read_bytes(), kind, value, where)))
    assert facts.focal_px == pytest.approx(26 * 64 / 34.6)


def test_an_edit_list_shortens_a_film(film: Path, tmp_path: Path) -> None:
    half = struct.pack(">IIIiI", 0, 1, 500, 0, 65536)  # of 1000 units a second
    data = films.edited(film.read_bytes(), (*films.TRACK, b"edts", b"elst"), lambda _: half)
    facts = probe(changed(tmp_path, data))
    assert (facts.seconds, facts.fps) == (0.5, 24)
    assert len(read(facts)) == 12


def _films(film: Path, tmp_path: Path) -> dict[str, bytes]:
    """Files that are no usable film, by what the error must say."""
    data = film.read_bytes()
    index = data.index(b"moov") - 4

    def short(count: int) -> bytes:
        pictures = [films.picture(10 * k) for k in range(count)]
        return films.write(tmp_path / "short.mp4", pictures).read_bytes()

    def picture(kind: str) -> bytes:
        return cv2.imencode(kind, films.picture(80))[1].tobytes()

    handler, entry = (*films.TRACK, b"mdia", b"hdlr"), (*films.TABLE, b"stsd", b"mp4v")
    return {
        "is empty": b"",
        "no video that is known": b"#EXTM3U\nhttp://127.0.0.1:9/a.ts\n",
        "no video that is  known": b"ffconcat version 1.0\nfile film.mp4\n",
        "still picture": picture(".jpg"),
        "still  picture": picture(".png"),
        "a still picture": films.box(b"ftyp", b"heic\0\0\0\0mif1"),
        "still picture: one frame": short(1),
        "only 3 frames": short(3),
        "sound but no picture": b"RIFF\x24\0\0\0WAVEfmt " + bytes(64),
        "sound but no  picture": films.edited(data, handler, lambda _: bytes(8) + b"soun" + bytes(13)),
        "no index (moov)": data[:index],
        "is cut off": data[: index + 100],
        "is cut off: it": data[:200],
        "cut off: it should have 1099511627776": b"\0\0\0\1moov" + struct.pack(">Q", 1 << 40) + bytes(1 << 10),
        "broken MP4": data[:index] + films.box(b"moov", films.box(b"trak", b"\0\0\xff\xfftkhd")),
        "boxes": films.box(b"free", b"") * 200_001,
        "30000x30000 pixels": films.edited(data, entry, lambda b: b[:24] + struct.pack(">HH", 30000, 30000) + b[28:]),
        "frames a second, which cannot": films.timed(data, [(COUNT - 1, 1), (1, 0)]),
        "Dolby Vision": data.replace(b"mp4v", b"dvh1"),
        "cannot be decoded": data.replace(b"mp4v", b"zzzz").replace(b"esds", b"free"),
        "no frame that can be decoded": films.edited(data, (b"mdat",), lambda b: bytes(len(b))),
    }  # fmt: skip


def test_what_is_no_film_is_one_line(film: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for message, data in _films(film, tmp_path).items():
        path = changed(tmp_path, data)
        with pytest.raises(AvatarError) as caught:
            probe(path)
        text = str(caught.value)
        assert text.startswith(f"{path}: ") and "\n" not in text
        assert " ".join(message.split()) in text, (message, text)
        assert ";" in text or ":" in text.removeprefix(f"{path}: "), text  # what to do
    assert capfd.readouterr() == ("", "")


def test_only_files_are_opened(film: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "a0001.png").write_bytes(cv2.imencode(".png", films.picture(9))[1].tobytes())
    for name in ("-", "http://127.0.0.1:9/a.mp4", "a%04d.png", "gone.mp4"):
        with pytest.raises(AvatarError, match="is not there; name a video file"):
            probe(Path(name))
    for path, why in ((tmp_path, "is a folder"), (tmp_path / "pipe", "is no file")):
        with pytest.raises(AvatarError, match=f"{why}; name a video file"):
            probe(path)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"first": 1.0}, "--first: 1 is no second of the film"),
        ({"first": 0.5, "last": 0.5}, "--last: 0.5 is not behind"),
        ({"rotation": 45}, "--rotation: 45 is none of"),
        ({"crop": (0, 0, 65, 32)}, "--crop: 0,0,65,32 is not inside .* 64x32"),
        ({"crop": (0, 0, 64, 32), "rotation": 90}, "--crop: .* 32x64"),
    ],
)
def test_wrong_options(film: Path, options: dict[str, Any], message: str) -> None:
    with pytest.raises(AvatarError, match=message):
        frames(probe(film), **options)


def test_hostile_indexes_are_read_or_refused(film: Path) -> None:
    data = films.lensed(films.coloured(film.read_bytes(), 18), 22, b"\0\x1a", films.TRACK[:1])
    index, chance = data.index(b"moov") - 4, random.Random(1)
    refused = 0
    for _ in range(1500):
        bad = bytearray(data)
        for _ in range(chance.choice((1, 1, 4))):
            at = chance.randrange(index, len(bad) - 4)
            bad[at : at + 4] = chance.choice(
                (b"\0\0\0\0", b"\xff\xff\xff\xff", b"\0\0\0\1", chance.randbytes(4))
            )
        try:
            boxes.read(io.BytesIO(bytes(bad)), "film")
        except AvatarError:
            refused += 1
    assert 0 < refused < 1500


def test_what_should_be_known_is_said(film: Path) -> None:
    facts = probe(film)
    assert said(facts) == said(replace(facts, seconds=1200.0), last=1200) == []
    odd = said(replace(facts, seconds=1200.0, transfer="hlg", constant=False), first=30)
    hdr, uneven, part = map(text, odd)
    assert "HDR (HLG)" in hdr and "unequal" in uneven and "1200 seconds, those from 30 to 90" in part
