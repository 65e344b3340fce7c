"""Limits of the smallest devices, counted from the reflection table (GLES 3.1 table 20.46 and D3D11)."""

from __future__ import annotations

import math

import pytest

from avatar_shaders import ENTRIES, LANGUAGES, reflection

COMPUTE = [name for name, row in ENTRIES.items() if row.kind == "compute"]
DRAWING = [name for name, row in ENTRIES.items() if row.kind != "compute"]
BYTES = {"uint": 4, "float": 4, "uint2": 8, "float2": 8, "float3": 12, "float4": 16}


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("entry", COMPUTE)
def test_a_compute_stage_fits_the_smallest_device(entry: str, language: str) -> None:
    row = reflection(language)[entry]
    most = 4 if language == "glsl310es" else 8
    assert 1 <= len(row["storage"]) <= most
    assert [s["binding"] for s in row["storage"]] == list(range(len(row["storage"])))  # GLES: bindings 0..3
    assert row["shared_bytes"] <= 16384
    assert math.prod(row["thread_group"]) <= 128
    assert len(row["uniform_blocks"]) == 1


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("entry", DRAWING)
def test_drawing_binds_no_storage_buffer(entry: str, language: str) -> None:
    row = reflection(language)[entry]
    assert row["storage"] == []
    assert len(row.get("inputs", [])) <= 16


def test_elements_are_as_large_as_their_types() -> None:
    for row in reflection("glsl430").values():
        for buffer in row["storage"]:
            assert buffer["type"] in ("uint", "uint2", "float", "float4")
            assert buffer["stride"] == BYTES[buffer["type"]]


def test_constants_of_a_block_do_not_overlap_and_end_inside() -> None:
    for row in reflection("glsl430").values():
        for block in row["uniform_blocks"]:
            end = 0
            for member in block["members"]:
                assert member["offset"] >= end, (block["name"], member["name"])
                end = member["offset"] + member.get("stride", BYTES[member["type"]]) * member.get("count", 1)
            assert end <= block["size"] <= 16384 and block["size"] % 16 == 0


def test_shared_memory_is_counted() -> None:
    shared = {
        name: row["shared_bytes"] for name, row in reflection("glsl430").items() if row.get("shared_bytes")
    }
    assert shared == {"sort_count": 16 * 4, "sort_scan": 128 * 4, "sort_scatter": 16 * 64 * 4}
