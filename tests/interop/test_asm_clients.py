"""ASM faces in UsdSkel, three.js, Babylon.js and Blender: at rest, in their takes, and with one bone edited by name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from pxr import Gf, Sdf, UsdSkel

from avatar_export.asm.bake import with_half_scales
from avatar_export.asm.files import save
from avatar_export.asm.model import AsmFace
from avatar_export.readers.table import read
from avatar_export.writers.rig_glb import rig_glb
from avatar_export.writers.usd.stage import CLIPS, SKELETON, rig_usdc
from avatar_runtime.avatar import Avatar
from avatar_runtime.engine_pose import engine_rest, local_transforms
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.asm_faces import small_face
from tests.interop.clients import ask, job_pose
from tests.measured import Measure
from tests.oracles import asm as oracle
from tests.oracles.usd_pose import posed_by_usd, stage_of, vertex_ids

Array = npt.NDArray[Any]

AGREE = 1e-5  # of the mesh's height
EDITED = "nose_wing.L"
# Influences that a client shows, and how wide mixtures may be that no vertex has more.
CLIENTS = {"three": (4, 0.02), "babylon": (8, 0.03), "blender": (8, 0.03)}


@dataclass(frozen=True)
class Made:
    """A face, the avatar of it, and its files for engines."""

    face: AsmFace
    avatar: Avatar
    glb: Path
    usdc: Path

    @property
    def height(self) -> float:
        return float(np.ptp(self.face.template.vertices[:, 1]))


def made(folder: Path, influences: int, spread: float, *, turned: bool) -> Made:
    face = small_face(5, spread=spread, turned=turned)
    save(face, folder / "face.npz")
    avatar = read(folder / "face.npz")
    assert avatar.rig is not None
    assert spread > 0.1 or 1 < int(np.diff(avatar.rig.skin.row_ptr.astype(int)).max()) <= influences
    pieces = rig_glb(avatar, influences)
    assert pieces is not None
    (folder / "rig.glb").write_bytes(b"".join(pieces))
    (folder / "rig.usdc").write_bytes(rig_usdc(avatar))
    return Made(face, avatar, folder / "rig.glb", folder / "rig.usdc")


def frames(given: Made) -> Iterator[tuple[str, int, Array]]:
    """(take, frame, vertices by the paper's formulas) of what the clips hold."""
    for take in given.face.takes:
        stored = take if take.name == "neutral" else with_half_scales(take)
        for frame in {0, len(take.scale) - 1}:
            yield take.name, frame, oracle.posed_face(given.face, stored, frame)


def edit(given: Made) -> tuple[dict[str, list[float]], Array]:
    """(a new transform for the node of one bone, the runtime's mesh for it): moved, turned and stretched unevenly."""
    rig, rest = given.avatar.rig, engine_rest(given.avatar)
    assert rig is not None
    bone = rig.joint_names.index(EDITED)
    x, y, z, w = rest.rotation_xyzw[bone]
    a, b = np.sin(0.15), np.cos(0.15)  # 0.3 radians more about y, before the rotation that is there
    turn = np.array([b * x + a * z, b * y + a * w, b * z - a * x, b * w - a * y])
    node = {
        "translation": (rest.translation[bone] + [4e-3, -2e-3, 3e-3]).tolist(),
        "rotation_xyzw": turn.tolist(),
        "scale": (rest.scale[bone] * [1.3, 0.8, 1.1]).tolist(),
    }
    new = local_transforms(*(np.array(node[k]) for k in ("translation", "rotation_xyzw", "scale")))
    delta = np.linalg.solve(rig.rest_local[bone].astype(np.float64), new)
    return node, Player(given.avatar, "reference").mesh(Pose(joints={EDITED: delta})).astype(np.float64)


@pytest.mark.parametrize("turned", [False, True], ids=["upright", "turned"])
@pytest.mark.parametrize(
    "client", [pytest.param(c, marks=[pytest.mark.bpy] if c == "blender" else []) for c in CLIENTS]
)
def test_gltf_clients(client: str, turned: bool, tmp_path: Path, measured: Measure) -> None:
    given = made(tmp_path, *CLIENTS[client], turned=turned)
    node, edited = edit(given)
    neutral = oracle.posed_face(given.face, given.face.takes[0], 0)
    answer = ask(
        f"{client}_rig",
        glb=str(given.glb),
        poses=[
            {"nodes": {}, "weights": []},
            job_pose(given.avatar, engine_rest(given.avatar)),
            {"nodes": {EDITED: node}, "weights": []},
        ],
        clips=[
            {"clip": take.name, "times": [frame / take.fps for frame in range(len(take.scale))]}
            for take in given.face.takes
        ],
    )
    joints = [name for name in answer.facts["joints"] if name != "avatar_root"]
    assert joints == list(given.face.template.bone_names)
    rows = np.arange(len(neutral))  # every vertex is in a triangle
    for name, expected in (("pose/0", neutral), ("pose/1", neutral)):
        worst = float(np.abs(answer.rows(name)[rows] - expected).max()) / given.height
        measured(f"an ASM face's rig.glb at rest in {client} against the formulas, of height", worst, AGREE)
        assert worst <= AGREE
    assert np.abs(neutral - given.face.template.vertices).max() > 0.02 * given.height
    for take, frame, expected in frames(given):
        worst = float(np.abs(answer.rows(f"clip/{take}/{frame}") - expected).max()) / given.height
        measured(f"takes of an ASM face's rig.glb in {client} against the formulas, of height", worst, AGREE)
        assert worst <= AGREE
    if not turned:  # else the node's transform is not the runtime's: see edit
        worst = float(np.abs(answer.rows("pose/2") - edited).max()) / given.height
        measured(f"one bone edited by name in {client} against the runtime, of height", worst, AGREE)
        assert worst <= AGREE
        assert np.abs(edited - neutral).max() > 0.01 * given.height


@pytest.mark.parametrize("turned", [False, True], ids=["upright", "turned"])
def test_usd_skel(turned: bool, tmp_path: Path, measured: Measure) -> None:
    given = made(tmp_path, 4, 0.12, turned=turned)  # all influences, however many
    stage = stage_of(str(given.usdc))
    rows = vertex_ids(stage)
    source = UsdSkel.BindingAPI(stage.GetPrimAtPath(SKELETON)).GetAnimationSourceRel()
    first = given.avatar.clips[0]
    for take, frame, expected in frames(given):
        source.SetTargets([Sdf.Path(f"{CLIPS}/{take}")])
        clip = next(c for c in given.avatar.clips if c.name == take)
        posed = posed_by_usd(stage, frame * first.fps / clip.fps)
        worst = float(np.abs(posed - expected[rows]).max()) / given.height
        measured("takes of an ASM face's rig.usdc in UsdSkel against the formulas, of height", worst, AGREE)
        assert worst <= AGREE
    source.SetTargets([])
    neutral = oracle.posed_face(given.face, given.face.takes[0], 0)
    worst = float(np.abs(posed_by_usd(stage, 0) - neutral[rows]).max()) / given.height
    measured("an ASM face's rest transforms in UsdSkel against the formulas, of height", worst, AGREE)
    assert worst <= AGREE


def test_one_bone_edited_by_name_in_usd_skel(tmp_path: Path, measured: Measure) -> None:
    """An animation of that bone alone: the others stand at rest. Its scale is a half float, so 1/2048 of it is lost."""
    given = made(tmp_path, 4, 0.12, turned=False)
    node, edited = edit(given)
    stage = stage_of(str(given.usdc))
    skeleton = UsdSkel.Skeleton.Get(stage, SKELETON)
    at = list(skeleton.GetJointNamesAttr().Get()).index(EDITED)
    animation = UsdSkel.Animation.Define(stage, "/avatar/clips/edit")
    animation.CreateJointsAttr([skeleton.GetJointsAttr().Get()[at]])
    animation.CreateTranslationsAttr([Gf.Vec3f(*node["translation"])])
    x, y, z, w = node["rotation_xyzw"]
    animation.CreateRotationsAttr([Gf.Quatf(w, x, y, z)])
    animation.CreateScalesAttr([Gf.Vec3h(*node["scale"])])
    UsdSkel.BindingAPI(skeleton).GetAnimationSourceRel().SetTargets([animation.GetPath()])
    worst = float(np.abs(posed_by_usd(stage, 0) - edited[vertex_ids(stage)]).max()) / given.height
    measured("one bone edited by name in UsdSkel against the runtime (half floats), of height", worst, 2e-4)
    assert worst <= 2e-4
