"""`.pth` and `.frame` without torch: tensors of the genuine layout, and lies about storages refused."""

from __future__ import annotations

import io
import pickle
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_export.formats.pth import read_checkpoint, read_frame
from avatar_runtime.io.errors import AvatarError
from tests.golden import BlendshapesGolden
from tests.hostile import (
    MANGLING,
    STORAGES,
    Canary,
    Torch,
    mangled,
    only_avatar_errors,
    peak_bytes,
    read_all,
    write_torch_zip,
)

BASE = np.arange(60, dtype="<f4").reshape(5, 4, 3)


def saved(path: Path, base: np.ndarray = BASE, view: np.ndarray | None = None) -> Path:
    torch = Torch()
    return torch.save(path, ((3, torch.wrapped(torch.tensor(base, view)), {"lr": 0.1}), 40000))


@pytest.mark.parametrize("code", STORAGES)
def test_every_storage_type(tmp_path: Path, code: str) -> None:
    base = (np.arange(24).reshape(4, 6) % 5).astype("<" + code)
    (degree, tensor, rest), iteration = read_checkpoint(saved(tmp_path / "fix_chkpnt.pth", base))
    assert (degree, rest, iteration) == (3, {"lr": 0.1}, 40000)
    assert (tensor.name, tensor.shape, tensor.dtype) == ("[0][1]", (4, 6), base.dtype)
    np.testing.assert_array_equal(tensor.read(), base)
    np.testing.assert_array_equal(tensor.rows(1, 3), base[1:3].astype("f4"))


@pytest.mark.parametrize(
    "view",
    [
        BASE.transpose(2, 0, 1),
        BASE[1:4, ::2],
        BASE[2],
        BASE[..., 1],
        BASE[:, 3:, 2:],
        BASE[4:, 3:, 2:],
        BASE[:0],
    ],
)
def test_views_of_a_storage(tmp_path: Path, view: np.ndarray) -> None:
    tensor = read_checkpoint(saved(tmp_path / "a.pth", BASE, view))[0][1]
    np.testing.assert_array_equal(tensor.read(), view)
    np.testing.assert_array_equal(tensor.rows(0, len(view), 0), view)


def test_tensors_may_share_a_storage_and_have_no_dimensions(tmp_path: Path) -> None:
    torch = Torch()
    step = torch.tensor(np.array(7.0, "f4"))
    a, b = read_checkpoint(torch.save(tmp_path / "a.pth", [step, step]))
    assert a.shape == b.shape == () and a.read() == b.read() == 7


def test_a_large_file_opens_without_being_read(tmp_path: Path) -> None:
    torch = Torch()
    base = np.zeros((20_000, 16, 50), np.float32)
    base[9000:9010] = 5
    path = torch.save(tmp_path / "a.pth", (torch.tensor(base),))
    assert peak_bytes(lambda: read_checkpoint(path)[0].rows(9000, 9010)) < 300_000
    assert (read_checkpoint(path)[0].rows(8999, 9011)[:, 0, 0] == [0, *[5] * 10, 0]).all()


def test_byteorder_record_and_names_beyond_ascii(tmp_path: Path) -> None:
    torch = Torch()
    content = (torch.tensor(BASE),)
    np.testing.assert_array_equal(
        read_checkpoint(torch.save(tmp_path / "é头.pth", content, b"little"))[0].read(), BASE
    )
    with pytest.raises(AvatarError, match="big-endian"):
        read_checkpoint(torch.save(tmp_path / "b.pth", content, b"big"))


LEGACY = pickle.dumps(0x1950A86A20F9469CFC6C, 2)


def test_the_format_before_torch_1_6_is_refused_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "old.pth"
    path.write_bytes(LEGACY + pickle.dumps(1001, 2) + pickle.dumps({"little_endian": True}, 2))
    with pytest.raises(AvatarError, match=r"before 1\.6; load it once with torch and torch\.save it again"):
        read_checkpoint(path)
    with tarfile.open(path, "w") as archive:
        archive.addfile(tarfile.TarInfo("pickle"), io.BytesIO())
    with pytest.raises(AvatarError, match=r"before 1\.6"):
        read_checkpoint(path)


