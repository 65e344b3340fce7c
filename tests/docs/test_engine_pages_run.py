"""Fragments of the engine pages that are marked to run do what the pages say; claims that no other test shows.

`make test-more` runs this.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from samples.make import make_gaussian_blendshapes

from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_export.writers.bundle import write_bundle
from avatar_export.writers.rig_glb import rig_glb
from avatar_export.writers.usd.stage import rig_usdc
from avatar_runtime.avatar import Avatar
from avatar_runtime.clips import frame_pose
from avatar_runtime.engine_pose import EnginePose, engine_pose, target_names
from avatar_runtime.pose import Pose, joint_rotation
from tests.avatars import JOINTS, full_avatar
from tests.commands import Run
from tests.docs.conftest import ran
from tests.interop.clients import HERE, PATHS, blender_program, job_pose, node_program
from tests.oracles.gltf_pose import File, State, quaternion_matrix

Array = npt.NDArray[Any]

pytestmark = pytest.mark.more

ROOT = Path(__file__).parents[2]
ENGINE_PAGES = ROOT / "docs" / "engines"
UNUSED = 3  # a vertex that no triangle of the avatar uses
HEIGHT_PARTS = 1e-5


def fragments(page: str, kind: str) -> str:
    """The fragments of one kind that a page has, one after the other."""
    text = (ENGINE_PAGES / f"{page}.md").read_text("utf-8")
    found = re.findall(rf"^```{kind}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert found, f"{page} has no {kind}"
    return "\n".join(found)


def posed_avatar() -> tuple[Avatar, Pose]:
    """The small avatar with a vertex that no triangle uses, so that ids are not indices, and a full pose."""
    avatar = full_avatar()
    assert avatar.rig is not None
    triangles = avatar.rig.triangles[(avatar.rig.triangles != UNUSED).all(axis=1)]
    rng = np.random.default_rng(3)
    world = joint_rotation([0.2, -1.0, 0.4])
    world[:3, 3] = [0.1, -0.2, 0.3]
    return replace(avatar, rig=replace(avatar.rig, triangles=triangles)), Pose(
        {name: rng.uniform(-0.3, 1.2) for name in avatar.expression_names},
        {name: joint_rotation(rng.normal(0, 0.4, 3)) for name in JOINTS},
        {name: rng.uniform(0, 1) for name in avatar.eyelids},
        world,
    )


def pose_document(avatar: Avatar, pose: EnginePose) -> dict[str, Any]:
    """pose.json as docs/engines/engine_pose.md writes it."""
    job = job_pose(avatar, pose)
    return {"nodes": job["nodes"], "weights": dict(zip(target_names(avatar), job["weights"], strict=True))}


def state_of(document: dict[str, Any]) -> State:
    """pose.json as the oracle takes it."""
    nodes = document["nodes"]
    by_path = ({name: node[path] for name, node in nodes.items()} for path in PATHS)
    return State(*by_path, document["weights"])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """rig.glb, rig.usdc and pose.json of the small avatar."""
    place = tmp_path_factory.mktemp("engine_docs")
    avatar, pose = posed_avatar()
    (place / "rig.glb").write_bytes(b"".join(rig_glb(avatar) or []))
    (place / "rig.usdc").write_bytes(rig_usdc(avatar))
    document = pose_document(avatar, engine_pose(avatar, pose))
    (place / "pose.json").write_text(json.dumps(document), "utf-8")
    return place


def expected(folder: Path, sets: int = 1) -> Array:
    document = json.loads((folder / "pose.json").read_text("utf-8"))
    return File((folder / "rig.glb").read_bytes()).posed(state_of(document), sets)


def check(answer: dict[str, Any], posed: Array) -> None:
    """The map from ids to vertices, and where the vertices went."""
    ids = [row for row in range(len(posed) + 1) if row != UNUSED]
    assert {int(row): vertex for row, vertex in answer["vertexOfId"]} == {row: k for k, row in enumerate(ids)}
    found = np.reshape(answer["posed"], (-1, 3))
    assert np.abs(found - posed).max() <= HEIGHT_PARTS * np.ptp(posed[:, 1])


def run(command: list[str], folder: Path) -> str:
    done = ran(command, folder)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def run_node(page: str, program: str, folder: Path) -> dict[str, Any]:
    node, link = node_program(), folder / "node_modules"
    if not link.exists():
        link.symlink_to(HERE / "node_modules", target_is_directory=True)
    (folder / f"{page}.mjs").write_text(program, "utf-8")
    answer: dict[str, Any] = json.loads(run([node, f"{page}.mjs"], folder).splitlines()[-1])
    return answer


THREE = """
gltf.scene.updateMatrixWorld(true);
mesh.skeleton.update();
const posed = [];
for (let vertex = 0; vertex < uv.count; vertex++) {
  posed.push(...mesh.getVertexPosition(vertex, mesh.position.clone()).applyMatrix4(mesh.matrixWorld).toArray());
}
console.log(JSON.stringify({ vertexOfId: [...vertexOfId], posed }));
"""

BABYLON = """
[...loaded.meshes, ...loaded.transformNodes].forEach((node) => node.computeWorldMatrix(true));
mesh.skeleton.prepare(true);
const bare = mesh.getPositionData(true, true);
const posed = [];
for (let k = 0; k < bare.length; k += 3) {
  posed.push(...Vector3.TransformCoordinates(Vector3.FromArray(bare, k), mesh.getWorldMatrix()).asArray());
}
const mirrored = await LoadAssetContainerAsync(url, new Scene(new NullEngine()), { pluginExtension: ".glb" });
console.log(JSON.stringify({
  vertexOfId: [...vertexOfId],
  posed,
  kinds: mesh.getVerticesDataKinds(),
  roots: [loaded, mirrored].map((file) => [file.meshes[0].name, file.meshes[0].scaling.asArray()]),
}));
process.exit(0);
"""


@pytest.fixture(scope="module")
def babylon(folder: Path) -> dict[str, Any]:
    return run_node("babylon", fragments("babylon", "js run") + BABYLON, folder)


def test_fragments_of_the_page_for_three_do_what_it_says(folder: Path) -> None:
    check(run_node("three", fragments("three", "js run") + THREE, folder), expected(folder))


def test_fragments_of_the_page_for_babylon_do_what_it_says(babylon: dict[str, Any], folder: Path) -> None:
    check(babylon, expected(folder))


def test_babylon_mirrors_unless_told_right_handed(babylon: dict[str, Any]) -> None:
    assert babylon["roots"] == [["__root__", [1, 1, 1]], ["__root__", [1, 1, -1]]]


PYTHON = """
from tests.oracles.usd_pose import posed_by_usd
posed = posed_by_usd(stage, 0).ravel().tolist()
print(json.dumps({"vertexOfId": list(vertex_of_id.items()), "posed": posed, "primvars": {
    primvar.GetName(): str(primvar.GetTypeName()) for primvar in UsdGeom.PrimvarsAPI(mesh).GetPrimvars()
}}))
"""


@pytest.fixture(scope="module")
def usd(folder: Path) -> dict[str, Any]:
    program = fragments("usd", "python run") + PYTHON
    answer: dict[str, Any] = json.loads(run([sys.executable, "-c", program], folder))
    return answer


def test_fragments_of_the_page_for_usd_do_what_it_says(usd: dict[str, Any]) -> None:
    """With all influences, which an avatar of five has in eight."""
    avatar, pose = posed_avatar()
    state = state_of(pose_document(avatar, engine_pose(avatar, pose)))
    check(usd, File(b"".join(rig_glb(avatar, 8) or [])).posed(state, 2))


def test_the_pose_command_writes_what_the_page_says(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    command: Run = request.getfixturevalue("run")  # `run` is another thing in this file
    avatar, posed = full_avatar(), tmp_path / "pose.json"
    write_bundle(avatar, tmp_path / "avatar", preview=False, engine_files=False)
    flags = ("-e", "mouthSmileLeft=0.8", "-j", "jaw=20,0,0", "--eyelid", "left=1")
    assert command("pose", tmp_path / "avatar", "-o", posed, *flags)[0] == 0
    wanted = Pose({"mouthSmileLeft": 0.8}, {"jaw": joint_rotation([np.radians(20), 0, 0])}, {"left": 1.0})
    assert json.loads(posed.read_text("utf-8")) == pose_document(avatar, engine_pose(avatar, wanted))
    assert command("pose", tmp_path / "avatar", "-o", posed, *flags)[0] == 2, "it is there already"
    words = ("pose", tmp_path / "avatar", "-o", posed, "--clip", "nod", "--force", "--frame")
    code, _, error = command(*words, "5")
    assert code == 2 and "5 frames" in error and command(*words, "4")[0] == 0
    clip = engine_pose(avatar, frame_pose(avatar, avatar.clips[0], 4))
    assert json.loads(posed.read_text("utf-8")) == pose_document(avatar, clip)


BLENDER_PROGRAM = """
import numpy as np
shown = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
points = np.empty(3 * len(mesh.data.vertices), np.float32)
shown.to_mesh().vertices.foreach_get("co", points)
back = np.array(Z_UP.inverted() @ shown.matrix_world)
posed = points.reshape(-1, 3) @ back[:3, :3].T + back[:3, 3]
key.slider_min, key.slider_max = 0, 1
cut = []
for weight in (-0.5, 1.5):
    key.value = weight
    cut.append(key.value)
