"""Loading a bundle: what is refused, what is passed over, what is kept."""

from __future__ import annotations

import json
import os
import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.checks.bundle import validate
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.bundle import load, opener, warnings
from avatar_runtime.codec import safetensors
from avatar_runtime.io.errors import AvatarError
from avatar_schema import LATEST
from tests import bundles
from tests.avatars import full_avatar
from tests.bundles import Document

FILES = ("gaussians.ply", "blendshapes.safetensors", "rig.safetensors")
Damage = Callable[[Path], object]


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


def put(path: str, value: Any) -> Damage:
    """Another value at a path such as $.groups[1].binding of the manifest."""
    *keys, last = [int(part) if part.isdigit() else part for part in re.findall(r"\w+", path)]

    def change(document: Any) -> None:
        for key in keys:
            document = document[key]
        document[last] = value

    return lambda folder: bundles.edit(folder, change)


# Every enum and constant of the schema, with a value that no version knows.
UNKNOWN = {
    "$.rules.rotation": "polar4",
    "$.rules.scale": "cubic",
    "$.rules.sh_direction": "rotation",
    "$.rules.late_morphs": "before_skin",
    "$.rules.anchor": "weighted",
    "$.rules.position": "nearest",
    "$.rules.quaternion_sign": "aligned",
    "$.rules.normal": "raw",
    "$.engine.influences": 5,
    "$.reference.made_by": "hand",
    "$.frame.handedness": "both",
    "$.groups[1].binding": "balloon",
    "$.head_pose_in": "world",
    "$.driving.mode": "network",
    "$.raster.profile": "gsplat",
    "$.raster.depth_key": "distance",
    "$.color_space": "linear",
    "$.background": "sky",
    "$.enhancer.layout": "NHWC",
    "$.format": "avatar",
    "$.frame.up": "+Z",
    "$.frame.face": "-Z",
    "$.frame.length_unit": "centimetre",
    "$.frame.quaternion_order": "xyzw",
    "$.driving.rotation_unit": "degree",
    "$.raster.antialiased": True,
    "$.enhancer.file": "other.onnx",
    "$.enhancer.optional": False,
}
# parts that the bundle does not have
WHOLE = {"$.engine.influences": {}, "$.reference.made_by": {"cases": []}}


@pytest.mark.parametrize("path", UNKNOWN)
def test_an_unknown_value_is_refused(bundle: Path, path: str) -> None:
    part, _, key = path.rpartition(".")
    value = UNKNOWN[path]
    put(*((part, {**WHOLE[path], key: value}) if path in WHOLE else (path, value)))(bundle)
    assert refusal(bundle).startswith(f"avatar.json: {path}: ")


VERSIONS = (
    (("2.0", "2.0"), "knows 1.0: update avatar-export"),
    (("1.3", "1.1"), "needs a reader of 1.1"),
    (("one", "1.0"), "MAJOR.MINOR"),
    (("1.1234567890", "1.0"), "MAJOR.MINOR"),
    (("1.\u0661", "1.0"), "MAJOR.MINOR"),
    (("1.00", "1.0"), "$.asset.version"),
    ((1.0, "1.0"), "MAJOR.MINOR"),
)


@pytest.mark.parametrize(("versions", "message"), VERSIONS)
def test_versions_that_are_refused(bundle: Path, versions: tuple[Any, str], message: str) -> None:
    put("$.asset.version", versions[0])(bundle)
    put("$.asset.minVersion", versions[1])(bundle)
    assert message in refusal(bundle)


def test_a_newer_major_hides_every_other_problem(bundle: Path) -> None:
    bundles.save(bundle, {"asset": {"version": "3.1", "minVersion": "3.0"}})
    assert "3.1 (needs a reader of 3.0)" in refusal(bundle) and "more" not in refusal(bundle)


