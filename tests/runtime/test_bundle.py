"""Loading a bundle: what is refused, what is passed over, what is kept."""

from __future__ import annotations

import json
import os
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.checks.bundle import validate
from avatar_export.writers.bundle import write_bundle
from avatar_runtime import rules as rule_values
from avatar_runtime.bundle import load, opener, warnings
from avatar_runtime.codec import safetensors
from avatar_runtime.io.errors import AvatarError
from avatar_schema import LATEST, schema
from tests import bundles
from tests.avatars import full_avatar
from tests.bundles import Document


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bundles.write(tmp_path_factory.mktemp("bundle") / "good")


@pytest.fixture
def bundle(good: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    return Path(shutil.copytree(good, tmp_path / "bundle"))


def refusal(path: Path) -> str:
    """The one line that `load` refuses `path` with."""
    with pytest.raises(AvatarError) as caught:
        load(path)
    message = str(caught.value)
    assert "\n" not in message and len(message) < 600
    return message


def set_at(*keys: str | int, value: Any) -> Callable[[Document], None]:
    def change(document: Any) -> None:
        for key in keys[:-1]:
            document = document[key]
        document[keys[-1]] = value

    return change


# Every enum of the schema with a value that no version knows; "anyOf" shows as its own message.
RULES = {
    "$.rules.rotation": set_at("rules", "rotation", value="polar4"),
    "$.rules.scale": set_at("rules", "scale", value="cubic"),
    "$.rules.sh_direction": set_at("rules", "sh_direction", value="rotation"),
    "$.rules.late_morphs": set_at("rules", "late_morphs", value="before_skin"),
    "$.rules.anchor": set_at("rules", "anchor", value="weighted"),
    "$.rules.position": set_at("rules", "position", value="nearest"),
    "$.rules.quaternion_sign": set_at("rules", "quaternion_sign", value="aligned"),
    "$.rules.normal": set_at("rules", "normal", value="raw"),
    "$.engine.influences": set_at("engine", value={"influences": 5}),
    "$.reference.made_by": set_at("reference", value={"made_by": "hand", "cases": []}),
    "$.frame.handedness": set_at("frame", "handedness", value="both"),
    "$.groups[1].binding": set_at("groups", 1, "binding", value="balloon"),
    "$.head_pose_in": set_at("head_pose_in", value="world"),
    "$.driving.mode": set_at("driving", "mode", value="network"),
    "$.raster.profile": set_at("raster", "profile", value="gsplat"),
    "$.raster.depth_key": set_at("raster", "depth_key", value="distance"),
    "$.color_space": set_at("color_space", value="linear"),
    "$.background": set_at("background", value="sky"),
    "$.enhancer.layout": set_at("enhancer", "layout", value="NHWC"),
}
CONSTANTS = {
    "$.format": set_at("format", value="avatar"),
    "$.frame.up": set_at("frame", "up", value="+Z"),
    "$.frame.face": set_at("frame", "face", value="-Z"),
    "$.frame.length_unit": set_at("frame", "length_unit", value="centimetre"),
    "$.frame.quaternion_order": set_at("frame", "quaternion_order", value="xyzw"),
    "$.driving.rotation_unit": set_at("driving", "rotation_unit", value="degree"),
    "$.raster.antialiased": set_at("raster", "antialiased", value=True),
    "$.enhancer.file": set_at("enhancer", "file", value="other.onnx"),
    "$.enhancer.optional": set_at("enhancer", "optional", value=False),
}


@pytest.mark.parametrize("path", RULES | CONSTANTS)
def test_an_unknown_value_of_a_rule_is_refused(bundle: Path, path: str) -> None:
    bundles.edit(bundle, (RULES | CONSTANTS)[path])
    message = refusal(bundle)
    assert message.startswith(f"avatar.json: {path}: ")
    if path in RULES and path != "$.background":
        assert "unknown to this reader (it knows " in message


def test_every_enum_and_constant_of_the_schema_is_tried_above() -> None:
    def closed(node: Any, path: str) -> set[str]:
        if "enum" in node or "const" in node:
            return {path}
        found = set()
        for name, child in node.get("properties", {}).items():
            found |= closed(child, f"{path}.{name}")
        if "items" in node:
            found |= closed(node["items"], f"{path}[1]")
        for child in node.get("anyOf", ()):
            found |= closed(child, path)
        return found

    assert closed(schema("avatar"), "$") == {*RULES, *CONSTANTS}


def test_the_schema_and_the_model_know_the_same_rules() -> None:
    properties = schema("avatar")["properties"]
    rules = properties["rules"]["properties"]
    known = {
        rule_values.BINDINGS: properties["groups"]["items"]["properties"]["binding"],
        rule_values.ROTATION_RULES: rules["rotation"],
        rule_values.SH_DIRECTIONS: rules["sh_direction"],
        rule_values.ANCHOR_RULES: rules["anchor"],
        rule_values.POSITION_RULES: rules["position"],
        rule_values.SCALE_RULES: rules["scale"],
        rule_values.QUATERNION_SIGNS: rules["quaternion_sign"],
        rule_values.HEAD_POSE_IN: properties["head_pose_in"],
    }
    for values, node in known.items():
        assert set(values) == set(node["enum"])


VERSIONS = {
    "newer major": (("2.0", "2.0"), "knows 1.0: update avatar-export"),
    "older major": (("0.9", "0.9"), "knows 1.0"),
    "newer major that claims to need less": (("2.0", "1.0"), "knows 1.0"),
    "unmet minVersion": (("1.3", "1.1"), "needs a reader of 1.1"),
    "no number": (("one", "1.0"), "MAJOR.MINOR"),
    "three parts": (("1.0.0", "1.0"), "MAJOR.MINOR"),
    "ten digits": (("1.1234567890", "1.0"), "MAJOR.MINOR"),
    "other digits": (("1.\u0661", "1.0"), "MAJOR.MINOR"),
    "leading zero": (("1.00", "1.0"), "$.asset.version"),
    "a number": ((1.0, "1.0"), "MAJOR.MINOR"),
}


@pytest.mark.parametrize("name", VERSIONS)
def test_versions_that_are_refused(bundle: Path, name: str) -> None:
    (version, minimum), message = VERSIONS[name]
    bundles.edit(bundle, lambda d: d["asset"].update(version=version, minVersion=minimum))
    assert message in refusal(bundle)


def test_a_newer_major_hides_every_other_problem(bundle: Path) -> None:
    bundles.save(bundle, {"asset": {"version": "3.1", "minVersion": "3.0"}})
    message = refusal(bundle)
    assert "3.1 (needs a reader of 3.0)" in message and "more" not in message


def test_a_newer_minor_loads_with_a_warning(bundle: Path) -> None:
    assert warnings(bundle) == []
    bundles.edit(bundle, lambda d: d["asset"].update(version="1.1"))
    assert load(bundle).name == "Full Ävatar"
    (warning,) = warnings(bundle)
    assert warning.warning and f"1.1 is newer than {LATEST}" in warning.message


def test_extensions(bundle: Path) -> None:
    bundles.edit(bundle, set_at("extensionsUsed", value=["VENDOR_hair"]))
    assert load(bundle).extras["extensionsUsed"] == ["VENDOR_hair"]
    bundles.edit(bundle, set_at("extensionsRequired", value=["VENDOR_hair"]))
    assert refusal(bundle) == "avatar.json: $.extensionsRequired: 'VENDOR_hair' is not known to this reader"


def test_unknown_keys_are_kept(bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d.update(another={"a": [1, 2.5, None]}))
    extras = load(bundle).extras
    assert extras["another"] == {"a": [1, 2.5, None]}
    assert extras["extras"] == {"note": ["kept", 1, None, 0.1]}
    assert extras["someVendor"] == {"deep": [{"er": True}]}
    assert set(extras) == {"another", "extras", "someVendor"}


FILES = ("gaussians.ply", "blendshapes.safetensors", "rig.safetensors")


@pytest.mark.parametrize("name", FILES)
def test_files_are_held_against_the_manifest(bundle: Path, name: str) -> None:
    path = bundle / name
    data = path.read_bytes()
    path.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    assert f"{name}: sha256 " in refusal(bundle)
    path.write_bytes(data[:-1])
    assert f"{name}: is {len(data) - 1} bytes, the manifest says {len(data)}" in refusal(bundle)
    path.write_bytes(data + b"\0")
    assert f"{name}: is {len(data) + 1} bytes, expected at most {len(data)}" in refusal(bundle)
    path.unlink()
    assert refusal(bundle) == f"{name}: cannot be read (No such file or directory)"
    path.mkdir()
    assert refusal(bundle) == f"{name}: is not a regular file"
    bundles.edit(bundle, lambda d: d.update(files=[e for e in d["files"] if e["path"] != name]))
    assert refusal(bundle) == f"avatar.json: $.files: does not list {name}"


def test_a_size_that_lies_is_refused_before_anything_is_read(bundle: Path) -> None:
    with (bundle / "gaussians.ply").open("r+b") as file:
        file.truncate(1 << 40)  # sparse: reading it would need a terabyte
    assert f"is {1 << 40} bytes, expected at most" in refusal(bundle)


@pytest.mark.parametrize("name", (*FILES, "avatar.json"))
def test_links_are_refused(bundle: Path, tmp_path: Path, name: str) -> None:
    shutil.move(bundle / name, tmp_path / name)
    (bundle / name).symlink_to(tmp_path / name)
    assert refusal(bundle) == f"{name}: is not a regular file"


def test_a_folder_that_is_a_link_is_refused(tmp_path: Path) -> None:
    """It could lead out of the bundle, as a linked file could."""
    bundle = tmp_path / "bundle"
    write_bundle(full_avatar(), bundle, preview=False, engine_files=False)
    (bundle / "reference").rename(tmp_path / "elsewhere")
    (bundle / "reference").symlink_to(tmp_path / "elsewhere")
    load(bundle)  # opens no derived file
    read = opener(bundle)
    with pytest.raises(
        AvatarError, match=r"^reference/cases\.json: lies in reference, which is a link; copy"
    ):
        read("reference/cases.json", 1 << 30)
    assert any("which is a link" in problem.message for problem in validate(bundle) if not problem.warning)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_and_not_waited_for(bundle: Path) -> None:
    (bundle / "gaussians.ply").unlink()
    os.mkfifo(bundle / "gaussians.ply")
    assert refusal(bundle) == "gaussians.ply: is not a regular file"


@pytest.mark.parametrize(
    "path", ["../x", "a/../../x", "/etc/passwd", "..", "a//b", ".hidden", "a\\b", "C:x", "", "a/"]
)
def test_paths_that_lead_elsewhere_are_refused(bundle: Path, path: str) -> None:
    bundles.edit(bundle, lambda d: d["files"].append(d["files"][0] | {"path": path}))
    assert refusal(bundle).startswith("avatar.json: $.files[5].path: ")


def test_a_rig_that_is_not_there_may_not_be_needed(bundle: Path) -> None:
    bundles.edit(bundle, set_at("joints", value=None))
    assert "binding 'skin' needs a rig" in refusal(bundle)


def insert(text: str) -> Callable[[str], str]:
    return lambda document: document.replace("{", "{" + text + ", ", 1)


TEXTS: dict[str, tuple[Callable[[str], str], str]] = {
    "cut": (lambda t: t[:-3], "is not JSON"),
    "empty": (lambda t: "", "is not JSON"),
    "a list": (lambda t: f"[{t}]", "is not a JSON object"),
    "NaN": (insert('"x": NaN'), "NaN is not a number"),
    "Infinity": (insert('"x": -Infinity'), "-Infinity is not a number"),
    "a float beyond float64": (insert('"x": 1e999'), "1e999 is not a number"),
    "an integer beyond 64 bits": (insert('"x": ' + "1" * 400), "is not a number that every reader can hold"),
    "a key twice": (insert('"format": "avatar-export"'), "duplicate"),
    "a key twice, deep": (
        insert('"x": [{"a": 1, "b": 2, "a": 1}]'),
        "has a duplicate among the keys a, b, a",
    ),
    "half a surrogate pair": (insert('"x": "\\ud800"'), "surrogates not allowed"),
    "nested too deep": (insert('"x": ' + "[" * 100_000 + "]" * 100_000), "is not JSON"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_json_that_readers_would_understand_differently_is_refused(bundle: Path, name: str) -> None:
    change, message = TEXTS[name]
    path = bundle / "avatar.json"
    path.write_text(change(path.read_text("utf-8")), "utf-8")
    refused = refusal(bundle)
    assert refused.startswith("avatar.json: ") and message in refused


def test_integers_may_be_written_as_floats(bundle: Path) -> None:
    """JSON does not tell 2.0 from 2, so JSON Schema takes either; array indices must not."""
    bundles.edit(bundle, set_at("gaussians", "sh_degree", value=2.0))
    bundles.edit(bundle, set_at("groups", 0, "first", value=0.0))
    bundles.edit(bundle, set_at("groups", 0, "count", value=24.0))
    avatar = load(bundle)
    assert [type(v) for v in (avatar.sh_degree, avatar.groups[0].first, avatar.groups[0].count)] == [int] * 3


def retensor(folder: Path, name: str, change: Callable[[dict[str, Any]], Any]) -> None:
    """Change the tensors of a file and sign it again."""
    tensors = safetensors.decode((folder / name).read_bytes(), name)
    change(tensors)
    (folder / name).write_bytes(b"".join(safetensors.encode(tensors)))
    bundles.sign(folder)


@pytest.mark.parametrize("name", FILES[1:])
def test_every_tensor_is_needed_with_its_type_and_shape(good: Path, tmp_path: Path, name: str) -> None:
    data = (good / name).read_bytes()
    for tensor, array in safetensors.decode(data, name).items():
        for kind, wrong in {
            "missing": None,
            "type": array.astype(np.float64),
            "scalar": array.reshape(-1)[:1].reshape(()),
            "flat": array.reshape(-1) if array.ndim > 1 else array[:, None],
        }.items():
            folder = tmp_path / f"{tensor}-{kind}"
            shutil.copytree(good, folder)
            retensor(folder, name, lambda t, k=tensor, w=wrong: t.pop(k) if w is None else t.update({k: w}))
            message = refusal(folder)
            assert tensor in message or "rows" in message or "row_ptr" in message, message


@pytest.mark.parametrize("name", ["rest_local", "inverse_bind_matrix"])
@pytest.mark.parametrize("place", [(3, slice(None), 2), (3, 3, 1)], ids=["flat", "projective"])
def test_joint_matrices_are_affine_and_have_an_inverse(bundle: Path, name: str, place: Any) -> None:
    def damage(tensors: dict[str, Any]) -> None:
        tensors[name] = tensors[name].copy()
        tensors[name][place] = 0 if place[2] == 2 else 0.5

    retensor(bundle, "rig.safetensors", damage)
    assert refusal(bundle) == f"rig.{name}[3]: is not an affine matrix with an inverse"


def test_extra_tensors_are_passed_over(bundle: Path) -> None:
    """A newer minor may add some."""
    retensor(bundle, "rig.safetensors", lambda t: t.update(later=np.zeros(3, np.float32)))
    load(bundle)


def test_a_stored_zip_loads_and_any_other_is_refused(good: Path, tmp_path: Path) -> None:
    assert load(bundles.zipped(good, tmp_path / "a.zip")).name == load(good).name
    deflated = bundles.zipped(good, tmp_path / "b.zip", zipfile.ZIP_DEFLATED)
    assert refusal(deflated) == "avatar.json: must be stored, neither compressed nor encrypted"
    cut = tmp_path / "c.zip"
    cut.write_bytes((tmp_path / "a.zip").read_bytes()[:-30])
    assert refusal(cut) == f"{cut}: is neither a bundle folder nor a zip"
    with zipfile.ZipFile(tmp_path / "d.zip", "w") as archive:
        archive.write(good / "avatar.json", "avatar.json")
    assert refusal(tmp_path / "d.zip") == "gaussians.ply: is missing from d.zip"


def test_an_encrypted_entry_is_refused(good: Path, tmp_path: Path) -> None:
    path = bundles.zipped(good, tmp_path / "a.zip")
    data = bytearray(path.read_bytes())
    at = data.index(b"PK\x01\x02")  # the first entry of the central directory: avatar.json
    data[at + 8] |= 1
    path.write_bytes(data)
    assert refusal(path) == "avatar.json: must be stored, neither compressed nor encrypted"


def test_a_zip_with_a_damaged_entry_is_refused(good: Path, tmp_path: Path) -> None:
    path = bundles.zipped(good, tmp_path / "a.zip")
    data = path.read_bytes()
    at = data.index(b"element vertex")
    path.write_bytes(data[:at] + b"E" + data[at + 1 :])
    assert "gaussians.ply: cannot be read from a.zip (Bad CRC-32" in refusal(path)


def test_no_such_bundle(tmp_path: Path) -> None:
    assert refusal(tmp_path / "no") == f"{tmp_path / 'no'}: no such file or folder"
    (tmp_path / "text").write_text("hello")
    assert "neither a bundle folder nor a zip" in refusal(tmp_path / "text")
    (tmp_path / "folder").mkdir()
    assert refusal(tmp_path / "folder") == "avatar.json: cannot be read (No such file or directory)"


def test_derived_files_are_not_opened(bundle: Path) -> None:
    bundles.edit(
        bundle,
        lambda d: d["files"].append({"path": "rig.glb", "bytes": 1, "sha256": "0" * 64, "derived": True}),
    )
    load(bundle)


def test_the_manifest_must_agree_with_the_arrays(bundle: Path) -> None:
    bundles.edit(bundle, set_at("gaussians", "count", value=47))
    assert "holds 48 Gaussians of SH degree 3, the manifest says 47 of 3" in refusal(bundle)
    bundles.edit(bundle, set_at("gaussians", "count", value=48))
    bundles.edit(bundle, set_at("gaussians", "sh_degree", value=3))
    load(bundle)
    bundles.edit(bundle, lambda d: d["expressions"].pop())
    assert "3 columns" in refusal(bundle)


def test_json_is_utf8(bundle: Path) -> None:
    text = json.dumps(bundles.manifest(bundle), ensure_ascii=False)
    (bundle / "avatar.json").write_bytes(text.encode("latin-1"))
    assert refusal(bundle).startswith("avatar.json: is not JSON")
