"""ASM faces (arXiv 2304.09423): bones, mixtures for skin weights, poses; fitted by avatar-train or the unofficial code.

The official code was never released. A face has no Gaussians: each triangle gets a flat one in its colours, so that
a face is drawn, checked and written like any other avatar.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from avatar_export.asm import maths, unofficial
from avatar_export.asm.bake import LEAST_WEIGHT, bake_clips, bake_rig
from avatar_export.asm.files import is_face, is_person, load, load_person
from avatar_export.asm.model import AsmFace
from avatar_export.clips.poses import clip_poses, rig_avatar
from avatar_export.notes.note import Note, fact
from avatar_export.ops.surfels import RULES, surfels
from avatar_export.options import ReadOptions
from avatar_export.provenance import provenance
from avatar_export.readers import surface
from avatar_export.rigs.embedded_rig import EmbeddedRig, rest_vertices
from avatar_runtime.avatar import Avatar, Clip, Driving, Rig
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import of_file, owned
from avatar_runtime.player import Player

SYSTEM = "asm"
FILES = (
    "FACE.npz with asm_version, written by avatar-train asm; the small file of a person needs --mesh FACE.npz",
    "or a folder of the unofficial code: rig_info.json, inited_gmm_params_KN.pkl, mu_face.obj",
)
USED_OPTIONS = ("mesh", "units", "name", "exact")  # exact: there are no deltas to drop
WITHOUT_RIG = ReadOptions()  # a face is a rig
FRAMES = 8  # of each take, in which the baked rig is compared with the formulas


def detect(path: Path) -> bool:
    """Whether `path` is an .npz with asm_version, or a folder of the unofficial code; never raises."""
    return unofficial.detect(path) if path.is_dir() else is_face(path)


def read(path: Path, options: ReadOptions) -> Avatar:
    """The face as an avatar that rests in its neutral. Raises AvatarError for unsound files."""
    with owned(SYSTEM):
        options.refuse_others(USED_OPTIONS, SYSTEM, "the face contains its mesh, rig and clips")
        face, files = _face(path, options)
        rig, clips = bake_rig(face), bake_clips(face)
        mesh = rest_vertices(rig)
        with of_file(path):
            gaussians, embedding = surfels(mesh, face.template.triangles, face.template.colour)
        made = EmbeddedRig(rig, clips=clips, driving=_driving(face), notes=tuple(_notes(face, rig, clips)))
        avatar = surface.surface_avatar(
            name=options.name or face.name,
            gaussians=gaussians,
            embedding=embedding,
            rules=RULES,
            rig=made,
            sh_degree=0,
            background=(1.0, 1.0, 1.0),
            units=1.0,
        )
        return replace(avatar, provenance=provenance(SYSTEM, files, made.notes))


def _face(path: Path, options: ReadOptions) -> tuple[AsmFace, dict[str, Path]]:
    if path.is_dir():
        return unofficial.read_folder(path, options.units), unofficial.files_of(path)
    if options.units is not None:
        raise AvatarError("cannot be used with an ASM .npz, whose unit is the metre", field="--units")
    if not is_person(path):
        if options.mesh is not None:
            raise AvatarError(
                "is only for the small file of a person; this face contains its mesh", field="--mesh"
            )
        return load(path), {path.name: path}
    if options.mesh is None:
        raise AvatarError(
            "holds a person without the template; pass a face with that template: --mesh FACE.npz", file=path
        )
    template = load(options.mesh).template
    return load_person(path, template), {path.name: path, f"mesh/{options.mesh.name}": options.mesh}


def _driving(face: AsmFace) -> Driving:
    """Driving that rotates the whole face about the head bone; in the bone's own space an uneven scale would shear."""
    names = face.template.bone_names
    if "head" not in names:
        return Driving()
    bone = names.index("head")
    position = maths.bone_positions(face.template, face.binding)[bone]
    x, y, z = (maths.skin_matrices(face, face.takes[0])[0, bone] @ np.append(position, 1))[:3].tolist()
    return Driving(head_pivot=(x, y, z))


def _notes(face: AsmFace, rig: Rig, clips: tuple[Clip, ...]) -> list[Note]:
    """Notes on what baking changed, measured over evenly spaced frames of every take."""
    avatar = replace(rig_avatar(rig, ()), clips=clips)
    player = Player(avatar, "reference")
    worst = []
    for take, clip in zip((*face.takes[1:], face.takes[0]), clips, strict=True):
        poses = clip_poses(avatar, clip)
        frames = np.unique(np.linspace(0, clip.frames - 1, FRAMES).astype(np.int64))
        shown = np.stack([player.mesh(poses[frame]) for frame in frames.tolist()])
        true = maths.posed_by(face, maths.skin_matrices(face, take)[frames])
        worst.append(1e3 * float(np.linalg.norm(shown - true, axis=2).max()))
    per_vertex = rig.skin.entries / len(rig.vertices)
    return [
        fact("asm_binding", count=face.binding.components, rule=face.template.weight_rule),
        fact("weights_dropped", least=LEAST_WEIGHT, joints=per_vertex, mm=worst[-1]),
        *([fact("scales_rounded", mm=max(worst[:-1]))] if len(worst) > 1 else []),
    ]
