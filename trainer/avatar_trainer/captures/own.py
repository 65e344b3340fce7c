"""Captures in the layout of CAPTURE.md: capture.json and the files it names, both directions."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_export import ReadOptions
from avatar_export.bodies import inputs
from avatar_runtime import F64, AvatarError, PoseArrays, joint_rotation
from avatar_runtime.io import no_such, write_text
from avatar_trainer.captures.bodies import Body, body_of_model, body_of_rig
from avatar_trainer.captures.documents import VERSION, read_document
from avatar_trainer.captures.keys import check_frame_list, unknown_keys
from avatar_trainer.captures.model import RIGHTS, Capture
from avatar_trainer.captures.paths import inside
from avatar_trainer.captures.rows import Row, check_rows, rotation_fault

FILE = "capture.json"
MAX_JSON_BYTES = 256 << 20
Object = Mapping[str, Any]


@dataclass(frozen=True)
class Shot:
    """A frame to be written."""

    image: (
        npt.NDArray[np.uint8] | None
    )  # [H, W, 3] display sRGB, straight colour; None: the file is there already
    mask: npt.NDArray[np.uint8]  # [H, W], 255 where the person is
    intrinsics: npt.NDArray[Any]  # [3, 3] pixels, pixel centres at half integers
    rotation: npt.NDArray[Any]  # [3, 3] camera from world
    translation: npt.NDArray[Any]  # [3] metres
    expression: Sequence[float]  # in the order of the capture's expressions
    joints: Mapping[str, npt.NDArray[Any]] = field(
        default_factory=dict
    )  # rotation vector [3] or delta [4, 4]
    eyelids: Sequence[float] = ()
    world_from_avatar: npt.NDArray[Any] | None = None  # [4, 4]
    split: str | None = None  # "train" | "test"; in every shot or in none


def read(folder: Path, given: ReadOptions) -> Capture:
    """The capture whose capture.json is in `folder`; `given` replaces the body files that it names.

    Raises AvatarError naming file and field for everything that CAPTURE.md lists.
    """
    file = folder / FILE
    document = read_document(file, MAX_JSON_BYTES, "capture", first=partial(check_frame_list, file))
    strangers = unknown_keys(document, file)
    body = _body(folder, document["body"], given)
    columns = [_index(name, body.expression_names, "expression", file) for name in document["expressions"]]
    lids = [_index(name, body.eyelids, "eyelid", file) for name in document.get("eyelids", ())]
    rows = []
    for i, frame in enumerate(document["frames"]):
        at = f"frames[{i}]"
        camera = frame["camera"]
        rows.append(
            Row(
                file,
                at,
                inside(folder, frame["image"], file, f"{at}.image"),
                inside(folder, frame["mask"], file, f"{at}.mask"),
                np.array(camera["K"], np.float64),
                np.array(camera["R"], np.float64),
                np.array(camera["t"], np.float64),
                _pose(frame, body, columns, lids, file, at),
                frame.get("split"),
            )
        )
    width, height = document["width"], document["height"]
    return Capture(
        name=document["name"],
        folder=folder,
        width=width,
        height=height,
        fps=float(document["fps"]),
        rig=body.rig,
        expression_names=body.expression_names,
        eyelids=body.eyelids,
        head_pose_in=document["head_pose_in"],
        frames=check_rows(rows, body.expression_names, (width, height)),
        export_inputs=body.export_inputs,
        layout=f"{FILE} {document['version']}",
        rights={key: document[key] for key in RIGHTS if document.get(key)},
        poses=document.get("poses", "exact"),
        columns=tuple(columns),
        notes=(f"keys that this version does not know are not read: {strangers}",) if strangers else (),
    )


def write(
    folder: Path,
    *,
    name: str,
    fps: float,
    head_pose_in: str,
    expressions: Sequence[str],
    body: Object,
    frames: Iterable[tuple[str, Shot]],
    eyelids: Sequence[str] = (),
    source: str = "",
    license: str = "",
    author: str = "",
    consent: str = "",
    poses: str = "exact",
) -> Path:
    """Write a capture: images/NAME.png and masks/NAME.png of each (NAME, shot) as it comes, then capture.json.

    body: the `body` object of capture.json; its files must lie in `folder` when it is read. Width and height are those
    of the first shot. Only shapes are checked; `load` checks the whole capture. Returns the path of
    capture.json. Raises ValueError for shots of different sizes or none at all.
    """
    for part in ("images", "masks"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    size: tuple[int, ...] | None = None
    listed = []
    for frame, shot in frames:
        size = size or shot.mask.shape
        if shot.mask.shape != size or (shot.image is not None and shot.image.shape != (*size, 3)):
            raise ValueError(f"shot {frame} is {shot.mask.shape}, or its image is not; the first was {size}")
        paths = {"image": f"images/{frame}.png", "mask": f"masks/{frame}.png"}
        if shot.image is not None:
            Image.fromarray(shot.image).save(folder / paths["image"])
        Image.fromarray(shot.mask).save(folder / paths["mask"])
        listed.append({**paths, **_described(shot)})
    if size is None:
        raise ValueError("a capture without frames")
    document = {
        "version": VERSION,
        "name": name,
        "width": size[1],
        "height": size[0],
        "fps": fps,
        **{key: text for key, text in zip(RIGHTS, (source, license, author, consent), strict=True) if text},
        "head_pose_in": head_pose_in,
        **({} if poses == "exact" else {"poses": poses}),
        "expressions": list(expressions),
        "eyelids": list(eyelids),
        "body": dict(body),
    }
    head = json.dumps(document, indent=1)[:-2]
    lines = ",\n  ".join(json.dumps(frame) for frame in listed)
    write_text(folder / FILE, f'{head},\n "frames": [\n  {lines}\n ]\n}}\n', force=True)
    return folder / FILE


def _described(shot: Shot) -> dict[str, Any]:
    """A shot's numbers as capture.json has them; nine digits are a float32 exactly, seventeen a float64."""
    entry: dict[str, Any] = {
        "camera": {
            "K": np.asarray(shot.intrinsics, np.float64).tolist(),
            "R": np.asarray(shot.rotation, np.float64).tolist(),
            "t": np.asarray(shot.translation, np.float64).tolist(),
        },
        "expression": _short(shot.expression),
        "joints": {joint: _short(values) for joint, values in shot.joints.items()},
    }
    if len(shot.eyelids):
        entry["eyelids"] = _short(shot.eyelids)
    if shot.world_from_avatar is not None:
        entry["world_from_avatar"] = np.asarray(shot.world_from_avatar, np.float64).ravel().tolist()
    if shot.split is not None:
        entry["split"] = shot.split
    return entry


