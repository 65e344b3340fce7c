"""HLSL without what engines differ in, cores that any can include, headers that tell the truth. See also test_fxc."""

from __future__ import annotations

import re

import pytest

from avatar_schema import rules
from avatar_shaders.generate import HLSL

FILES = sorted(path.name for path in HLSL.iterdir())
CORES = [name for name in FILES if name.endswith(".hlsli")]
FORBIDDEN = {
    "half or a minimum precision": r"\b(half[1-4]?|min16\w*)\b",
    "64 bits": r"\bdouble\b",
    "#pragma once": r"#\s*pragma\s+once",
    "engine macros": r"\b(UNITY_|SHADER_API|COMPILER_|_ProjectionParams)",
}
RESOURCES = r"\b(RW)?(StructuredBuffer|ByteAddressBuffer|Buffer|Texture\w+)\s*<|\bcbuffer\b|\bgroupshared\b"
REGISTER = r"\bregister\s*\("


def code(name: str) -> str:
    """Text without comments; macro definitions are left out where `name` is the platform's."""
    text = re.sub(r"//.*", "", (HLSL / name).read_text("utf-8"))
    return re.sub(r"^#define.*$", "", text, flags=re.MULTILINE) if name == "platform.hlsli" else text


@pytest.mark.parametrize("what", FORBIDDEN)
def test_no_file_uses(what: str) -> None:
    found = {name: re.search(FORBIDDEN[what], code(name)) for name in FILES}
    assert not {name: match[0] for name, match in found.items() if match}


@pytest.mark.parametrize("name", CORES)
def test_a_core_binds_nothing_and_may_be_included_twice(name: str) -> None:
    assert not re.search(RESOURCES, code(name))
    guard = f"AVATAR_{name.removesuffix('.hlsli').upper()}_HLSLI"
    assert f"#ifndef {guard}\n#define {guard}\n" in (HLSL / name).read_text("utf-8")


CODE_OF_A_RULE = re.compile(r"\b(?:\w+_rule|quaternion_sign|sh_direction)\s*[!=<>]=?\s*(\w+)")


def test_rules_are_compared_with_names_of_the_table() -> None:
    macros = set(re.findall(r"^#define (\w+) \d+$", (HLSL / "rules.hlsli").read_text("utf-8"), re.M))
    assert macros == {f"AVATAR_{r.name}_{name}".upper() for r in rules().values() for name in r.names()}
    compared = {name: CODE_OF_A_RULE.findall(code(name)) for name in FILES}
    assert sum(map(len, compared.values())) >= 12
    assert not {name: found for name, found in compared.items() if not set(found) <= macros}


def test_nothing_has_a_fixed_register() -> None:
    assert not [name for name in FILES if re.search(REGISTER, code(name))]
