"""The rig of a Gaussian Blendshapes model, which is made from inputs beside the checkpoint."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from avatar_export.bodies.body_model import BodyModel, read_body_model
from avatar_export.bodies.body_rig import bake_rig, with_static_offset
from avatar_export.bodies.inputs import ZERO, Inputs, found_file
from avatar_export.bodies.subject_files import read_eyelids, read_faces, read_shape
from avatar_export.fit.judge import Sides
from avatar_export.fit.skeleton import inhuman
from avatar_export.fit.skinned import Subject, skinned_fit
from avatar_export.notes.note import Note
from avatar_export.options import ReadOptions
from avatar_export.readers.gaussian_blendshapes.layout import EYELIDS, JOINTS, SYSTEM
from avatar_runtime.avatar import F32, F64, Avatar, Rig
from avatar_runtime.io.errors import AvatarError


def body_model(inputs: Inputs, options: ReadOptions, mouths: bool) -> BodyModel | None:
    """The body model, if all its inputs are given. Raises AvatarError that names every missing input."""
    if options.no_rig:
        return None
    missing = []
    body = None if inputs.body_model is None else read_body_model(inputs.body_model)
    if body is None:
        missing.append("--body-model (FLAME, .npz or .pkl)")
    elif tuple(body.joint_names) != JOINTS:
        raise AvatarError(
            f"has joints {', '.join(body.joint_names)[:80]}; this system needs {', '.join(JOINTS)}",
            file=inputs.body_model,
            owner=SYSTEM,
        )
    if inputs.shape is None and (body is None or body.identity_dirs.shape[2]):
        missing.append("--shape (the subject's identity: a tracked .frame, .npy, .npz, .json, or `zero`)")
    if mouths and inputs.anchor_faces is None:
        missing.append(
            "--anchor-faces (back_of_head.txt of the release, the faces that carry the upper teeth)"
        )
    if body is None or missing:
        raise AvatarError(
            f"a checkpoint of this system does not contain its rig; pass {' and '.join(missing)}, or --dataset FOLDER "
            "with these files, or --no-rig for expressions only, without jaw, eyes and moving teeth",
            owner=SYSTEM,
        )
    return body


def baked_rig(body: BodyModel, inputs: Inputs, expressions: int) -> Rig:
    """The rig of the subject. Raises AvatarError unless it has as many `expressions` as the checkpoint."""
    shape = None if inputs.shape is None or str(inputs.shape) == ZERO else read_shape(inputs.shape)
    faces = None if inputs.anchor_faces is None else read_faces(inputs.anchor_faces, len(body.triangles))
    rig = bake_rig(with_static_offset(body, inputs.shape), shape, _mesh_eyelids(body, inputs), faces)
    if rig.joint_basis.shape[0] != expressions:
        raise AvatarError(
            f"the checkpoint has {expressions} expressions, but the body model has {rig.joint_basis.shape[0]}",
            owner=SYSTEM,
        )
    return rig


def fit_notes(
    avatar: Avatar, body: BodyModel, inputs: Inputs, options: ReadOptions, folder: Path
) -> list[Note]:
    """Notes on whether the Gaussians fit the body model with this identity. Raises AvatarError for a large misfit."""
    assert inputs.body_model is not None and avatar.rig is not None
    given = None if inputs.shape is None or str(inputs.shape) == ZERO else inputs.shape
    shape = None if given is None else read_shape(given)
    human = inhuman(avatar.rig.vertices.astype(np.float64), len(JOINTS)) is None
    sides = Sides(
        "the Gaussians", inputs.body_model.name, SYSTEM, inputs.body_model, "--body-scale", avatar.training_per_bundle,
        own_unit=human, accept=options.accept_misfit,
    )  # fmt: skip
    option = f"--shape {ZERO if given is None else given.name}"
    others = _other_identities(inputs, shape, folder, options)
    return skinned_fit(avatar, Subject(body, shape, option, others), sides)


def _other_identities(
    inputs: Inputs, shape: F64 | None, folder: Path, options: ReadOptions
) -> dict[str, F64]:
    """Identities that might be meant: the mean shape, the negated one, and others in the folders that are searched."""
    found = {} if shape is None else {"--shape zero": np.zeros(1), "its negative": -shape}
    for root in (options.dataset, folder):
        path = None if root is None else found_file(root, "shape")
        if path is not None and path != inputs.shape:
            found[f"--shape {path.name}"] = read_shape(path)
    return found


def _mesh_eyelids(body: BodyModel, inputs: Inputs) -> dict[str, F32]:
    """Eyelid shapes of the mesh, zero without files; those of the Gaussians are in the checkpoint."""
    if inputs.eyelids is None:
        return {name: np.zeros((body.vertex_count, 3), np.float32) for name in EYELIDS}
    return read_eyelids(inputs.eyelids, body.vertex_count)
