"""Left-handed bundles: what stands in their files, and that they say the same as right-handed ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plyfile import PlyData
from safetensors.numpy import load_file

from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Expression, Rules
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.driving import axes
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.handedness import mirrored, mirrored_pose
from tests import bundles
from tests.avatars import full_avatar, surface_avatar
from tests.oracles.lbs import rodrigues

IN_TRIANGLES = Rules("triangle_frame", position="triangle_frame", scale="triangle_linear")
PLAIN = {"preview": False, "engine_files": False, "reference": False}


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
    assert [m["driving"]["head_pivot"] for m in (a, b)] == [[0.01, -0.1, 0.02], [-0.01, -0.1, 0.02]]
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