def test_what_a_newer_minor_adds_is_kept_and_warned_of(bundle: Path) -> None:
    assert warnings(bundle) == []
    put("$.asset.version", "1.1")(bundle)
    put("$.another", {"a": [1, 2.5, None]})(bundle)
    put("$.extensionsUsed", ["VENDOR_hair"])(bundle)
    retensor(bundle, "rig.safetensors", lambda t: t.update(later=np.zeros(3, np.float32)))
    kept = {"extras": {"note": ["kept", 1, None, 0.1]}, "someVendor": {"deep": [{"er": True}]}}
    new = {"another": {"a": [1, 2.5, None]}, "extensionsUsed": ["VENDOR_hair"]}
    assert load(bundle).extras == {**kept, **new}
    (warning,) = warnings(bundle)
    assert warning.warning and f"1.1 is newer than {LATEST}" in warning.message


def test_what_is_not_read_does_no_harm(bundle: Path) -> None:
    """Derived files; and JSON does not tell 2.0 from 2, so JSON Schema takes either."""
    entry = {"path": "rig.glb", "bytes": 1, "sha256": "0" * 64, "derived": True}
    bundles.edit(bundle, lambda d: d["files"].append(entry))
    for path, value in (("gaussians.sh_degree", 2.0), ("groups[0].first", 0.0), ("groups[0].count", 24.0)):
        put(path, value)(bundle)
    avatar = load(bundle)
    assert [type(v) for v in (avatar.sh_degree, avatar.groups[0].first, avatar.groups[0].count)] == [int] * 3


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
def test_links_and_pipes_are_refused(bundle: Path, tmp_path: Path, name: str) -> None:
    shutil.move(bundle / name, tmp_path / name)
    (bundle / name).symlink_to(tmp_path / name)
    assert refusal(bundle) == f"{name}: is not a regular file"
    (bundle / name).unlink()
    os.mkfifo(bundle / name)
    assert refusal(bundle) == f"{name}: is not a regular file"


def test_a_folder_that_is_a_link_is_refused(tmp_path: Path) -> None:
    """It could lead out of the bundle, as a linked file could."""
    bundle = tmp_path / "bundle"
    write_bundle(full_avatar(), bundle, preview=False, engine_files=False)
    (bundle / "reference").rename(tmp_path / "elsewhere")
    (bundle / "reference").symlink_to(tmp_path / "elsewhere")
    load(bundle)  # opens no derived file
    with pytest.raises(
        AvatarError, match=r"^reference/cases\.json: lies in reference, which is a link; copy"
    ):
        opener(bundle)("reference/cases.json", 1 << 30)
    assert any("which is a link" in problem.message for problem in validate(bundle) if not problem.warning)


@pytest.mark.parametrize(
    "path", ["../x", "a/../../x", "/etc/passwd", "..", "a//b", ".hidden", "a\\b", "C:x", "", "a/"]
)
def test_paths_that_lead_elsewhere_are_refused(bundle: Path, path: str) -> None:
    bundles.edit(bundle, lambda d: d["files"].append(d["files"][0] | {"path": path}))
    assert refusal(bundle).startswith("avatar.json: $.files[5].path: ")


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
    "a key twice": (insert('"format": "avatar-export"'), "a name stands twice: 'format'"),
    "a key twice, deep": (insert('"x": [{"a": 1, "b": 2, "a": 1}]'), "a name stands twice: 'a'"),
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


def retensor(folder: Path, name: str, change: Callable[[dict[str, Any]], Any]) -> None:
    """Change the tensors of a file and sign it again."""
    tensors = safetensors.decode((folder / name).read_bytes(), name)
    change(tensors)
    (folder / name).write_bytes(b"".join(safetensors.encode(tensors)))
    bundles.sign(folder)


