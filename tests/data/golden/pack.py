"""Makes the committed golden vectors: `python tests/data/golden/pack.py SOURCE_FOLDER`.

SOURCE_FOLDER holds `rasteriser/`, `gaussian_blendshapes/` and `splatting_avatar/` as README.md describes them. Same source, same
bytes (of one liblzma). What is left out, and why, stands beside each rule below.
"""

from __future__ import annotations

import io
import json
import lzma
import sys
import tarfile
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[2]))

from tests.golden import FRAMES, digest, dumps  # noqa: E402

Array = npt.NDArray[Any]

BIG_CASES = ("dense", "playbot_a")
# Only these are compared within a tolerance; of the other outputs, which must be equal, a digest says enough.
COMPARED_BY_VALUE = ("out_color", "final_T")
FACE_ROW_STEP = 7
VERTEX_ROW_STEP = 4
SURFACE_FILES = ("splatting_avatar/small_*/**/*", "gaussian_avatars/small_*/**/*")
# Words of 4 bytes lie aligned in torch's zip records and pickled arrays.
FILES_FILTER = [{"id": lzma.FILTER_LZMA2, "preset": 9 | lzma.PRESET_EXTREME, "lc": 0, "lp": 2, "pb": 2}]


def pack_rasteriser(source: Path, target: Path) -> None:
    """Every case without the fused-multiply-add variant; the big ones with digests for what must be equal."""
    index = {}
    for case in json.loads((source / "cases.json").read_text())["cases"]:
        name = case["name"]
        arrays = read_npz(source / case["file"])
        arrays = {key: value for key, value in arrays.items() if not key.endswith("_fma")}
        digests = {}
        if name in BIG_CASES:
            hashed = [key for key in arrays if key in case["outputs"] and key not in COMPARED_BY_VALUE]
            digests = {key: digest(arrays.pop(key)) for key in hashed}
        (target / f"{name}.planes.xz").write_bytes(dumps(arrays))
        index[name] = {"why": case["why"], "source_sha256": case["sha256"], "digests": digests}
        if "gaussian_labels" in case:
            index[name]["gaussian_labels"] = case["gaussian_labels"]
    (target / "cases.json").write_text(json.dumps(index, indent=1) + "\n")


def pack_gaussian_blendshapes(source: Path, target: Path) -> None:
    body = read_npz(source / "body" / "body_model.npz")
    kept = len(read_npz(source / "golden" / "static.npz")["raw_row_of_kept"])
    vertices = len(body["v_template"])
    anchors = body["faces"][body["back_of_head_faces"]]
    face_rows = np.arange(0, kept, FACE_ROW_STEP, dtype=np.int32)
    vertex_rows = np.union1d(anchors, np.arange(0, vertices, VERTEX_ROW_STEP)).astype(np.int32)

    (target / "body_model.planes.xz").write_bytes(dumps(body))
    (target / "viewer.planes.xz").write_bytes(dumps(viewer_arrays(source / "model_viewer.zip", face_rows)))
    golden = {"face_rows": face_rows, "vertex_rows": vertex_rows}
    for file in ("static", *(f"frame_{index:05d}" for index in FRAMES)):
        for key, value in read_npz(source / "golden" / f"{file}.npz").items():
            if key.startswith("face_"):
                value = value[face_rows]
            if key.startswith("mesh_"):
                value = value[vertex_rows]
            golden[f"{file}/{key}"] = value
    (target / "golden.planes.xz").write_bytes(dumps(golden))
    (target / "files.tar.xz").write_bytes(tar_xz(whole_files(source)))
    for notice in sorted(source.glob("NOTICE.*.txt")):
        (target / notice.name).write_bytes(notice.read_bytes())


def pack_splatting_avatar(source: Path, target: Path) -> None:
    """The small cases of both systems, whole; their heads are in the full set alone."""
    files: dict[str, bytes] = {}
    for pattern in SURFACE_FILES:
        for path in sorted(source.glob(pattern)):
            if path.is_file():
                stored = path.suffix == ".npz" and path.name != "flame_param.npz"
                files[path.relative_to(source).as_posix()] = stored_npz(path) if stored else path.read_bytes()
    (target / "files.tar.xz").write_bytes(tar_xz(files))


def stored_npz(path: Path) -> bytes:
    """The same arrays without compression, so that xz sees them."""
    buffer = io.BytesIO()
    np.savez(buffer, **read_npz(path))
    return buffer.getvalue()


def viewer_arrays(archive: Path, face_rows: Array) -> dict[str, Array]:
    """The dump's `.npy` files by path; face arrays at `face_rows` (their row axis is 1 in pos_t alone)."""
    arrays = {}
    with zipfile.ZipFile(archive) as file:
        for name in sorted(file.namelist()):
            if not name.endswith(".npy"):
                continue
            array = np.load(io.BytesIO(file.read(name)), allow_pickle=False)
            if "fix_chkpnt" in name:
                array = np.take(array, face_rows, axis=1 if name.endswith("/pos_t.npy") else 0)
            arrays[name.removeprefix("model/")] = array
    return arrays


def whole_files(source: Path) -> dict[str, bytes]:
    """What readers must meet byte for byte: the raw checkpoint, tracked frames, eyelids, anchor faces."""
    files = {}
    with zipfile.ZipFile(source / "model_raw.zip") as archive:
        for info in archive.infolist():
            if not info.is_dir():
                files["raw/" + info.filename.removeprefix("model/")] = archive.read(info)
    for pattern in ("dataset/checkpoint/*.frame", "dataset/params/*.bin", "body/*.txt", "body/*.npy"):
        for path in source.glob(pattern):
            files[path.relative_to(source).as_posix()] = path.read_bytes()
    return dict(sorted(files.items()))


def tar_xz(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for name, data in files.items():
            entry = tarfile.TarInfo(name)  # time, owner and mode stay at their fixed defaults
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    return lzma.compress(buffer.getvalue(), format=lzma.FORMAT_XZ, filters=FILES_FILTER)


def read_npz(path: Path) -> dict[str, Array]:
    with np.load(path, allow_pickle=False) as file:
        return {key: file[key] for key in file.files}


PACKS = {
    "rasteriser": pack_rasteriser,
    "gaussian_blendshapes": pack_gaussian_blendshapes,
    "splatting_avatar": pack_splatting_avatar,
}


def main() -> None:
    source = Path(sys.argv[1])
    for name, pack in PACKS.items():
        (HERE / name).mkdir(exist_ok=True)
        pack(source / name, HERE / name)
    for path in sorted(HERE.rglob("*.*")):
        print(f"{path.stat().st_size:>9,}  {path.relative_to(HERE)}")


if __name__ == "__main__":
    main()
