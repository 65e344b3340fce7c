"""Microsoft's compiler, FXC, takes every HLSL text as Direct3D 11 needs it; a warning is an error.

Unity on Windows draws with Direct3D 11 unless it is told otherwise, and so it compiles with FXC.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

from tools.windows.compiler import is_microsofts

from avatar_shaders import ENTRIES, HLSL_ONLY
from avatar_shaders.generate import HLSL
from tests.shaders import fxc
from tests.shaders.fxc import MICROSOFT, Text, flat
from tests.shaders.test_engines import (
    COMPUTE,
    COPY_TO_TEXTURE,
    KEYWORDS,
    KINDS,
    MATERIAL,
    PASSES,
    SHIMS,
    UNREAL_DRAWS,
    unity_kernel_file,
    unity_pass_text,
)  # fmt: skip

MOST_CPU_S = 15.0  # of this test; 4 were measured
ALL = ENTRIES | HLSL_ONLY
REFUSED = {  # what FXC must find, or it would find nothing at all
    "wave intrinsics": ("X3004", "Out[i] = WaveActiveSum(Out[i]);"),
    "not initialised": ("X4000", "float x; Out[i] = x;"),
    "a reserved name": ("X3000", "float linear = 1; Out[i] = linear;"),
    "shader model 6": ("X3000", "uint64_t x = 1; Out[i] = x;"),
    "attributes of Vulkan": ("X3000", "[[vk::x]] Out[i] = 1;"),
    "a truncation": ("X3206", "float3 x = Out[i]; float2 y = x; Out[i] = y.x;"),
}
AROUND = """\
RWStructuredBuffer<float> Out;
[numthreads(64, 1, 1)] void main(uint i : SV_DispatchThreadID) {{ {} }}
"""
MADE_UP = [Text(what, "main", "compute", AROUND.format(body)) for what, (_, body) in REFUSED.items()]


def plain() -> list[Text]:
    return [Text(name, name, row.kind, flat(HLSL / row.hlsl, ())) for name, row in ALL.items()]


def unity(package: Path) -> list[Text]:
    """Kernels, and both passes with each choice of keywords."""
    folders = (package.parents[1],)
    files = {entry: unity_kernel_file(package, entry) for entry in (*COMPUTE, COPY_TO_TEXTURE)}
    made = [Text(f"Unity, {entry}", entry, "compute", flat(file, folders)) for entry, file in files.items()]
    shader = package / "Shaders" / MATERIAL.relative_to(MATERIAL.parents[2])
    for name, chosen in product(PASSES, product((False, True), repeat=len(KEYWORDS))):
        words = [word for word, on in zip(KEYWORDS, chosen, strict=True) if on]
        text = "".join(f"#define {word} 1\n" for word in words) + flat(shader, folders, unity_pass_text(name))
        made += [Text(f"Unity, {name} {' '.join(words)} {e}", e, kind, text) for e, kind in KINDS.items()]
    return made


def unreal(plugin: Path) -> list[Text]:
    files = {name: (Path(row.hlsl).stem, row.kind) for name, row in ALL.items()}
    files |= {name: ("unreal_draw", "fragment") for name in UNREAL_DRAWS}
    folders = (SHIMS / "unreal",)
    return [
        Text(f"Unreal, {name}", name, kind, flat(plugin / f"Shaders/{file}.usf", folders))
        for name, (file, kind) in files.items()
    ]


def test_fxc_takes_every_text(unity_package: Path, unreal_plugin: Path, tmp_path: Path) -> None:
    texts = [*plain(), *unity(unity_package), *unreal(unreal_plugin)]
    library, results, cpu_s = fxc.compile_all([*texts, *MADE_UP], tmp_path)
    print(f"{len(texts)} texts, {cpu_s:.1f} CPU s with Wine's own processes, compiled by {library}")
    assert cpu_s < MOST_CPU_S
    # The path alone proves nothing: Wine can answer under it with a compiler of its own.
    assert is_microsofts(library), library
    failed = [f"{one.name}: {got.said}" for one, got in zip(texts, results, strict=False) if not got.good]
    assert not failed, "\n".join(failed)
    assert len(texts) > 70 and all(got.compiled_by.startswith(MICROSOFT) for got in results[: len(texts)])
    for (what, (number, _)), got in zip(REFUSED.items(), results[len(texts) :], strict=True):
        assert not got.good and number in got.said, (what, got)
