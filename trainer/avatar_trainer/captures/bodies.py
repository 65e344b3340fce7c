"""The rig of a capture: a body model with the subject's identity, or a rig file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from avatar_export import ReadOptions
from avatar_export.bodies import body_model, body_rig, subject_files
from avatar_export.bodies import inputs as body_inputs
from avatar_export.rigs import rig_file
from avatar_runtime import AvatarError, Rig

FLAME_JOINTS = body_model.JOINT_NAMES[5]
BESIDE = "body"  # a folder of this name beside the data is searched, too


@dataclass(frozen=True)
class Body:
    """A rig, the names of its columns, and the files from which the exporter makes it again."""

    rig: Rig
    expression_names: tuple[str, ...]
    eyelids: tuple[str, ...]
    export_inputs: Mapping[str, Path]


def found_inputs(folder: Path, given: ReadOptions, shape: Path | None = None) -> body_inputs.Inputs:
    """Each input as given, else from the data's folder, else from a folder `body` beside it.

    `shape`: the file with the identity, if it is known. Raises AvatarError if no body model is found.
    """
    beside = folder.resolve().parent / BESIDE
    inputs = body_inputs.find_inputs(
        beside if beside.is_dir() else folder, replace(given, dataset=folder, shape=shape), "capture"
    )
    if inputs.body_model is None:
        raise AvatarError(
            "has no body model in it or in a folder 'body' beside it; pass --body-model (FLAME layout, .npz or .pkl)",
            file=folder,
        )
    return inputs


def body_of_model(inputs: body_inputs.Inputs) -> Body:
    """The body model with the identity of `inputs.shape`; None: the mean shape. Raises AvatarError for broken files."""
    if inputs.body_model is None:
        raise ValueError("no body model is given")
    body = body_rig.with_static_offset(body_model.read_body_model(inputs.body_model), inputs.shape)
    zero = inputs.shape is None or str(inputs.shape) == "zero"
    shape = None if zero or inputs.shape is None else subject_files.read_shape(inputs.shape)
    lids = None if inputs.eyelids is None else subject_files.read_eyelids(inputs.eyelids, body.vertex_count)
    faces = (
        None
        if inputs.anchor_faces is None
        else subject_files.read_faces(inputs.anchor_faces, len(body.triangles))
    )
    files = {
        "body_model": inputs.body_model,
        "shape": Path("zero") if zero else inputs.shape,
        "eyelids": inputs.eyelids,
        "anchor_faces": inputs.anchor_faces,
    }
    try:
        rig = body_rig.bake_rig(body, shape, lids, faces)
    except AvatarError as error:
        raise AvatarError(error.message, file=inputs.shape or inputs.body_model, field=error.field) from None
    return Body(
        rig,
        body.expression_names,
        tuple(lids or ()),
        {name: path for name, path in files.items() if path is not None},
    )


def check_flame(body: Body) -> None:
    """Raise AvatarError for a body model whose joints are not FLAME's: tracked heads are posed by these."""
    if body.rig.joint_names != FLAME_JOINTS:
        raise AvatarError(
            f"has joints {', '.join(body.rig.joint_names)[:80]}; the frames were tracked with FLAME's: "
            f"{', '.join(FLAME_JOINTS)}",
            file=body.export_inputs["body_model"],
        )


def body_of_rig(path: Path) -> Body:
    """A skinned .glb or .fbx; its morph targets are the expressions."""
    found = rig_file.read_rig_file(path)
    return Body(found.rig, found.morph_names, (), {"rig": path})