print(json.dumps({
    "vertexOfId": list(vertex_of_id.items()), "posed": posed.ravel().tolist(), "cut": cut,
    "objects": {item.name: item.type for item in bpy.data.objects},
    "v": max(item.vector.y for item in mesh.data.uv_layers[0].uv),
}))
"""


@pytest.fixture(scope="module")
def blender(folder: Path) -> dict[str, Any]:
    program = fragments("blender", "python run blender") + BLENDER_PROGRAM
    answer: dict[str, Any] = json.loads(run([blender_program(), "-c", program], folder).splitlines()[-1])
    return answer


@pytest.mark.bpy
def test_fragments_of_the_page_for_blender_do_what_it_says(blender: dict[str, Any], folder: Path) -> None:
    check(blender, expected(folder))
    assert blender["v"] <= -1


@pytest.mark.bpy
def test_blender_names_its_objects(blender: dict[str, Any]) -> None:
    expected = {"avatar": "MESH", "avatar_root": "ARMATURE", "avatar_mesh": "EMPTY"}
    assert expected.items() <= blender["objects"].items()


@pytest.mark.bpy
def test_blender_cuts_shape_keys_to_their_sliders(blender: dict[str, Any]) -> None:
    assert blender["cut"] == [0, 1]


def test_worked_example_prints_what_the_page_says(tmp_path: Path) -> None:
    """On the rig of `make demo`, which any number of Gaussians has."""
    sample = make_gaussian_blendshapes(tmp_path / "checkpoint", 300, form="dump")
    avatar = read(sample / "model", ReadOptions(dataset=sample))
    write_bundle(avatar, tmp_path / "out" / "demo" / "avatar", preview=False, engine_files=False)
    said = run([sys.executable, "-c", fragments("engine_pose", "python run")], tmp_path)
    assert said == fragments("engine_pose", "text output")


# Claims of the pages that no other test shows


def matrix(node: dict[str, list[float]]) -> Array:
    result = np.eye(4)
    result[:3, :3] = quaternion_matrix(node["rotation_xyzw"]) @ np.diag(node["scale"])
    result[:3, 3] = node["translation"]
    return result


def unity(node: dict[str, list[float]]) -> dict[str, list[float]]:
    """The first row of the table in docs/engines/engine_pose.md."""
    (tx, ty, tz), (x, y, z, w) = node["translation"], node["rotation_xyzw"]
    return {"translation": [-tx, ty, tz], "rotation_xyzw": [x, -y, -z, w], "scale": node["scale"]}


def unreal(node: dict[str, list[float]]) -> dict[str, list[float]]:
    (tx, ty, tz), (x, y, z, w), (sx, sy, sz) = node["translation"], node["rotation_xyzw"], node["scale"]
    return {
        "translation": [100 * tx, 100 * tz, 100 * ty],
        "rotation_xyzw": [-x, -z, -y, w],
        "scale": [sx, sz, sy],
    }


@pytest.mark.parametrize(
    ("rule", "mirror"),
    [
        (unity, np.diag([-1.0, 1.0, 1.0, 1.0])),
        (unreal, np.array([[100.0, 0, 0, 0], [0, 0, 100, 0], [0, 100, 0, 0], [0, 0, 0, 1]])),
    ],
    ids=["unity", "unreal"],
)
def test_mirrored_poses_give_the_mirrored_mesh(rule: Any, mirror: Array, folder: Path) -> None:
    """A chain of mirrored nodes is the mirrored chain, so is what it skins: mirror M mirror^-1 for each node's M."""
    nodes = json.loads((folder / "pose.json").read_text("utf-8"))["nodes"]
    assert len(nodes) == 1 + len(JOINTS)
    nodes["scaled"] = {**nodes["jaw"], "scale": [2.0, 0.5, 1.25]}
    for node in nodes.values():
        np.testing.assert_allclose(
            matrix(rule(node)), mirror @ matrix(node) @ np.linalg.inv(mirror), rtol=0, atol=1e-9
        )


