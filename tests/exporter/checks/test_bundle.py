"""`validate` finds each kind of damage, says where, and nothing else."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.checks.bundle import validate
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar, Expression, SparseRows
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError
from tests import bundles
from tests.avatars import full_avatar
from tests.bundles import Document
from tests.exporter.checks.conftest import found
from tests.rigs import sparse as weights_of
from tests.rigs import with_rig


def test_a_good_bundle_has_no_problems(good: Path, tmp_path: Path) -> None:
    assert validate(good) == []
    assert validate(bundles.zipped(good, tmp_path / "x.avatar.zip")) == []
    write_bundle(full_avatar(seed=3), tmp_path / "other.avatar.zip", preview=False)
    assert validate(tmp_path / "other.avatar.zip") == []


def test_no_manifest_and_no_zip(bundle: Path, tmp_path: Path) -> None:
    (bundle / "avatar.json").write_text("{")
    ((path, message, warning),) = found(bundle)
    assert (path, warning) == ("avatar.json", False) and message.startswith("is not JSON")
    (bundle / "avatar.json").unlink()
    assert found(bundle) == [("avatar.json", "cannot be read (No such file or directory)", False)]
    (tmp_path / "cut.avatar.zip").write_bytes(b"PK\x03\x04 cut short")
    assert [warning for *_, warning in found(tmp_path / "cut.avatar.zip")] == [False]
    with pytest.raises(AvatarError, match="no such file"):
        validate(tmp_path / "no")


def wrong_values(document: Document) -> None:
    document["rules"]["rotation"] = "polar4"
    document["groups"][1]["count"] = 0
    del document["bounds"]
    document["files"][0]["sha256"] = "short"


MANIFEST: dict[str, tuple[Callable[[Document], object], list[tuple[str, bool]]]] = {
    "wrong values": (
        wrong_values,
        [
            (f"$.{path}".rstrip("."), False)
            for path in ("", "files[0].sha256", "groups[1].count", "rules.rotation")
        ],
    ),
    "a file listed twice": (lambda d: d["files"].append(d["files"][1]), [("$.files[5].path", False)]),
    "a normative file called derived": (lambda d: d["files"][0].update(derived=True), [("$.files", False)]),
    "a newer minor version": (lambda d: d["asset"].update(version="1.7"), [("$.asset.version", True)]),
}


@pytest.mark.parametrize("name", MANIFEST)
def test_every_problem_of_the_manifest_is_listed(bundle: Path, name: str) -> None:
    change, expected = MANIFEST[name]
    bundles.edit(bundle, change)
    assert [(p, w) for p, _, w in found(bundle)] == [(f"avatar.json: {p}", w) for p, w in expected]


def test_every_file_is_held_against_the_manifest(bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d["asset"].update(version="1.7"))
    data = bytearray((bundle / "blendshapes.safetensors").read_bytes())
    data[-1] ^= 1
    (bundle / "blendshapes.safetensors").write_bytes(data)
    (bundle / "rig.safetensors").unlink()
    (bundle / "packed").mkdir()
    (bundle / "packed" / "notes.txt").write_text("x")
    problems = found(bundle)
    assert [(path, warning) for path, _, warning in problems] == [
        ("avatar.json: $.asset.version", True),
        ("blendshapes.safetensors", False),
        ("rig.safetensors", False),
        ("packed/notes.txt", True),
    ]
    assert problems[1][1].startswith("sha256 ") and "is not listed" in problems[3][1]
    bundles.edit(bundle, lambda d: d["files"].pop(0))
    assert ("gaussians.ply", True) in [(path, warning) for path, _, warning in found(bundle)]


def test_signed_damage_is_found_by_loading(bundle: Path) -> None:
    path = bundle / "gaussians.ply"
    data = bytearray(path.read_bytes())
    data[-4:] = b"\x00\x00\xc0\x7f"  # NaN
    path.write_bytes(data)
    bundles.sign(bundle)
    assert found(bundle) == [("gaussians.ply: rot_3[47]", "is nan; finite numbers are needed", False)]


def test_zips(good: Path, tmp_path: Path) -> None:
    path = bundles.zipped(good, tmp_path / "a.zip")
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("readme.txt", "x")
        archive.mkdir("folder")
    assert [(p, w) for p, _, w in found(path)] == [("readme.txt", True)]
    with pytest.warns(UserWarning, match="Duplicate name"), zipfile.ZipFile(path, "a") as archive:
        archive.writestr("rig.safetensors", b"another")
    assert ("rig.safetensors", False) in [(p, w) for p, _, w in found(path)]


def with_gaussians(name: str, index: Any, value: float) -> Callable[[Avatar], Avatar]:

    def change(avatar: Avatar) -> Avatar:
        array = getattr(avatar.gaussians, name).copy()
        array[index] = value
        return replace(avatar, gaussians=replace(avatar.gaussians, **{name: array}))

    return change


def dense(sparse: SparseRows, row: int, change: Callable[[Any], Any]) -> SparseRows:
    matrix = np.zeros((sparse.rows, sparse.columns), np.float32)
    rows = np.repeat(np.arange(sparse.rows), np.diff(sparse.row_ptr.astype(int)))
    matrix[rows, sparse.column] = sparse.values["weight"]
    matrix[row] = change(matrix[row])
    return weights_of(matrix, "weight")


def skin(row: int, change: Callable[[Any], Any]) -> Callable[[Avatar], Avatar]:
    return lambda avatar: replace(avatar, skin=dense(avatar.skin, row, change))


def rig(**changes: Callable[[Any], Any]) -> Callable[[Avatar], Avatar]:
    def change(avatar: Avatar) -> Avatar:
        new = {name: apply(getattr(avatar.rig, name)) for name, apply in changes.items()}
        return with_rig(avatar, **new)

    return change


def last(alias: str = "", **changes: Any) -> Callable[[Avatar], Avatar]:
    named = Expression("exp_003", (alias,) if alias else (), **changes)
    return lambda avatar: replace(avatar, expressions=(*avatar.expressions[:3], named))


def off(matrices: Any) -> Any:
    moved = matrices.copy()
    moved[2, 0, 3] += np.float32(2e-4)
    return moved


PLY, ALIASES = "gaussians.ply: ", "avatar.json: $.expressions[3].aliases"
SKIN, RIG = "blendshapes.safetensors: skin", "rig.safetensors: skin"
ODD: dict[str, tuple[Callable[[Avatar], Avatar], str, str, bool]] = {  # the change, path, a word, a warning or not
    "a quaternion of length 0": (with_gaussians("quat_wxyz", [7, 9, 11], 0), f"{PLY}rot[7]", "2 more", True),
    "a huge scale": (with_gaussians("log_scale", (30, 2), 2.31), f"{PLY}scale[30]", "10 m", True),
    "an endless opacity": (with_gaussians("opacity_logit", 3, -31), f"{PLY}opacity[3]", "sigmoid", True),
    "centimetres": (with_gaussians("mean", (5, 1), 170), f"{PLY}xyz[5]", "100 m", True),
    "weights of a Gaussian": (skin(4, lambda w: w * np.float32(1.002)), f"{SKIN}[4]", "add up to 1", False),
    "a skinned Gaussian without weights": (skin(6, lambda w: 0 * w), f"{SKIN}[6]", "no weight", False),
    "a negative weight": (skin(4, lambda w: [-2, 3, 0, 0, 0]), f"{SKIN}[4]", "negative", False),
    "a Gaussian of another group without weights": (skin(30, lambda w: 0 * w), "", "", False),
    "weights of a vertex": (rig(skin=lambda s: dense(s, 19, lambda w: w / 2)), f"{RIG}[19]", "add up to 1", False),
    "a vertex without weights": (rig(skin=lambda s: dense(s, 2, lambda w: 0 * w)), f"{RIG}[2]", "no weight", False),
    "a rest pose that is not the binding pose": (
        rig(inverse_bind_matrix=off), "rig.safetensors: inverse_bind_matrix[2]", "identity", False
    ),
    "an alias of two": (last("jaw_open"), ALIASES, "'jawOpen'", False),
    "an alias that is another's name": (last("mouthSmileLeft"), ALIASES, "'mouthSmileLeft'", False),
    "a range backwards": (last(range=(1.0, -1.0)), "avatar.json: $.expressions[3].range", "reversed", False),
    "an input that is not an ARKit name": (
        lambda a: replace(a, driving=replace(a.driving, inputs=("jawOpen", "eyeBlinkLeft", "wink"))),
        "avatar.json: $.driving.inputs[2]", "'wink'", True,
    ),
}  # fmt: skip


# What engine files hold; the others are about numbers that no engine file has, or has otherwise.
@pytest.mark.parametrize("name", ODD)
def test_numbers_that_no_reader_refuses(tmp_path: Path, name: str) -> None:
    change, path, word, warning = ODD[name]
    bundles.write(tmp_path / "out", check_avatar(change(full_avatar())))
    problems = found(tmp_path / "out")
    assert [(p, w) for p, _, w in problems] == ([(path, warning)] if path else [])
    assert all(word in message for _, message, _ in problems)


def test_entry_counts(bundle: Path) -> None:
    def damage(document: Document) -> None:
        entries = document["blendshapes"]["entries"]
        entries["geometry"] += 1
        entries["skin"] = 3
        del entries["late_morphs"]

    bundles.edit(bundle, damage)
    problems = found(bundle)
    names = ("geometry", "late_morphs", "skin")
    assert [p for p, _, _ in problems] == [f"avatar.json: $.blendshapes.entries.{name}" for name in names]
    assert str(full_avatar().blendshapes.geometry.entries + 1) in problems[0][1]


def test_bounds(bundle: Path) -> None:
    def shift(box: str, end: str, by: float) -> Callable[[Document], None]:
        def change(document: Document) -> None:
            document["bounds"][box][end][1] += by

        return change

    bundles.edit(bundle, shift("rest", "min", 2e-4))
    bundles.edit(bundle, shift("swept", "max", 1.0))
    problems = found(bundle)
    assert [(path, warning) for path, _, warning in problems] == [
        ("avatar.json: $.bounds.rest.min", False),
        ("avatar.json: $.bounds.swept.max", True),
    ]
    outside = ("avatar.json: $.bounds.swept", "does not contain the box at rest", False)
    assert outside not in found(bundle)
    bundles.edit(bundle, shift("swept", "max", -2.0))
    assert outside in found(bundle)
