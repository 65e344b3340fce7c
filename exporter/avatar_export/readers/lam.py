"""The avatar zip that LAM exports (aigc3d/LAM 3395736): offset.ply on the vertices of skin.glb.

Splat i belongs to vertex i of the glb: the colours of a real avatar are smooth along the edges in this order, and in
no other. LAM's web page loads the zip's vertex_order.json but does not use it, nor does this reader. The PLY looks
like a 3DGS file but differs: x, y, z is the offset from the vertex, f_dc is plain RGB.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from avatar_export.clips.gltf_files import CLIPS, EXPRESSIONS, SKIN
from avatar_export.clips.sources import clips_from
from avatar_export.fit.embedded import own_mesh_fit
from avatar_export.fit.judge import Sides
from avatar_export.fit.surface import Mesh
from avatar_export.formats.file_set import FileSet, holds_together
from avatar_export.notes.note import Note, fact
from avatar_export.options import ReadOptions
from avatar_export.provenance import source_files
from avatar_export.rigs.gltf_rig import GltfRig, read_rig
from avatar_export.sparse import no_deltas
from avatar_runtime.avatar import (
    Avatar,
    Driving,
    Expression,
    Gaussians,
    Group,
    RasterSettings,
    Rules,
    SparseRows,
)
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.codec import glb, ply
from avatar_runtime.driving.arkit import canonical
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import owned
from avatar_runtime.rules import SKIN_ROTATIONS
from avatar_schema import constants

SYSTEM = "lam"
OFFSETS = "offset.ply"
FILES = (
    f"NAME.zip, or the folder it unpacks to, with {OFFSETS} (the Gaussians, offsets from the vertices)",
    f"{SKIN} (mesh, ARKit morph targets, joints and skin weights)",
    f"{CLIPS} (optional: animation clips), {EXPRESSIONS} (optional: expressions over time)",
)
NEEDED = (OFFSETS, SKIN)
USED_OPTIONS = (
    "rotation",
    "exact",
    "name",
    "accept_misfit",
)  # exact changes nothing: every delta that is not zero is kept
WITHOUT_RIG = ReadOptions()  # the zip contains its rig
HEAD_JOINT = "head"


def detect(path: Path) -> bool:
    """Whether `path` is a zip, or a folder, with offset.ply and skin.glb in one folder; never raises."""
    return holds_together(path, NEEDED)


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar with the clips of animation.glb and bsData.json.

    Raises AvatarError as `read_lam`, and for an option not used here.
    """
    options.refuse_others(USED_OPTIONS, SYSTEM, "the zip contains all inputs")
    avatar = read_lam(path, rotation=options.rotation or "none")
    with owned(SYSTEM):
        clips = clips_from(avatar, path, optional=True)
        notes = [*avatar.provenance["notes"], *_fit_notes(avatar, options)]
    provenance = {**avatar.provenance, "notes": notes}
    return replace(avatar, name=options.name or avatar.name, clips=clips, provenance=provenance)


def _fit_notes(avatar: Avatar, options: ReadOptions) -> list[Note]:
    """Doubts about offsets that lead far from the mesh. Raises AvatarError for very far ones."""
    assert avatar.rig is not None
    sides = Sides("the Gaussians", SKIN, SYSTEM, Path(OFFSETS), accept=options.accept_misfit)
    return own_mesh_fit(avatar, Mesh.of(avatar.rig.vertices, avatar.rig.triangles), sides)


def read_lam(path: Path, *, rotation: str = "none") -> Avatar:
    """The avatar in a LAM zip or folder, without its clips; it has the name of that. y up, face +Z, metres.

    `rotation` says how joints turn a Gaussian: `none` as trained (animate_gs_model moves positions only),
    `head_bone` as its web page draws it, `polar3` as skinning would.
    Raises AvatarError for missing, damaged or inconsistent files and for an unknown rule.
    """
    with owned(SYSTEM):
        if rotation not in SKIN_ROTATIONS:
            raise AvatarError(f"{rotation!r} is not one of {', '.join(SKIN_ROTATIONS)}", field="rotation")
        source = FileSet(path, NEEDED)
        splats = _gaussians(source.read(OFFSETS))
        found = read_rig(glb.decode(source.read(SKIN), SKIN))
        avatar = _avatar(source.name, splats, found, rotation)
        files = source_files(source.files(CLIPS, EXPRESSIONS))
        return check_avatar(replace(avatar, provenance={**avatar.provenance, "source_files": files}))


def _gaussians(data: bytes) -> Gaussians:
    """The Gaussians of the file: `mean` is the offset from the vertex, colours are SH."""
    raw = ply.gaussians(ply.decode(data, OFFSETS), OFFSETS)
    if raw.sh_degree:
        raise AvatarError("are present, but files of LAM have none", file=OFFSETS, field="f_rest_*")
    outside = (raw.sh < 0) | (raw.sh > 1)
    if outside.any():
        row, _, channel = np.unravel_index(int(np.argmax(outside)), raw.sh.shape)
        raise AvatarError(
            f"is {raw.sh[row, 0, channel]:.6g}; LAM stores plain RGB, 0..1",
            file=OFFSETS,
            field=f"f_dc_{channel}[{row}]",
        )
    sh = (raw.sh.astype(np.float64) - 0.5) / constants()["sh_c0"][0]
    return replace(raw, sh=sh.astype(np.float32))


def _avatar(name: str, splats: Gaussians, found: GltfRig, rotation: str) -> Avatar:
    rig, n = found.rig, splats.count
    if n != len(rig.vertices):
        raise AvatarError(f"has {n} rows, but {SKIN} has {len(rig.vertices)} vertices", file=OFFSETS)
    if rotation == "head_bone" and HEAD_JOINT not in rig.joint_names:
        raise AvatarError(f"rotation head_bone needs a joint {HEAD_JOINT!r}", file=SKIN)
    with np.errstate(over="ignore"):  # an overflow becomes infinite, which the check of the avatar refuses
        mean = rig.vertices + splats.mean
    return Avatar(
        name=name,
        gaussians=replace(splats, mean=mean),
        groups=(Group("body", 0, n, "skin"),),
        rules=Rules(
            rotation=rotation,
            rotation_joint=HEAD_JOINT if rotation == "head_bone" else None,
            sh_direction="world",
        ),
        expressions=tuple(Expression(morph) for morph in found.morph_names),
        eyelids=(),
        blendshapes=replace(no_deltas(n, len(found.morph_names)), geometry=_geometry(rig.morphs)),
        skin=rig.skin,
        rig=rig,
        sh_degree=0,
        driving=Driving(
            mode="names" if any(canonical(morph) for morph in found.morph_names) else "none",
            head_joint=HEAD_JOINT if HEAD_JOINT in rig.joint_names else None,
        ),
        raster=RasterSettings(background="per_view"),
        head_pose_in="mesh",
        provenance={"system": SYSTEM, "source_commit": "aigc3d/LAM 3395736", "notes": _notes(found)},
    )


def _geometry(morphs: SparseRows) -> SparseRows:
    """The morphs of the vertices as deltas of their Gaussians: positions move, rotations do not."""
    still = np.zeros((morphs.entries, 4), np.float32)
    return replace(morphs, values={"mean": morphs.values["position"], "quat_wxyz": still})


def _notes(found: GltfRig) -> list[Note]:
    notes = []
    if found.node_pose:
        notes.append(fact("nodes_off_binding", file=SKIN, deviation=found.rest_deviation))
    if found.renormalised:
        notes.append(fact("weights_renormalised", count=found.renormalised))
    return notes