def _short(values: npt.ArrayLike) -> list[float]:
    return [float(f"{value:.9g}") for value in np.asarray(values, np.float64).ravel()]


def _body(folder: Path, body: Object, given: ReadOptions) -> Body:
    def path(key: str) -> Path:
        return inside(folder, body[key], folder / FILE, f"body.{key}")

    if body["kind"] == "rig":
        given.refuse_others((), "capture", "this capture has a rig of its own")
        return body_of_rig(path("rig"))
    others = (path(key) if key in body else None for key in ("shape", "eyelids", "anchor_faces"))
    shape, eyelids, anchor_faces = others
    return body_of_model(
        inputs.Inputs(
            given.body_model or path("model"),
            shape,
            given.eyelids or eyelids,
            given.anchor_faces or anchor_faces,
        )
    )


def _index(name: str, known: Sequence[str], what: str, file: Path) -> int:
    if name not in known:
        raise no_such(f"{what} of the body", name, known, file=file, field=f"{what}s")
    return known.index(name)


def _pose(
    frame: Object, body: Body, columns: Sequence[int], lids: Sequence[int], file: Path, at: str
) -> PoseArrays:
    weights = np.zeros(len(body.expression_names), np.float32)
    late = np.zeros(len(body.eyelids), np.float32)
    for part, out, where in (("expression", weights, columns), ("eyelids", late, lids)):
        row = frame.get(part, ())
        if len(row) != len(where) and (row or part == "expression"):
            raise AvatarError(
                f"has {len(row)} values, the capture names {len(where)}", file=file, field=f"{at}.{part}"
            )
        if row:
            out[list(where)] = row
    world = (
        np.array(frame["world_from_avatar"], np.float64).reshape(4, 4)
        if "world_from_avatar" in frame
        else np.eye(4)
    )
    if (world[3] != (0, 0, 0, 1)).any():
        raise AvatarError("has a last row that is not 0 0 0 1", file=file, field=f"{at}.world_from_avatar")
    if np.isfinite(world).all() and (fault := rotation_fault(world[:3, :3])):
        raise AvatarError(fault, file=file, field=f"{at}.world_from_avatar")
    return PoseArrays(weights, late, _deltas(frame.get("joints", {}), body, file, at), world)


def _deltas(joints: Mapping[str, Sequence[float]], body: Body, file: Path, at: str) -> F64:
    names = body.rig.joint_names
    deltas = np.tile(np.eye(4), (len(names), 1, 1))
    for joint, values in joints.items():
        where = {"file": file, "field": f"{at}.joints"}
        if joint not in names:
            raise no_such("joint of the body", joint, names, **where)
        numbers = np.array(values, np.float64)
        if not np.isfinite(numbers).all():
            raise AvatarError(f"{joint} is {list(values)}: not usable numbers", **where)
        matrix = joint_rotation(numbers) if len(numbers) == 3 else numbers.reshape(4, 4)
        if (matrix[3] != (0, 0, 0, 1)).any():
            raise AvatarError(f"{joint} has a last row that is not 0 0 0 1: row-major?", **where)
        deltas[names.index(joint)] = matrix
    return deltas
