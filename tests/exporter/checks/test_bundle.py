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
from tests.exporter.checks.problems import found


def test_a_good_bundle_has_no_problems(good: Path, tmp_path: Path) -> None:
    assert validate(good) == []
    assert validate(bundles.zipped(good, tmp_path / "x.avatar.zip")) == []
    write_bundle(full_avatar(seed=3), tmp_path / "other.avatar.zip", preview=False)
    assert validate(tmp_path / "other.avatar.zip") == []


def test_nothing_there(tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match="no such file"):
        validate(tmp_path / "no")


def test_no_manifest(bundle: Path) -> None:
    (bundle / "avatar.json").write_text("{")
    ((path, message, warning),) = found(bundle)
    assert path == "avatar.json" and message.startswith("is not JSON") and not warning
    (bundle / "avatar.json").unlink()
    assert found(bundle) == [("avatar.json", "cannot be read (No such file or directory)", False)]


def test_every_problem_of_the_manifest_is_listed(bundle: Path) -> None:
    def damage(document: Document) -> None:
        document["rules"]["rotation"] = "polar4"
        document["groups"][1]["count"] = 0
        del document["bounds"]
        document["files"][0]["sha256"] = "short"

    bundles.edit(bundle, damage)
    assert [path for path, _, _ in found(bundle)] == [
        "avatar.json: $",
        "avatar.json: $.files[0].sha256",
        "avatar.json: $.groups[1].count",
        "avatar.json: $.rules.rotation",
    ]


def test_a_newer_minor_is_a_warning_and_the_rest_is_checked(bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d["asset"].update(version="1.7"))
    (bundle / "rig.safetensors").unlink()
    assert [(path, warning) for path, _, warning in found(bundle)] == [
        ("avatar.json: $.asset.version", True),
        ("rig.safetensors", False),
    ]


def test_every_file_is_held_against_the_manifest(bundle: Path) -> None:
    for name in ("gaussians.ply", "blendshapes.safetensors"):
        data = bytearray((bundle / name).read_bytes())
        data[-1] ^= 1
        (bundle / name).write_bytes(data)
    (bundle / "rig.safetensors").unlink()
    (bundle / "packed").mkdir()
    (bundle / "packed" / "notes.txt").write_text("x")
    problems = found(bundle)
    assert [(path, warning) for path, _, warning in problems] == [
        ("gaussians.ply", False),
        ("blendshapes.safetensors", False),
        ("rig.safetensors", False),
        ("packed/notes.txt", True),
    ]
    assert problems[0][1].startswith("sha256 ") and problems[1][1].startswith("sha256 ")
    assert problems[3][1] == "is not listed in the manifest"


def test_a_file_listed_twice(bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d["files"].append(d["files"][1]))
    assert found(bundle) == [
        ("avatar.json: $.files[5].path", "blendshapes.safetensors is a duplicate", False)
    ]


def test_an_unlisted_file_that_is_needed(bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d["files"].pop(0))
    assert found(bundle) == [
        ("gaussians.ply", "is not listed in the manifest", True),
        ("avatar.json: $.files", "does not list gaussians.ply", False),
    ]


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
    assert found(path) == [("readme.txt", "is not listed in the manifest", True)]
    with pytest.warns(UserWarning, match="Duplicate name"), zipfile.ZipFile(path, "a") as archive:
        archive.writestr("rig.safetensors", b"another")
    twice = "is a duplicate in the zip; readers may take either"
    assert ("rig.safetensors", twice, False) in found(path)


def with_gaussians(**changes: Callable[[Any], None]) -> Callable[[Avatar], Avatar]:
    """A change to copies of the arrays of Gaussians."""

    def change(avatar: Avatar) -> Avatar:
        copies = {name: getattr(avatar.gaussians, name).copy() for name in changes}
        for name, apply in changes.items():
            apply(copies[name])
        return replace(avatar, gaussians=replace(avatar.gaussians, **copies))

    return change


def put(index: Any, value: Any) -> Callable[[Any], None]:
    def change(array: Any) -> None:
        array[index] = value

    return change