def rezipped(path: Path, **changes: bytes | None) -> Path:
    """The zip again, with entries (by last part of the name) replaced, or dropped for None."""
    with zipfile.ZipFile(path) as old:
        entries = {info.filename: old.read(info) for info in old.infolist()}
    with zipfile.ZipFile(path, "w") as new:
        for name, data in entries.items():
            content = changes.get(name.rpartition("/")[2], data)
            if content is not None:
                new.writestr(name, content)
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"K<", b"K=", "has 240 bytes, 61 f4 need 244"),
        (
            b"K\x05K\x04K\x03",
            b"K\x06K\x04K\x03",
            r"a/data/0: f4\[6, 4, 3\] needs 288 bytes, but there are 240",
        ),
        (b"K\x0cK\x03K\x01", b"K\x0dK\x03K\x01", "needs 256 bytes, but there are 240"),
        (b"K\x0cK\x03K\x01", b"K\x00K\x03K\x01", "overlapping"),
        (b"K\x0cK\x03K\x01", b"K\x0cK\x03N", "strides"),
        (b"X\x01\x00\x00\x000", b"X\x01\x00\x00\x009", "data/9: the storage is missing"),
        (b"X\x01\x00\x00\x000", b"N", "of unknown type"),
        (b"FloatStorage", b"LongStorage", "has 240 bytes, 60 i8 need 480"),
        (b"FloatStorage", b"BFloat16Storage", r"asks for torch\.BFloat16Storage"),
        (b"X\x07\x00\x00\x00storage", b"X\x07\x00\x00\x00sturage", "not a storage"),
        (b"_rebuild_tensor_v2", b"_rebuild_tensor_v9", r"asks for torch\._utils\._rebuild_tensor_v9"),
    ],
)
def test_tensors_that_do_not_fit_their_storage_are_refused(
    tmp_path: Path, old: bytes, new: bytes, message: str
) -> None:
    torch = Torch()
    content = torch.pickled((torch.tensor(BASE),))
    assert content.count(old) == 1
    path = tmp_path / "a.pth"
    write_torch_zip(path, content.replace(old, new), torch.storages)
    with pytest.raises(AvatarError, match=message) as caught:
        read_checkpoint(path)
    assert caught.value.file == str(path)


def test_a_tensor_outside_its_storage_is_refused(tmp_path: Path) -> None:
    torch = Torch()
    content = torch.pickled((torch.tensor(BASE, BASE[1:]),))
    assert content.count(b"QK\x0c") == 1
    for first in (b"QK\x0d", b"QK\x3d", b"QJ\xff\xff\xff\xff", b"QJ\xff\xff\xff\x7f"):
        path = tmp_path / "a.pth"
        write_torch_zip(path, content.replace(b"QK\x0c", first), torch.storages)
        with pytest.raises(AvatarError):
            read_checkpoint(path)


def test_storages_must_be_stored_and_whole(tmp_path: Path) -> None:
    path = saved(tmp_path / "a.pth")
    with zipfile.ZipFile(path) as old:
        entries = {info.filename: old.read(info) for info in old.infolist()}
    with zipfile.ZipFile(path, "w") as new:
        for name, data in entries.items():
            kind = zipfile.ZIP_DEFLATED if name.endswith("/0") else zipfile.ZIP_STORED
            new.writestr(name, data, compress_type=kind)
    with pytest.raises(AvatarError, match="data/0: the storage is compressed"):
        read_checkpoint(path)
    with pytest.raises(AvatarError, match="missing"):
        read_checkpoint(rezipped(saved(path), **{"0": None}))
    with pytest.raises(AvatarError, match="has 3 bytes"):
        read_checkpoint(rezipped(saved(path), **{"0": b"abc"}))
    whole = saved(path).read_bytes()
    at = whole.index(b"a/data/0") - 30  # the local header of the storage
    path.write_bytes(whole[:at] + b"XX" + whole[at + 2 :])
    with pytest.raises(AvatarError, match="header is damaged"):
        read_checkpoint(path)


