"""Every entry compiles with every front end that is here, and its generated text in real contexts."""

from __future__ import annotations

from pathlib import Path

import pytest

from avatar_shaders import ENTRIES, HLSL_ONLY, LANGUAGES, source
from avatar_shaders.generate import HLSL
from avatar_shaders.tools import spirv
from tests.shaders import dxc, gl_process

ALL = ENTRIES | HLSL_ONLY
PROFILES = {"compute": "cs_6_0", "vertex": "vs_6_0", "fragment": "ps_6_0"}
DXC_TARGETS: tuple[tuple[str, ...], ...] = (("-WX", "-Wall"), ("-WX", "-Wall", "-spirv"))


@pytest.mark.parametrize("entry", ALL)
def test_glslang_takes_it_and_the_module_is_valid(entry: str) -> None:
    assert spirv(HLSL, entry)  # spirv() runs spirv-val and raises what either says


def test_every_file_is_an_entry_or_included_by_one() -> None:
    wrappers = {path.name for path in HLSL.glob("*.hlsl")}
    assert wrappers == {row.hlsl for row in ALL.values()}
    texts = "".join(path.read_text("utf-8") for path in HLSL.iterdir())
    assert not [path.name for path in HLSL.glob("*.hlsli") if f'#include "{path.name}"' not in texts]


def test_dxc_takes_it() -> None:
    if dxc.library() is None:
        pytest.skip("libdxcompiler is not here (AVATAR_DXC names it; the compushady package holds one)")
    jobs = [
        (str(HLSL / row.hlsl), entry, PROFILES[row.kind], target)
        for entry, row in ALL.items()
        for target in DXC_TARGETS
    ]
    refused = {job[1]: said for job, said in zip(jobs, dxc.messages(jobs), strict=True) if said}
    assert not refused


def test_dxc_driver_hears_what_the_compiler_says(tmp_path: Path) -> None:
    if dxc.library() is None:
        pytest.skip("libdxcompiler is not here (AVATAR_DXC names it; the compushady package holds one)")
    path = tmp_path / "bad.hlsl"
    path.write_text("[numthreads(1, 1, 1)] void bad() { nowhere = 1; }\n")
    (said,) = dxc.messages([(str(path), "bad", "cs_6_0", ())])
    assert "bad.hlsl:1:" in said and "nowhere" in said


@pytest.mark.parametrize("language", [language for language in LANGUAGES if language.startswith("glsl")])
def test_a_driver_takes_the_generated_text(language: str) -> None:
    programs = [
        {"compute": source(entry, language)} for entry, row in ENTRIES.items() if row.kind == "compute"
    ]
    programs += [
        {"vertex": source(f"{name}_vertex", language), "fragment": source(f"{name}_pixel", language)}
        for name in ("raster", "composite")
    ]
    broken = {"compute": source("activate", language).replace("void main()", "void main(")}
    *said, complaint = gl_process.refusals(language, [*programs, broken])
    assert not any(said), said
    assert "syntax error" in complaint


def test_a_gles_context_refuses_desktop_text() -> None:
    (said,) = gl_process.refusals("glsl310es", [{"compute": source("activate", "glsl430")}])
    assert said
