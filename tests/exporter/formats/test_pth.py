"""`.pth` and `.frame` without torch: tensors of the genuine layout, and lies about storages refused."""

from __future__ import annotations

import io
import pickle
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest

from avatar_export.formats.pth import read_checkpoint, read_frame
from tests.exporter.refusals import refused
from tests.golden import BlendshapesGolden
from tests.hostile import STORAGES, Canary, Torch, read_all, write_torch_zip

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


def test_views_of_a_storage(tmp_path: Path) -> None:
    parts = (BASE[1:4, ::2], BASE[2], BASE[..., 1], BASE[:, 3:, 2:], BASE[4:, 3:, 2:], BASE[:0])
    for view in (BASE.transpose(2, 0, 1), *parts):
        tensor = read_checkpoint(saved(tmp_path / "a.pth", BASE, view))[0][1]
        np.testing.assert_array_equal(tensor.read(), view)
        np.testing.assert_array_equal(tensor.rows(0, len(view), 0), view)


def test_byteorder_record_and_names_beyond_ascii(tmp_path: Path) -> None:
    torch = Torch()
    content = (torch.tensor(BASE),)
    little, big = (
        torch.save(tmp_path / f"é头{order}.pth", content, order.encode()) for order in ("little", "big")
    )
    np.testing.assert_array_equal(read_checkpoint(little)[0].read(), BASE)
    refused("big-endian", read_checkpoint, big)


LEGACY = pickle.dumps(0x1950A86A20F9469CFC6C, 2)


def test_the_format_before_torch_1_6_is_refused_with_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "old.pth"
    path.write_bytes(LEGACY + pickle.dumps(1001, 2) + pickle.dumps({"little_endian": True}, 2))
    refused(r"before 1\.6; load it once with torch and torch\.save it again", read_checkpoint, path)
    with tarfile.open(path, "w") as archive:
        archive.addfile(tarfile.TarInfo("pickle"), io.BytesIO())
    refused(r"before 1\.6", read_checkpoint, path)


def rezipped(path: Path, kind: int = zipfile.ZIP_STORED, **changes: bytes | None) -> Path:
    """The zip again, with entries (by last part of the name) replaced, or dropped for None."""
    with zipfile.ZipFile(path) as old:
        entries = {info.filename: old.read(info) for info in old.infolist()}
    with zipfile.ZipFile(path, "w") as new:
        for name, data in entries.items():
            content = changes.get(name.rpartition("/")[2], data)
            if content is not None:
                new.writestr(name, content, compress_type=kind if name.endswith("/0") else zipfile.ZIP_STORED)
    return path


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"K<", b"K=", "has 240 bytes, 61 f4 need 244"),
        (b"K\x05K\x04K\x03", b"K\x06K\x04K\x03", r"a/data/0: f4\[6, 4, 3\] needs 288 bytes, but there are 240"),
        (b"K\x0cK\x03K\x01", b"K\x00K\x03K\x01", "overlapping"),
        (b"K\x0cK\x03K\x01", b"K\x0cK\x03N", "strides"),
        (b"X\x01\x00\x00\x000", b"X\x01\x00\x00\x009", "data/9: the storage is missing"),
        (b"X\x01\x00\x00\x000", b"N", "of unknown type"),
        (b"FloatStorage", b"BFloat16Storage", r"asks for torch\.BFloat16Storage"),
        (b"X\x07\x00\x00\x00storage", b"X\x07\x00\x00\x00sturage", "not a storage"),
        (b"_rebuild_tensor_v2", b"_rebuild_tensor_v9", r"asks for torch\._utils\._rebuild_tensor_v9"),
    ],
)  # fmt: skip
def test_tensors_that_do_not_fit_their_storage(tmp_path: Path, old: bytes, new: bytes, message: str) -> None:
    torch = Torch()
    content = torch.pickled((torch.tensor(BASE),))
    assert content.count(old) == 1
    write_torch_zip(tmp_path / "a.pth", content.replace(old, new), torch.storages)
    assert refused(message, read_checkpoint, tmp_path / "a.pth").file == str(tmp_path / "a.pth")


def test_a_tensor_outside_its_storage(tmp_path: Path) -> None:
    torch = Torch()
    content = torch.pickled((torch.tensor(BASE, BASE[1:]),))
    assert content.count(b"QK\x0c") == 1
    for first in (b"QK\x0d", b"QK\x3d", b"QJ\xff\xff\xff\xff", b"QJ\xff\xff\xff\x7f"):
        write_torch_zip(tmp_path / "a.pth", content.replace(b"QK\x0c", first), torch.storages)
        refused(".", read_checkpoint, tmp_path / "a.pth")


def test_storages_must_be_stored_and_whole(tmp_path: Path) -> None:
    path = saved(tmp_path / "a.pth")
    refused("data/0: the storage is compressed", read_checkpoint, rezipped(path, zipfile.ZIP_DEFLATED))
    refused("missing", read_checkpoint, rezipped(saved(path), **{"0": None}))
    refused("has 3 bytes", read_checkpoint, rezipped(saved(path), **{"0": b"abc"}))
    whole = saved(path).read_bytes()
    at = whole.index(b"a/data/0") - 30  # the local header of the storage
    path.write_bytes(whole[:at] + b"XX" + whole[at + 2 :])
    refused("header is damaged", read_checkpoint, path)


def test_what_is_no_checkpoint(tmp_path: Path) -> None:
    path = tmp_path / "a.pth"
    for data in (b"", b"PK\x03\x04", b"hello", saved(tmp_path / "b.pth").read_bytes()[:-30]):
        path.write_bytes(data)
        refused(r"not a zip of torch\.save", read_checkpoint, path)
    refused("not a zip", read_checkpoint, tmp_path / "missing.pth")
    refused("not a zip", read_checkpoint, tmp_path)
    for names, count in ((("a/data.pkl", "b/data.pkl"), 2), (("version",), 0)):
        with zipfile.ZipFile(path, "w") as archive:
            for name in names:
                archive.writestr(name, b"N.")
        refused(rf"{count} entries data\.pkl", read_checkpoint, path)
    canary = Canary(tmp_path)
    for data in canary.pickles(2).values():
        write_torch_zip(path, data, [])
        refused("refused", read_checkpoint, path)
    assert not canary.file.exists()


def test_a_frame_is_a_dict(tmp_path: Path) -> None:
    torch = Torch()
    shape = np.linspace(0, 1, 300, dtype="f4").reshape(1, 300)
    content = {"flame": {"shape": shape, "exp": torch.tensor(np.ones((1, 100), "f4"))}, "frame_id": "00007"}
    frame = read_all(read_frame(torch.save(tmp_path / "00007.frame", content)))
    np.testing.assert_array_equal(frame["flame"]["shape"], shape)
    assert frame["flame"]["exp"].shape == (1, 100) and frame["frame_id"] == "00007"
    refused("not a tracked frame", read_frame, saved(tmp_path / "a.pth"))


def test_golden_checkpoint_holds_what_the_release_dumped(blendshapes_golden: BlendshapesGolden) -> None:
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
