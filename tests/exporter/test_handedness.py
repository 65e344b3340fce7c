"""Left-handed bundles: what stands in their files, and that they say the same as right-handed ones."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from plyfile import PlyData
from safetensors.numpy import load_file

from avatar_export.checks.bundle import validate
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar, Expression, Rules
from avatar_runtime.bundle import load
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.driving import axes
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.handedness import mirrored, mirrored_pose
from avatar_schema import schema
from tests import bundles
from tests.avatars import full_avatar, surface_avatar
from tests.commands import Run
from tests.exporter.writers.test_bundle import VARIANTS, assert_same
from tests.oracles.lbs import rodrigues

IN_TRIANGLES = Rules("triangle_frame", position="triangle_frame", scale="triangle_linear")
PLAIN = {"preview": False, "engine_files": False, "reference": False}
AVATARS: dict[str, Callable[[], Avatar]] = {
    "full": full_avatar,
    **{name: lambda change=change: change(full_avatar()) for name, change in VARIANTS.items()},
    "largest_positive": lambda: surface_avatar(
        rules=Rules("vertex_quaternion", quaternion_sign="largest_positive")
    ),
}


@pytest.mark.parametrize("name", AVATARS)
@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")
def test_right_to_left_to_right_is_bit_equal(tmp_path: Path, name: str) -> None:
    avatar = check_avatar(AVATARS[name]())
    write_bundle(avatar, tmp_path / "left", handedness="left", **PLAIN)
    assert bundles.manifest(tmp_path / "left")["frame"]["handedness"] == "left"
    assert_same(load(tmp_path / "left"), avatar)
    assert_same(load(tmp_path / "left", as_stored=True), mirrored(avatar))


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same avatar right-handed and left-handed, with every derived file."""
    folder = tmp_path_factory.mktemp("handedness")
    for handedness in ("right", "left"):
        write_bundle(
            surface_avatar(rules=IN_TRIANGLES), folder / handedness, handedness=handedness, reference=False
        )
    return folder / "right", folder / "left"


def test_the_files_through_other_readers(tmp_path: Path) -> None:
    """x, rotations and SH of gaussians.ply, vertices of the rig, joints and pivot: each by hand."""
    for handedness in ("right", "left"):
        write_bundle(full_avatar(), tmp_path / handedness, handedness=handedness, **PLAIN)
    a, b = (PlyData.read(tmp_path / h / "gaussians.ply") for h in ("right", "left"))
    assert a.comments == ["SplatRenderMode: default"]
    assert b.comments == ["SplatRenderMode: default", "Handedness: left"]
    odd = (3, 4, 7, 10, 13, 15)  # x, xy, xz, xyz, x(...), x(...)
    flips = {"x", "rot_2", "rot_3"} | {f"f_rest_{15 * c + k - 1}" for c in range(3) for k in odd}
    for name in (p.name for p in a["vertex"].properties):
        sign = -1 if name in flips else 1
        np.testing.assert_array_equal(b["vertex"][name], sign * a["vertex"][name], name)
    a, b = (load_file(tmp_path / h / "rig.safetensors") for h in ("right", "left"))
    s = np.diag([-1, 1, 1, 1]).astype(np.float32)
    np.testing.assert_array_equal(b["vertices"], a["vertices"] * [-1, 1, 1])
    np.testing.assert_array_equal(b["rest_local"], s @ a["rest_local"] @ s)
    np.testing.assert_array_equal(b["triangles"], a["triangles"])
    a, b = (bundles.manifest(tmp_path / h) for h in ("right", "left"))
    assert (a["driving"]["head_pivot"], b["driving"]["head_pivot"]) == (
        [0.01, -0.1, 0.02],
        [-0.01, -0.1, 0.02],
    )
    for box in ("rest", "swept"):
        low, high = a["bounds"][box]["min"], a["bounds"][box]["max"]
        assert b["bounds"][box] == {"min": [-high[0], *low[1:]], "max": [-low[0], *high[1:]]}
        assert low[0] != -high[0]


def test_files_for_engines_stay_as_their_standards_say(pair: tuple[Path, Path]) -> None:
    right, left = (bundles.contents(path) for path in pair)
    assert right.keys() == left.keys()
    same = {name for name in right if right[name] == left[name]}
    assert same == {
        *("rig.glb", "splats.glb", "rig.usdc", "avatar.usdz", "preview.png"),
        "blendshapes.safetensors",  # on a surface it holds nothing
        "enhancer.onnx",  # it works on images, which are the same
    }
    a, b = (bundles.manifest(path) for path in pair)
    changed = {"frame", "bounds", "files", "driving"}
    assert {key for key in a if a[key] != b[key]} == changed