def skin_weights(sparse: SparseRows, row: int, factor: float) -> SparseRows:
    weight = sparse.values["weight"].copy()
    weight[sparse.row_ptr[row] : sparse.row_ptr[row + 1]] *= np.float32(factor)
    return replace(sparse, values={"weight": weight})


def without_row(sparse: SparseRows, row: int) -> SparseRows:
    first, last = int(sparse.row_ptr[row]), int(sparse.row_ptr[row + 1])
    ptr = sparse.row_ptr.copy()
    ptr[row + 1 :] -= np.uint32(last - first)
    gone = slice(first, last)
    weight = {"weight": np.delete(sparse.values["weight"], gone)}
    return SparseRows(ptr, np.delete(sparse.column, gone), weight, sparse.columns)


def negative(sparse: SparseRows, row: int) -> SparseRows:
    """The row's first two weights, moved apart: the sum stays."""
    weight = sparse.values["weight"].copy()
    at = int(sparse.row_ptr[row])
    assert sparse.row_ptr[row + 1] - at >= 2
    weight[at : at + 2] += np.float32([-2, 2])
    return replace(sparse, values={"weight": weight})


def rig(**changes: Callable[[Any], Any]) -> Callable[[Avatar], Avatar]:
    def change(avatar: Avatar) -> Avatar:
        assert avatar.rig is not None
        new = {name: apply(getattr(avatar.rig, name)) for name, apply in changes.items()}
        return replace(avatar, rig=replace(avatar.rig, **new))

    return change


def moved(array: Any, index: Any, by: float) -> Any:
    array = array.copy()
    array[index] += np.float32(by)
    return array


BUSY = next(row for row in range(24) if np.diff(full_avatar().skin.row_ptr.astype(int))[row] >= 2)
EXPRESSIONS = full_avatar().expressions
SCALE = "has a standard deviation above 10 m"
SUM = "has weights that do not add up to 1 within 0.001"
NONE = "has no weight, so it would collapse to the origin"
FIRST, SKIN, RIG_SKIN = "gaussians.ply: ", "blendshapes.safetensors: skin", "rig.safetensors: skin"
ODD: dict[str, tuple[Callable[[Avatar], Avatar], tuple[str, str, bool]]] = {
    "a quaternion of length 0": (
        with_gaussians(quat_wxyz=put([7, 9, 11], 0)),
        (
            FIRST + "rot[7]",
            "has a quaternion of length 0, drawn as the identity (and 2 more of 48 rows)",
            True,
        ),
    ),
    "a huge scale": (with_gaussians(log_scale=put((30, 2), 2.31)), (FIRST + "scale[30]", SCALE, True)),
    "an endless opacity": (
        with_gaussians(opacity_logit=put(3, -31)),
        (FIRST + "opacity[3]", "has more than 30 from 0: sigmoid is 0 or 1", True),
    ),
    "centimetres": (
        with_gaussians(mean=put((5, 1), 170)),
        (FIRST + "xyz[5]", "has more than 100 m from the origin", True),
    ),
    "weights of a Gaussian": (
        lambda a: replace(a, skin=skin_weights(a.skin, 4, 1.002)),
        (f"{SKIN}[4]", SUM, False),
    ),
    "a skinned Gaussian without weights": (
        lambda a: replace(a, skin=without_row(a.skin, 6)),
        (f"{SKIN}[6]", NONE, False),
    ),
    "a negative weight": (
        lambda a: replace(a, skin=negative(a.skin, BUSY)),
        (f"{SKIN}[{BUSY}]", "has a negative weight", False),
    ),
    "weights of a vertex": (
        rig(skin=lambda s: skin_weights(s, 19, 0.5)),
        (f"{RIG_SKIN}[19]", SUM, False),
    ),
    "a vertex without weights": (rig(skin=lambda s: without_row(s, 2)), (f"{RIG_SKIN}[2]", NONE, False)),
    "a rest pose that is not the binding pose": (
        rig(inverse_bind_matrix=lambda m: moved(m, (2, 0, 3), 2e-4)),
        (
            "rig.safetensors: inverse_bind_matrix[2]",
            "has a skin matrix that is not the identity at rest (within 0.0001)",
            False,
        ),
    ),
    "an alias of two": (
        lambda a: replace(a, expressions=(*EXPRESSIONS[:3], Expression("exp_003", ("jaw_open",)))),
        ("avatar.json: $.expressions[3].aliases", "'jaw_open' is also an alias of 'jawOpen'", False),
    ),
    "an alias that is another's name": (
        lambda a: replace(a, expressions=(*EXPRESSIONS[:3], Expression("exp_003", ("mouthSmileLeft",)))),
        (
            "avatar.json: $.expressions[3].aliases",
            "'mouthSmileLeft' is also an alias of 'mouthSmileLeft'",
            False,
        ),
    ),
    "a range backwards": (
        lambda a: replace(a, expressions=(*EXPRESSIONS[:3], Expression("exp_003", (), (1.0, -1.0)))),
        ("avatar.json: $.expressions[3].range", "is reversed: from 1.0 to -1.0", False),
    ),
    "an input that is not an ARKit name": (
        lambda a: replace(a, driving=replace(a.driving, inputs=("jawOpen", "eyeBlinkLeft", "wink"))),
        (
            "avatar.json: $.driving.inputs[2]",
            "'wink' is not one of the 52 ARKit names, so nothing drives it",
            True,
        ),
    ),
}


