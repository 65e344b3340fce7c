"""An embedding or a clip that contradicts itself, the mesh or the manifest is refused, and the message says where."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from avatar_export.writers.embedding_json import embedding_json
from avatar_runtime.avatar import Avatar, Embedding, Group, Rules
from avatar_runtime.bundle import load
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.codec import safetensors
from avatar_runtime.codec.embedding import embedding_tensors
from avatar_runtime.io.errors import AvatarError
from avatar_schema import schema
from tests import bundles
from tests.avatars import VERTICES, full_avatar, surface_avatar

IN_TRIANGLES = Rules(
    "triangle_frame", position="triangle_frame", scale="triangle_linear", sh_direction="world"
)
BY_PAPER = Rules("vertex_quaternion_mean", position="interpolated_normal", scale="linear_area")


def changed(name: str, index: Any, value: Any) -> Callable[[Embedding], Embedding]:
    def change(embedding: Embedding) -> Embedding:
        array = getattr(embedding, name).copy()
        array[index] = value
        return replace(embedding, **{name: array})

    return change


FLAT = np.zeros(3, np.float32)
BAD: dict[str, tuple[Callable[[Embedding], Embedding], str]] = {
    "triangle": (changed("triangle", 7, 20), r"embedding.triangle\[7\]: is 20, but the mesh has 20"),
    "corner": (changed("triangles", (3, 1), 20), r"embedding.triangles\[3\]: is \[.*20.*\], but the mesh"),
    "sum": (changed("barycentric", 5, [0.5, 0.5, 0.0002]), r"barycentric\[5\]: is .* add up to 1"),
    "no number": (changed("barycentric", (5, 1), np.nan), "barycentric: is nan at row 5"),
    "displacement": (changed("displacement", 9, np.inf), "displacement: is inf at row 9"),
    "short": (lambda e: replace(e, displacement=e.displacement[:-1]), "displacement: expected"),
    "no area": (
        lambda e: replace(e, canonical_vertices=np.where([[True]], FLAT, e.canonical_vertices)),
        r"embedding.triangle\[0\]: lies on canonical triangle \d+, which has no area",
    ),
    "other triangles": (lambda e: replace(e, triangles=e.triangles[::-1].copy()), "rig.triangles: has other"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_embeddings(name: str) -> None:
    avatar = surface_avatar()
    assert avatar.embedding is not None
    change, message = BAD[name]
    with pytest.raises(AvatarError, match=message):
        check_avatar(replace(avatar, embedding=change(avatar.embedding)))


@pytest.mark.parametrize("u", [1e300, 1e-300, 5e-324, 0.0, float("nan")])
def test_units_that_no_formula_holds(u: float) -> None:
    with pytest.raises(AvatarError, match="training_per_bundle"):
        check_avatar(replace(surface_avatar(), training_per_bundle=u))


def test_weights_that_the_released_code_leaves_are_kept() -> None:
    avatar = surface_avatar()
    assert avatar.embedding is not None
    change = changed("barycentric", 5, [1.0009, -0.0009, 0.00005])
    check_avatar(replace(avatar, embedding=change(avatar.embedding)))


COMBINATIONS: dict[str, tuple[Callable[[Avatar], Avatar], str]] = {
    "no embedding": (lambda a: replace(a, embedding=None), "goes with an embedding"),
    "no surface": (lambda a: replace(full_avatar(), embedding=surface_avatar().embedding), "goes with"),
    "one group": (
        lambda a: replace(a, groups=(Group("a", 0, 40, "surface"), Group("b", 40, 8, "none"))),
        "for all groups or none",
    ),
    "a mixture of rules": (
        lambda a: replace(a, rules=replace(a.rules, scale="triangle_linear")),
        "vertex_quaternion, normal, triangle_linear; with an embedding they are one of",
    ),
    "a mixture with the paper's rules": (
        lambda a: replace(a, rules=replace(BY_PAPER, position="triangle_frame")),
        r"one of vertex_quaternion \| vertex_quaternion_mean, normal \| interpolated_normal, none \| log_area \| "
        "linear_area; triangle_frame, triangle_frame, triangle_linear",
    ),
    "a scale that goes by areas, turned by joints": (
        lambda a: replace(a, rules=Rules("bary_vertex_lbs", scale="log_area")),
        r"bary_vertex_lbs, normal, log_area; .*; bary_vertex_lbs, normal \| interpolated_normal, none",
    ),
    "a rule of joints": (
        lambda a: replace(surface_avatar(rigged=False), rules=Rules("bary_vertex_lbs")),
        "rules.rotation: bary_vertex_lbs rotates Gaussians by the joints: it needs a rig",
    ),
    "a rule of surfaces": (
        lambda a: replace(full_avatar(), rules=Rules("triangle_frame")),
        "triangle_frame, none: such rules need an embedding",
    ),
}


@pytest.mark.parametrize("name", COMBINATIONS)
def test_combinations_that_are_refused(name: str) -> None:
    change, message = COMBINATIONS[name]
    with pytest.raises(AvatarError, match=message):
        check_avatar(change(surface_avatar()))


CLIPS: dict[str, tuple[dict[str, Any], str]] = {
    "no frame": ({"expression_weights": np.zeros((0, 4), np.float32)}, "clips.nod: has no frame"),
    "rate": ({"fps": 0.0}, "clips.nod: fps is 0.0"),
    "not rigid": (
        {"world_from_avatar": np.tile(np.diag([2, 2, 2, 1]).astype(np.float32), (5, 1, 1))},
        r"clips.nod.world_from_avatar\[0\]: is not rigid",
    ),
    "weights": ({"expression_weights": np.zeros((5, 3), np.float32)}, "clips.nod.expression_weights"),
    "joints": ({"joint_delta": np.zeros((5, 4, 4, 4), np.float32)}, "clips.nod.joint_delta: expected"),
    "not affine": ({"world_from_avatar": np.ones((5, 4, 4), np.float32)}, "world_from_avatar: .* affine"),
    "a name twice": ({"name": "blink"}, "clips: 'blink' is empty or a duplicate"),
}


@pytest.mark.parametrize("name", CLIPS)
def test_bad_clips(name: str) -> None:
    avatar = full_avatar()
    change, message = CLIPS[name]
    with pytest.raises(AvatarError, match=message):
        check_avatar(replace(avatar, clips=(replace(avatar.clips[0], **change), avatar.clips[1])))


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    return bundles.write(tmp_path / "bundle", surface_avatar())


def rewrite(bundle: Path, name: str, change: Callable[[dict[str, Any]], Any]) -> None:
    """Change the tensors of a file and sign the bundle again."""
    tensors = dict(safetensors.decode((bundle / name).read_bytes(), name))
    change(tensors)
    (bundle / name).write_bytes(b"".join(safetensors.encode(tensors)))
    bundles.sign(bundle)


@pytest.mark.parametrize("name", ["vertex_ids", "vertex_triangle", "vertex_triangle_ptr"])
def test_lookups_must_follow_from_the_mesh(bundle: Path, name: str) -> None:
    rewrite(bundle, "embedding.safetensors", lambda t: t.update({name: t[name][::-1].copy()}))
    with pytest.raises(AvatarError, match=f"embedding.safetensors: {name}: is not what"):
        load(bundle)


@pytest.mark.parametrize("key", ["vertices", "triangles", "topology_hash"])
def test_the_manifest_names_the_mesh(bundle: Path, key: str) -> None:
    def change(document: Any) -> None:
        entry = document["embedding"]
        entry[key] = entry[key] + 1 if key != "topology_hash" else entry[key][::-1]

    bundles.edit(bundle, change)
    with pytest.raises(AvatarError, match=r"embedding.safetensors: holds 20 vertices in 20 triangles"):
        load(bundle)


def test_the_manifest_counts_the_frames(bundle: Path) -> None:
    bundles.edit(bundle, lambda d: d["clips"][0].update(frames=4))
    with pytest.raises(AvatarError, match=r"clips.safetensors: 0.expression_weights: .* says 4 frames"):
        load(bundle)


@pytest.mark.parametrize("rules", [None, BY_PAPER, IN_TRIANGLES], ids=["normal", "paper", "triangle_frame"])
def test_embedding_json_is_the_tensors_bit_by_bit(rules: Rules | None) -> None:
    avatar = surface_avatar(rules=rules)
    assert avatar.embedding is not None
    pieces = embedding_json(avatar)
    assert pieces is not None
    document = json.loads(b"".join(pieces))
    Draft202012Validator(schema("embedding")).validate(document)
    for name, tensor in embedding_tensors(avatar.embedding).items():
        parsed = np.array(document[name], np.float64 if tensor.dtype.kind == "f" else np.int64)
        parsed = parsed.astype(tensor.dtype).reshape(tensor.shape)
        assert parsed.tobytes() == tensor.tobytes(), name
    assert document["rules"]["position"] == avatar.rules.position
    assert embedding_json(full_avatar()) is None
    assert len(document["canonical_vertices"]) == VERTICES