def test_babylon_drops_custom_attributes(babylon: dict[str, Any]) -> None:
    known = {"position", "normal", "uv", "matricesIndices", "matricesWeights", "color"}
    assert set(babylon["kinds"]) <= known and "uv" in babylon["kinds"]


def test_usd_has_the_ids_twice(usd: dict[str, Any]) -> None:
    assert usd["primvars"]["primvars:avatar:vertexId"] == "int[]"
    assert usd["primvars"]["primvars:st"] == "texCoord2f[]"


def test_every_vertex_has_a_uv_of_its_own(folder: Path) -> None:
    uv = File((folder / "rig.glb").read_bytes()).attribute("TEXCOORD_0")
    assert len(np.unique(uv, axis=0)) == len(uv) and (uv == np.round(uv)).all()


def test_targets_move_positions_alone(folder: Path) -> None:
    targets = File((folder / "rig.glb").read_bytes()).json["meshes"][0]["primitives"][0]["targets"]
    assert targets and all(set(target) == {"POSITION"} for target in targets)


PAGE = ROOT / "docs" / "artist" / "jaw.md"
IMPORT = 'import bpy\nbpy.ops.wm.read_factory_settings(use_empty=True)\nbpy.ops.import_scene.gltf(filepath="rig.glb")\n'
ASK = """
import json
key = bpy.data.objects["avatar"].data.shape_keys.key_blocks["corrective_jaw_00"]
key.value = -1.5
ranges = {(key.slider_min, key.slider_max) for key in bpy.data.objects["avatar"].data.shape_keys.key_blocks}
print(json.dumps([key.value, sorted(ranges)]))
"""


@pytest.mark.bpy
def test_the_script_widens_every_slider(tmp_path: Path) -> None:
    (script,) = re.findall(r"^```python run blender\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
    (tmp_path / "rig.glb").write_bytes(b"".join(rig_glb(full_avatar(), 4) or []))
    command = [blender_program(), "-c", IMPORT + script + ASK]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=True)
    assert json.loads(done.stdout.splitlines()[-1]) == [-1.5, [[-10, 10]]]