# What engine files hold; the others are about numbers that no engine file has, or has otherwise.
IN_ENGINE_FILES = (
    "a quaternion of length 0", "a huge scale", "an endless opacity", "a vertex without weights",
    "a rest pose that is not the binding pose",
)  # fmt: skip


@pytest.mark.parametrize("name", ODD)
def test_numbers_that_no_reader_refuses(tmp_path: Path, name: str) -> None:
    change, expected = ODD[name]
    avatar = check_avatar(change(full_avatar()))
    write_bundle(
        avatar, tmp_path / "out", preview=False, reference=False, engine_files=name in IN_ENGINE_FILES
    )
    assert found(tmp_path / "out") == [expected]


def test_rows_of_other_groups_need_no_weights(tmp_path: Path) -> None:
    avatar = full_avatar()
    avatar = check_avatar(replace(avatar, skin=without_row(avatar.skin, 30)))
    write_bundle(avatar, tmp_path / "out", preview=False, reference=False)
    assert found(tmp_path / "out") == []


def test_entry_counts(bundle: Path) -> None:
    def damage(document: Document) -> None:
        entries = document["blendshapes"]["entries"]
        entries["geometry"] += 1
        entries["skin"] = 3
        del entries["late_morphs"]

    there = {name: getattr(full_avatar().blendshapes, name).entries for name in ("geometry", "late_morphs")}
    has = "but blendshapes.safetensors has"
    bundles.edit(bundle, damage)
    assert found(bundle) == [
        (f"avatar.json: $.blendshapes.entries.{name}", message, False)
        for name, message in {
            "geometry": f"is {there['geometry'] + 1}, {has} {there['geometry']}",
            "late_morphs": f"is missing, {has} {there['late_morphs']}",
            "skin": f"is 3, {has} none",
        }.items()
    ]


def test_bounds(bundle: Path) -> None:
    def shift(box: str, end: str, by: float) -> Callable[[Document], None]:
        def change(document: Document) -> None:
            document["bounds"][box][end][1] += by

        return change

    bundles.edit(bundle, shift("rest", "min", 5e-5))
    bundles.edit(bundle, shift("swept", "max", -5e-5))
    assert found(bundle) == []
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
    bundles.edit(bundle, shift("swept", "max", 1.0))
    bundles.edit(bundle, shift("swept", "min", 1.0))
    assert outside in found(bundle)


def test_a_file_that_is_no_zip_is_a_problem(tmp_path: Path) -> None:
    (tmp_path / "cut.avatar.zip").write_bytes(b"PK\x03\x04 cut short")
    assert [(p.message, p.warning) for p in validate(tmp_path / "cut.avatar.zip")] == [
        ("is neither a bundle folder nor a zip", False)
    ]
