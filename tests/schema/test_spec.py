"""SPEC.md names everything there is, and nothing that there is not."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from avatar_export.writers.table import WRITERS
from avatar_runtime.codec import ply
from avatar_runtime.codec.clips import clip_tensors
from avatar_runtime.codec.embedding import embedding_tensors
from avatar_runtime.codec.tensors import gaussian_tensors, rig_tensors
from avatar_runtime.stages import STAGES
from avatar_runtime.stages.raster import PROFILES
from avatar_schema import LATEST, constants, schema
from tests.avatars import full_avatar, surface_avatar

SPEC = (Path(__file__).parents[2] / "schema" / "SPEC.md").read_text("utf-8")
CODE = set(re.findall(r"`([^`\n]+)`", SPEC))
SECTIONS = {title: body for title, body in re.findall(r"^## (.+?)\n(.*?)(?=^## |\Z)", SPEC, re.M | re.S)}


def section(word: str) -> set[str]:
    (body,) = (body for title, body in SECTIONS.items() if word in title)
    return set(re.findall(r"`([^`\n]+)`", body))


def keys(node: dict[str, Any]) -> set[str]:
    """Names of all properties of a schema."""
    found = set(node.get("properties", {}))
    for child in node.get("properties", {}).values():
        found |= keys(child)
    return found | keys(node["items"]) if "items" in node else found


def values(node: dict[str, Any]) -> set[str]:
    """Values of all enums of a schema."""
    found = {value for value in node.get("enum", ()) if isinstance(value, str)}
    for child in (*node.get("properties", {}).values(), *node.get("anyOf", ())):
        found |= values(child)
    return found | values(node["items"]) if "items" in node else found


def tensors() -> set[str]:
    avatar, surface = full_avatar(), surface_avatar()
    assert avatar.rig is not None and surface.embedding is not None
    rows = (
        set(gaussian_tensors(avatar))
        | set(rig_tensors(avatar.rig))
        | set(embedding_tensors(surface.embedding))
    )
    return rows | {name.replace("0.", "i.") for name in clip_tensors(avatar.clips[:1])}


def _pattern(path: str) -> str:
    """The page names the images of reference/ by case and profile."""
    return re.sub(rf"^reference/\w+\.({'|'.join(PROFILES)})", "reference/CASE.PROFILE", path)


OF_SURFACES = {"normal_floor", "quaternion_floor", "area_damping"}  # the rules name them, drawing does not
NAMED = {
    "manifest keys": keys(schema("avatar")),
    "values of rules": values(schema("avatar")),
    "tensors": tensors(),
    "files": {_pattern(w.path) for w in WRITERS} | {"avatar.json"},
    "constants": set(constants()),
    "raster profiles": set(PROFILES),
    "PLY properties": {*ply.OPACITY, "x y z", "nx ny nz", "f_dc_0..2", "f_rest_*", "scale_0..2", "rot_0..3"},
}


@pytest.mark.parametrize("what", NAMED)
def test_the_page_names_all(what: str) -> None:
    assert NAMED[what] - CODE == set()


def test_the_page_invents_no_tensor_and_no_constant() -> None:
    dotted = {
        word for word in section("Sparse matrices") if "." in word and not word.endswith(".safetensors")
    }
    assert dotted - {"M.row_ptr", "M.column", "M.ATTRIBUTE"} == {t for t in tensors() if "." in t}
    drawing = section("Drawing") - {
        "avatar_schema/v1/constants.json",
        "sh_degree",
        "raster.profile",
        *PROFILES,
    }
    assert drawing == set(constants()) - OF_SURFACES


@pytest.mark.parametrize("file", ["rig.safetensors", "embedding.safetensors"])
def test_the_table_of_a_file_has_a_row_for_every_tensor(file: str) -> None:
    table = SECTIONS["4. Sparse matrices"].split(f"### `{file}`")[1].split("###")[0]
    rig, embedding = full_avatar().rig, surface_avatar().embedding
    assert rig is not None and embedding is not None
    held = rig_tensors(rig) if file == "rig.safetensors" else embedding_tensors(embedding)
    first = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    assert sorted(name for cell in first for name in re.findall(r"`([^`]+)`", cell)) == sorted(held)


def test_the_page_invents_no_value_of_a_rule() -> None:
    first_cells = set(re.findall(r"^\| `([^`]+)` \|", SECTIONS["7. Rules"], re.M))
    properties = schema("avatar")["properties"]
    rules = properties["rules"]["properties"]
    tabled = ("rotation", "position", "scale", "sh_direction")
    enums = (properties["groups"]["items"]["properties"]["binding"], *(rules[name] for name in tabled))
    assert first_cells == {value for node in enums for value in node["enum"]}


def test_stages_in_their_order() -> None:
    body = SECTIONS["6. Nine stages"]
    positions = [body.index(f"**{name}**") for name in STAGES]
    assert positions == sorted(positions)


def test_the_version() -> None:
    assert SPEC.startswith(f"# The avatar bundle, version {LATEST}\n")