def test_what_is_no_checkpoint_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.pth"
    for data in (b"", b"PK\x03\x04", b"hello", saved(tmp_path / "b.pth").read_bytes()[:-30]):
        path.write_bytes(data)
        with pytest.raises(AvatarError, match=r"not a zip of torch\.save"):
            read_checkpoint(path)
    with pytest.raises(AvatarError, match="not a zip"):
        read_checkpoint(tmp_path / "missing.pth")
    with pytest.raises(AvatarError, match="not a zip"):
        read_checkpoint(tmp_path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a/data.pkl", b"N.")
        archive.writestr("b/data.pkl", b"N.")
    with pytest.raises(AvatarError, match=r"2 entries data\.pkl"):
        read_checkpoint(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("version", b"3")
    with pytest.raises(AvatarError, match=r"0 entries data\.pkl"):
        read_checkpoint(path)


def test_commands_in_a_checkpoint_are_refused_and_not_run(tmp_path: Path) -> None:
    canary, path = Canary(tmp_path), tmp_path / "a.pth"
    for data in canary.pickles(2).values():
        write_torch_zip(path, data, [])
        with pytest.raises(AvatarError, match="refused"):
            read_checkpoint(path)
    assert not canary.file.exists()


def test_a_frame_is_a_dict(tmp_path: Path) -> None:
    torch = Torch()
    shape = np.linspace(0, 1, 300, dtype="f4").reshape(1, 300)
    content = {"flame": {"shape": shape, "exp": torch.tensor(np.ones((1, 100), "f4"))}, "frame_id": "00007"}
    frame = read_all(read_frame(torch.save(tmp_path / "00007.frame", content)))
    np.testing.assert_array_equal(frame["flame"]["shape"], shape)
    assert frame["flame"]["exp"].shape == (1, 100) and frame["frame_id"] == "00007"
    with pytest.raises(AvatarError, match="not a tracked frame"):
        read_frame(saved(tmp_path / "a.pth"))


def checkpoint_bytes(folder: Path) -> tuple[bytes, bytes, list[bytes]]:
    torch = Torch()
    content = ((3, torch.wrapped(torch.tensor(BASE)), torch.tensor(np.ones(3, "i8")), {"state": {0: 1.5}}), 7)
    path = torch.save(folder / "whole.pth", content)
    torch.storages.clear()
    return path.read_bytes(), torch.pickled(content), [BASE.tobytes(), np.ones(3, "i8").tobytes()]


@MANGLING
@given(data=st.data())
def test_mangled_checkpoints_give_data_or_an_avatar_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.getbasetemp()
    whole, pickled, storages = checkpoint_bytes(folder)
    path = folder / "mangled.pth"
    if data.draw(st.booleans()):
        path.write_bytes(data.draw(mangled(whole)))
    else:  # with sound checksums
        write_torch_zip(path, data.draw(mangled(pickled)), storages)
    only_avatar_errors(lambda: read_all(read_checkpoint(path)))


def test_golden_checkpoint_holds_what_the_release_dumped(blendshapes_golden: BlendshapesGolden) -> None:
    """Fields that the release's own dump copies as they are, at the rows that it keeps."""
    golden = blendshapes_golden
    face, iteration = read_checkpoint(golden.raw / "fix_chkpnt40000.pth")
    rows = golden.static()["raw_row_of_kept"][golden.face_rows]
    assert (len(face), iteration, face[0]) == (19, 40000, 3)
    for index, name in ((1, "pos"), (4, "scale"), (5, "rot"), (6, "opacity")):
        np.testing.assert_array_equal(
            face[index].read()[rows], np.load(golden.viewer / f"fix_chkpnt40000/{name}.npy"), err_msg=name
        )
    sh = np.concatenate([face[2].read(), face[3].read()], axis=1)[rows]
    np.testing.assert_array_equal(sh, np.load(golden.viewer / "fix_chkpnt40000/shs.npy"))
    for mouth in ("mouth0_chkpnt40000", "mouth1_chkpnt40000"):
        items, _ = read_checkpoint(golden.raw / f"{mouth}.pth")
        assert len(items) == 12
        np.testing.assert_array_equal(items[1].read(), np.load(golden.viewer / mouth / "pos.npy"))


def test_golden_frames(blendshapes_golden: BlendshapesGolden) -> None:
    for index in range(4):
        frame, want = read_frame(blendshapes_golden.frame_file(index)), blendshapes_golden.frame(index)
        for key, name in (("exp", "exp"), ("shape", "shape"), ("jaw", "jaw_6d"), ("eyes", "eyes_6d")):
            np.testing.assert_array_equal(frame["flame"][key].read()[0], want[name])
        np.testing.assert_array_equal(frame["opencv"]["K"].read()[0], want["camera_K"])
