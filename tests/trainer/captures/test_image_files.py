"""Headers, kinds and damage of images."""

from __future__ import annotations

import io
import struct
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures import image_files
from tests.trainer.captures import folders


def saved(path: Path, mode: str) -> Path:
    Image.fromarray(folders.image(1)).convert(mode).save(path)
    return path


def test_colour_is_read_as_it_stands(tmp_path: Path) -> None:
    rgba = np.dstack([folders.image(1), folders.mask(1)])
    Image.fromarray(rgba).save(tmp_path / "a.png")
    assert image_files.header(tmp_path / "a.png") == image_files.Header(folders.WIDTH, folders.HEIGHT, "RGBA")
    assert np.array_equal(np.rint(image_files.colour(tmp_path / "a.png") * 255), rgba[..., :3]), (
        "straight, not multiplied"
    )
    matte = image_files.matte(tmp_path / "a.png", tmp_path / "a.png")
    assert np.array_equal(np.rint(matte * 255), rgba[..., 3])
    assert matte.dtype == np.float32 and float(image_files.colour(tmp_path / "a.png").max()) <= 1


@pytest.mark.parametrize("mode", ["L", "P", "1", "I;16", "CMYK"])
def test_colour_of_another_kind_is_refused(tmp_path: Path, mode: str) -> None:
    path = tmp_path / ("a.jpg" if mode == "CMYK" else "a.png")
    if mode == "I;16":
        Image.fromarray(folders.mask(1).astype(np.uint16) * 257).save(path)
    else:
        saved(path, mode)
    with pytest.raises(AvatarError, match=rf"{path.name}: is an image of mode {mode}; 8-bit RGB is needed"):
        image_files.colour(path)


def test_a_mask_with_an_alpha_of_its_own_is_refused(tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match="mode RGBA; a mask has one channel"):
        image_files.matte(saved(tmp_path / "m.png", "RGBA"), tmp_path / "a.png")


@pytest.mark.parametrize("suffix", ["png", "jpg"])
@pytest.mark.parametrize("kept", [0, 4, 30, 0.5, 0.97])
def test_cut_off_files_are_found_without_decoding(tmp_path: Path, suffix: str, kept: float) -> None:
    path = saved(tmp_path / f"a.{suffix}", "RGB")
    data = path.read_bytes()
    path.write_bytes(data[: int(kept if kept >= 1 else kept * len(data))])
    with pytest.raises(AvatarError, match=rf"a\.{suffix}: (is cut off|cannot be read)"):
        image_files.header(path)


@pytest.mark.parametrize("side", [8193, 16384, 60000, 2**31 - 1])
def test_absurd_sizes_are_refused_before_anything_is_allocated(tmp_path: Path, side: int) -> None:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    data = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
    path = tmp_path / "a.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + data)
    tracemalloc.start()
    try:
        with pytest.raises(AvatarError, match=r"a\.png: has .*sides"):
            image_files.colour(path)
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def test_other_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(AvatarError, match=r"nothing\.png: no such image"):
        image_files.header(tmp_path / "nothing.png")
    with pytest.raises(AvatarError, match="cannot be read"):
        image_files.header(tmp_path)
    gif = io.BytesIO()
    Image.fromarray(folders.image(1)).save(gif, "GIF")
    (tmp_path / "a.png").write_bytes(gif.getvalue())
    with pytest.raises(AvatarError, match="cannot be read as a PNG or JPEG"):
        image_files.header(tmp_path / "a.png")
    monkeypatch.setattr(image_files, "MAX_FILE_BYTES", 10)
    with pytest.raises(AvatarError, match="bytes long; up to 10 are read"):
        image_files.header(saved(tmp_path / "b.png", "RGB"))