def test_embedding_json_is_the_text_of_its_neighbour(pair: tuple[Path, Path]) -> None:
    for path, handedness in zip(pair, ("right", "left"), strict=True):
        document = json.loads((path / "embedding.json").read_text("utf-8"))
        Draft202012Validator(schema("embedding")).validate(document)
        assert document["handedness"] == handedness
        tensors = load_file(path / "embedding.safetensors")
        for name in ("canonical_vertices", "local_offset", "local_quat_wxyz"):
            np.testing.assert_array_equal(np.array(document[name], np.float32), tensors[name])
    right, left = (load_file(path / "embedding.safetensors") for path in pair)
    np.testing.assert_array_equal(left["local_offset"], right["local_offset"] * [1, -1, 1])
    np.testing.assert_array_equal(left["local_quat_wxyz"], right["local_quat_wxyz"][:, [3, 2, 1, 0]])


def test_validate_makes_the_files_again_in_their_frame(pair: tuple[Path, Path]) -> None:
    for path in pair:
        assert validate(path) == []


@pytest.mark.parametrize("side", [0, 1])
def test_a_frame_that_is_not_the_files_is_found(pair: tuple[Path, Path], tmp_path: Path, side: int) -> None:
    for name, data in bundles.contents(pair[side]).items():
        (tmp_path / name).write_bytes(data)
    bundles.edit(tmp_path, lambda d: d["frame"].update(handedness=("left", "right")[side]))
    paths = " ".join(p.path for p in validate(tmp_path) if not p.warning)
    for name in ("embedding.json", "rig.glb", "splats.glb", "rig.usdc"):
        assert name in paths


def test_the_same_avatar_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_bundle(full_avatar(), tmp_path / name, handedness="left", **PLAIN)
    assert bundles.contents(tmp_path / "a") == bundles.contents(tmp_path / "b")


def test_an_unknown_handedness(run: Run, sample_lam: Path, tmp_path: Path) -> None:
    code, _, error = run("convert", sample_lam, "-o", tmp_path / "out", "--handedness", "up")
    assert code == 2 and "not one of right, left" in " ".join(error.split())
    with pytest.raises(ValueError, match="not one of right, left"):
        write_bundle(full_avatar(), tmp_path / "out", handedness="up")
    assert not (tmp_path / "out").exists()


def test_convert_inspect_and_validate_say_it(run: Run, sample_lam: Path, tmp_path: Path) -> None:
    bundle = tmp_path / "out"
    flags = ("--handedness", "left", "--no-preview", "--no-engine-files", "--no-reference")
    code, text, _ = run("convert", sample_lam, "-o", bundle, *flags)
    assert code == 0 and "left-handed" in text
    assert run("validate", bundle)[:2] == (0, f"{bundle}: sound, left-handed\n")
    facts = json.loads(run("inspect", bundle, "--json")[1])
    assert facts["handedness"] == "left"
    code, text, _ = run("convert", sample_lam, "-o", bundle, "--force", "--json", *flags[2:])
    assert json.loads(text)["handedness"] == "right"
    assert json.loads(run("inspect", bundle, "--json")[1])["handedness"] == "right"


def test_driving_in_the_other_frame() -> None:
    """Weights reach the mirrored avatar through its own matrix as the mirrored pose; captured turns as SPEC.md says."""
    avatar = full_avatar()
    outputs = ("joint/jaw/x", "joint/jaw/y", "joint/jaw/z", "expression/y", "eyelid/left")
    avatar = check_avatar(
        replace(
            avatar,
            expressions=(*avatar.expressions[:3], Expression("y")),  # no axis, though it ends like one
            driving=replace(avatar.driving, outputs=outputs, head_joint=None),
        )
    )
    frame = DrivingFrame(0.0, {"jawOpen": 0.7, "eyeBlinkLeft": 0.4, "mouthSmileLeft": 0.9})
    found, want = Driver(mirrored(avatar)).pose(frame), mirrored_pose(Driver(avatar).pose(frame))
    assert found.expressions == want.expressions and found.eyelids == want.eyelids
    assert found.joints.keys() == want.joints.keys()
    for joint, delta in want.joints.items():
        np.testing.assert_allclose(found.joints[joint], delta, atol=1e-6)
    assert np.abs(found.joints["jaw"] - Driver(avatar).pose(frame).joints["jaw"]).max() > 1e-2
    yaw, pitch, roll = 0.5, 0.3, -0.2
    x, y, z = np.eye(3)
    head = rodrigues(-yaw * y) @ rodrigues(-pitch * x) @ rodrigues(-roll * z)
    s = np.diag([-1, 1, 1])
    captured = axes.head_rotation(DrivingFrame(0.0, {}, head=(yaw, pitch, roll)))
    np.testing.assert_allclose(head, s @ captured @ s, atol=1e-12)