@pytest.mark.parametrize("name", FILES[1:])
def test_every_tensor_is_needed_with_its_type_and_shape(good: Path, bundle: Path, name: str) -> None:
    data = (good / name).read_bytes()
    for tensor, array in safetensors.decode(data, name).items():
        flat = array.reshape(-1) if array.ndim > 1 else array[:, None]
        for wrong in (None, array.astype(np.float64), array.reshape(-1)[:1].reshape(()), flat):
            (bundle / name).write_bytes(data)
            retensor(bundle, name, lambda t, k=tensor, w=wrong: t.pop(k) if w is None else t.update({k: w}))
            message = refusal(bundle)
            assert tensor in message or "rows" in message or "row_ptr" in message, message


@pytest.mark.parametrize("name", ["rest_local", "inverse_bind_matrix"])
@pytest.mark.parametrize("place", [(3, slice(None), 2), (3, 3, 1)], ids=["flat", "projective"])
def test_joint_matrices_are_affine_and_have_an_inverse(bundle: Path, name: str, place: Any) -> None:
    def damage(tensors: dict[str, Any]) -> None:
        tensors[name] = tensors[name].copy()
        tensors[name][place] = 0 if place[2] == 2 else 0.5

    retensor(bundle, "rig.safetensors", damage)
    assert refusal(bundle) == f"rig.{name}[3]: is not an affine matrix with an inverse"


def test_the_manifest_must_agree_with_the_arrays(bundle: Path) -> None:
    put("$.gaussians.count", 47)(bundle)
    assert "holds 48 Gaussians of SH degree 3, the manifest says 47 of 3" in refusal(bundle)
    put("$.gaussians.count", 48)(bundle)
    bundles.edit(bundle, lambda d: d["expressions"].pop())
    assert "3 columns" in refusal(bundle)
    put("$.joints", None)(bundle)
    assert "binding 'skin' needs a rig" in refusal(bundle)
    put("$.extensionsRequired", ["VENDOR_hair"])(bundle)
    assert refusal(bundle) == "avatar.json: $.extensionsRequired: 'VENDOR_hair' is not known to this reader"


def encrypted(data: bytes) -> bytes:
    at = data.index(b"PK\x01\x02") + 8  # the first entry of the central directory: avatar.json
    return data[:at] + bytes([data[at] | 1]) + data[at + 1 :]


ZIPS: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "cut": (lambda data: data[:-30], "is neither a bundle folder nor a zip"),
    "encrypted": (encrypted, "avatar.json: must be stored, neither compressed nor encrypted"),
    "damaged": (
        lambda d: d.replace(b"element vertex", b"Element vertex"),
        "cannot be read from a.zip (Bad CRC-32",
    ),
}


@pytest.mark.parametrize("name", ZIPS)
def test_bad_zips(good: Path, tmp_path: Path, name: str) -> None:
    path = bundles.zipped(good, tmp_path / "a.zip")
    assert load(path).name == load(good).name
    change, message = ZIPS[name]
    path.write_bytes(change(path.read_bytes()))
    assert message in refusal(path)


def test_what_is_no_bundle(good: Path, tmp_path: Path) -> None:
    deflated = bundles.zipped(good, tmp_path / "b.zip", zipfile.ZIP_DEFLATED)
    assert refusal(deflated) == "avatar.json: must be stored, neither compressed nor encrypted"
    with zipfile.ZipFile(tmp_path / "d.zip", "w") as archive:
        archive.write(good / "avatar.json", "avatar.json")
    assert refusal(tmp_path / "d.zip") == "gaussians.ply: is missing from d.zip"
    assert refusal(tmp_path / "no") == f"{tmp_path / 'no'}: no such file or folder"
    (tmp_path / "text").write_text("hello")
    assert "neither a bundle folder nor a zip" in refusal(tmp_path / "text")
    (tmp_path / "folder").mkdir()
    assert refusal(tmp_path / "folder") == "avatar.json: cannot be read (No such file or directory)"
    document: Document = bundles.manifest(good)
    (tmp_path / "folder" / "avatar.json").write_bytes(
        json.dumps(document, ensure_ascii=False).encode("latin-1")
    )
    assert refusal(tmp_path / "folder").startswith("avatar.json: is not JSON")
