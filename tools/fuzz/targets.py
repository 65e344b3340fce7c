"""What is attacked: small sound inputs, and what reads them.

A target writes its sound inputs, each a folder of files, and reads one such folder. Hostile copies of the files must
give a sound result or an AvatarError of one line.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import pickle
import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from random import Random

import numpy as np
from tests.avatars import full_avatar, leaves, surface_avatar
from tests.exporter.bodies import body_files
from tests.exporter.live import senders
from tests.exporter.readers import lhm_files, splatting_files
from tests.exporter.rigs import rig_files
from tests.hostile import Torch, py2_array, py2_dict
from tests.runtime.conformance import made

from avatar_export.bodies.body_model import read_body_model
from avatar_export.bodies.pose_files import read_poses
from avatar_export.bodies.subject_files import read_shape
from avatar_export.checks.bundle import validate
from avatar_export.clips.sources import clips_from
from avatar_export.distill.prepare import prepared
from avatar_export.driving.matrix import with_driving
from avatar_export.driving.takes import read_take
from avatar_export.formats.mesh_files import read_mesh
from avatar_export.live.inbox import Inbox
from avatar_export.live.messages import channels_of
from avatar_export.live.vmc import VmcReader
from avatar_export.options import ReadOptions
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_export.readers.table import read
from avatar_export.rigs.rig_file import read_rig_file
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.codec import safetensors
from avatar_runtime.conformance import conform_outputs, decode, decode_driving, driving_cases, encode_driving
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.packs import decode_pack
from tools.fuzz import checkpoints

MOST = 1 << 26  # bytes of a file
AVATARS: dict[str, Callable[[], Avatar]] = {
    "joints": lambda: full_avatar(3),
    "surface": lambda: surface_avatar(3),
    "bare surface": lambda: surface_avatar(3, rigged=False),
}
PLAIN = {"preview": False, "engine_files": False}


@dataclass(frozen=True)
class Target:
    """One thing to attack."""

    make: Callable[[Path], None]  # writes folders of sound files into a new folder
    read: Callable[[Path], object]  # of one such folder; raises AvatarError
    attacked: tuple[str, ...] = ("*",)  # patterns of the files that are changed, relative to their folder
    finish: Callable[[Path, Random], None] = lambda _folder, _rng: None  # after a change, before it is read
    finished: tuple[str, ...] = ()  # the files that `finish` changes


def sound(result: object) -> None:
    """Fails for an avatar that holds a number which is not finite."""
    if isinstance(result, Avatar):
        for path, value in leaves(result).items():
            if isinstance(value, np.ndarray) and value.dtype.kind == "f":
                assert np.isfinite(value).all(), path


def _bundles(folder: Path) -> None:
    for name, avatar in AVATARS.items():
        write_bundle(avatar(), folder / name, reference=False, **PLAIN)
    write_bundle(full_avatar(5), folder / "left", reference=False, handedness="left", **PLAIN)


def _signed(folder: Path, rng: Random) -> None:
    """Sizes and hashes as the changed files have them, mostly: damage that hashes do not show."""
    path = folder / "avatar.json"
    try:
        document = json.loads(path.read_bytes())
        entries = document["files"]
        if rng.random() < 0.9:
            for entry in entries:
                data = (folder / entry["path"]).read_bytes()
                entry |= {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
            path.write_text(json.dumps(document))
    except (ValueError, KeyError, TypeError, OSError, AttributeError):
        return  # the manifest itself has been changed


def _zipped(folder: Path) -> None:
    for name, avatar in AVATARS.items():
        (folder / name).mkdir()
        write_bundle(avatar(), folder / name / "x.avatar.zip", reference=False, **PLAIN)


def _packs(folder: Path) -> None:
    for name, avatar in AVATARS.items():
        (folder / name).mkdir()
        (folder / name / "x.avatar").write_bytes(pack([avatar()], Fineness(40.0)).file)


def _references(folder: Path) -> None:
    """A small reference, the vectors of driving beside it, and the outputs of a port that repeats it."""
    files = made.encoded()
    vectors = safetensors.decode(files["vectors.safetensors"], "x")
    cases = json.loads(files["cases.json"])["cases"]
    named = [o["tensor"] for c in cases for s in c["stages"] for o in s["outputs"].values()]
    files |= {"outputs.safetensors": b"".join(safetensors.encode({name: vectors[name] for name in named}))}
    files |= encode_driving(driving_cases(made.avatar(), generator="made for tests"))
    (folder / "port").mkdir()
    for name, data in files.items():
        (folder / "port" / name).write_bytes(data)


def _conform(folder: Path) -> object:
    def one(name: str, most: int) -> bytes:
        return read_bytes(folder / name, most)

    tensors = safetensors.decode(one("outputs.safetensors", MOST), "outputs.safetensors")
    return conform_outputs(made.avatar(), decode(one), tensors), decode_driving(one)


def _bodies(folder: Path) -> None:
    for name, parents in (("flame", body_files.FLAME_PARENTS), ("smpl", body_files.SMPL_PARENTS)):
        (folder / name).mkdir()
        path = body_files.write_body(folder / name / "body.npz", body_files.body(parents))
    arrays = {key: array for key, array in dict(np.load(path)).items() if array.size}
    for name, data in {
        "pickle of Python 2": py2_dict({key: py2_array(array) for key, array in arrays.items()}),
        **{f"pickle {protocol}": pickle.dumps(arrays, protocol) for protocol in (0, 2, 4)},
    }.items():
        (folder / name).mkdir()
        (folder / name / "body.pkl").write_bytes(data)


def _frames(folder: Path) -> None:
    (folder / "frame").mkdir()
    content = {"flame": {"shape": np.ones((1, 9), "f4")}, "frame_id": "00000"}
    Torch().save(folder / "frame" / "00000.frame", content)


def _poses(folder: Path) -> None:
    for name in ("flame", "smpl", "param"):
        (folder / name).mkdir()
    flame = body_files.poses(len(body_files.FLAME_PARENTS))
    body_files.flame_json(folder / "flame" / "flame_params.json", flame)
    body_files.smpl_npz(folder / "smpl" / "poses.npz", body_files.poses(24), split=True)
    body_files.flame_param(folder / "param" / "flame_param.npz", flame, np.zeros((1, 63, 3), "f4"))


def _recordings(folder: Path) -> None:
    rng = np.random.default_rng(4)
    for name in ("csv", "packets", "json"):
        (folder / name).mkdir()
    shown = [{"weights": [0.1 * k, 0.2], "time": k / 30, "rotation": []} for k in range(5)]
    told = {"names": ["tongueOut", "jawOpen"], "metadata": {"fps": 30, "frame_count": 5}, "frames": shown}
    (folder / "json" / "bsData.json").write_text(json.dumps(told))
    rows = [f"00:00:{k:02}:10.500,61," + ",".join(f"{v:.6f}" for v in rng.random(61)) for k in range(5)]
    titles = [channel[0].upper() + channel[1:] for channel in CHANNELS]
    (folder / "csv" / "take.csv").write_text(
        "\n".join([",".join(["Timecode", "BlendShapeCount", *titles]), *rows])
    )
    packets = senders.live_link_packets()[:4]
    recorded = b"".join(struct.pack(">I", len(packet)) + packet for packet in packets)
    first = packets[0][:1] + struct.pack(">I", len(packets))  # the version, and how many follow
    (folder / "packets" / "take.gz").write_bytes(gzip.compress(first + recorded))


def _live(folder: Path) -> None:
    (folder / "sent").mkdir()
    shown = {"weights": {"jawOpen": 0.5, "eyeBlinkLeft": 0.1}, "head": [0.1, 0.2, 0.3], "left_eye": [0, 0, 0]}
    (folder / "sent" / "message.json").write_text(json.dumps(shown))
    (folder / "sent" / "packet.osc").write_bytes(
        senders.vmc_bundle({"JawOpen": 0.5}, {"Head": (0.0, 0.1, 0.0, 1.0)})
    )


def _received(folder: Path) -> object:
    said: list[str] = []
    VmcReader(Inbox(lambda _: None, said.append)).packet(read_bytes(folder / "packet.osc", MOST), "somebody")
    assert all(line.isprintable() for line in said), said
    return channels_of(read_bytes(folder / "message.json", MOST))


def _driving(folder: Path) -> None:
    document = {"inputs": ["jawOpen", "mouthSmileLeft"], "outputs": ["expression/jawOpen", "joint/jaw/x"]}
    (folder / "matrix").mkdir()
    (folder / "matrix" / "driving.json").write_text(json.dumps(document | {"matrix": [[1, 0], [0.2, 0.1]]}))


@cache
def _avatar() -> Avatar:
    return replace(full_avatar(3), clips=())


def _rigs(folder: Path) -> None:
    for name, options in {"whole": {}, "nodes": {"nodes": True, "lying": True}, "ids": {"ids": "uv"}}.items():
        (folder / name).mkdir()
        (folder / name / "rig.glb").write_bytes(rig_files.rig_glb(**options))


def _meshes(folder: Path) -> None:
    for name in ("obj", "npz"):
        (folder / name).mkdir()
    (folder / "obj" / "mesh.obj").write_text(splatting_files.obj_text())
    vertices, faces = splatting_files.VERTICES, splatting_files.FACES
    np.savez(folder / "npz" / "mesh.npz", vertices=vertices, faces=faces)


def _only(folder: Path) -> Path:
    (file,) = folder.iterdir()
    return file


def _shape_or_poses(folder: Path) -> object:
    return read_poses(_only(folder)), read_shape(_only(folder))


def _checked(folder: Path) -> object:
    problems = validate(folder)
    for problem in problems:
        assert "\n" not in str(problem) and len(str(problem)) < 5000
    errors = [str(p) for p in problems if not p.warning]
    if errors:
        raise AvatarError(errors[0])
    return load(folder)


TARGETS: dict[str, Target] = {
    "bundle": Target(_bundles, load, finish=_signed, finished=("avatar.json",)),
    "bundle zip": Target(_zipped, lambda folder: load(folder / "x.avatar.zip")),
    "validate": Target(_bundles, _checked, finish=_signed, finished=("avatar.json",)),
    "pack": Target(_packs, lambda folder: decode_pack((folder / "x.avatar").read_bytes(), "x").avatar),
    "conform": Target(_references, _conform),
    "gaussian_blendshapes": Target(
        checkpoints.blendshapes, lambda folder: read(folder / "model", ReadOptions(dataset=folder)), ("model/*",)
    ),
    "splatting_avatar": Target(checkpoints.splatting, lambda folder: read(folder, ReadOptions(no_rig=True))),
    "gaussian_avatars": Target(
        checkpoints.bound, lambda folder: read(folder, ReadOptions(no_rig=True, mesh=folder / "mesh.obj"))
    ),
    "psavatar": Target(
        checkpoints.psavatar,
        lambda folder: read(folder, ReadOptions(body_model=folder / "body.npz", shape=Path("zero"))),
        ("point_cloud/*", "*.json"),
    ),
    "lam": Target(checkpoints.lam, lambda folder: read(folder / "head.zip")),
    "asm": Target(checkpoints.faces, lambda folder: read(folder / "face.npz")),
    "rgbavatar": Target(
        checkpoints.rgbavatar,
        lambda folder: read(folder, ReadOptions(body_model=folder / "body.npz", shape=Path("zero"))),
    ),
    "lhm": Target(checkpoints.lhm, lambda folder: read(folder / "person.ply", lhm_files.options(folder), "lhm")),
    "dumps": Target(checkpoints.dumps, prepared),
    "body models": Target(_bodies, lambda folder: read_body_model(_only(folder))),
    "tracked frames": Target(_frames, lambda folder: read_shape(_only(folder))),
    "tracked poses": Target(_poses, _shape_or_poses),
    "recordings": Target(_recordings, lambda folder: read_take(_only(folder))),
    "live frames": Target(_live, _received),
    "driving": Target(_driving, lambda folder: with_driving(_avatar(), folder / "driving.json")),
    "clips": Target(_rigs, lambda folder: replace(_avatar(), clips=clips_from(_avatar(), folder / "rig.glb"))),
    "rigs": Target(_rigs, lambda folder: read_rig_file(folder / "rig.glb")),
    "meshes": Target(_meshes, lambda folder: read_mesh(_only(folder))),
}  # fmt: skip


def attacked(target: Target, folder: Path) -> list[Path]:
    """The files of a sound folder that are changed, relative to it, in the order of their names."""
    files = sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return [path for path in files if any(fnmatch(path.as_posix(), pattern) for pattern in target.attacked)]
