"""One WebAssembly module of the compute entries that need no memory of a thread group, for players without WebGPU.

slangc writes C++ of every entry; wasm/prelude.hpp declares what that text uses, and a few lines made here of the row of
reflection.json call it row by row. Zig's C++ compiler makes the module.
"""

from __future__ import annotations

import re
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from avatar_shaders.generate import HLSL, PACKAGE
from avatar_shaders.slang import slang
from avatar_shaders.tools import ShaderError, program, run

PRELUDE = PACKAGE / "wasm" / "prelude.hpp"
_END_OF_PRELUDE = "using namespace SLANG_PRELUDE_NAMESPACE;\n#endif\n"
_WRAPPERS = "// [numthreads("  # the first of three functions that walk groups of threads
# Nothing may round otherwise than on a GPU without fma: no contraction, no fast math.
_OPTIONS = ("--target=wasm32-freestanding", "-std=c++20", "-O3", "-msimd128", "-ffp-contract=off")
_CODE = ("-fno-exceptions", "-fno-rtti", "-g0", "-w", "-nostdlib", "-rtlib=compiler-rt")
_LINK = ("--no-entry", "--strip-all", "--export=__heap_base", "-z,stack-size=65536")
# Where these constants have these values, rows run in a loop of their own, in which the compiler knows them. It is
# made for what takes the most time: heads with SH of degree 3 and deltas of 8 bits. All else takes the other loop.
USUAL = {
    "blend": {
        "sh_terms": 16,
        "base_sh_width": 16,
        "geometry_column_width": 8,
        "appearance_column_width": 8,
        "appearance_sh_width": 8,
    },
}
_KERNEL = """\
INLINE static void {name}_loop(entry_{name}::GlobalParams_0 bound, uint32_t first, uint32_t rows)
{{
    for (uint32_t row = first; row < first + rows; ++row)
    {{
        ComputeThreadVaryingInput thread = {{{{0, 0, 0}}, {{row, 0, 0}}}};
        entry_{name}::_{name}(&thread, nullptr, &bound);
    }}
}}

extern "C" void {name}_rows(const uint32_t* params, uint32_t first, uint32_t rows) __asm__("{name}");
void {name}_rows(const uint32_t* params, uint32_t first, uint32_t rows)
{{
    using namespace entry_{name};
    // A copy, so that the compiler knows that what a row writes changes no constant.
    {block} constants = *reinterpret_cast<const {block}*>(params[{buffers}]);
    GlobalParams_0 bound;
{bind}
    bound.{constants}_0 = &constants;
{usual}    {name}_loop(bound, first, rows);
}}
"""


def kernel_entries(rows: dict[str, dict[str, Any]]) -> list[str]:
    """Names of the entries that are functions of the module, by the rows of reflection.json."""
    return [name for name, row in rows.items() if row["kind"] == "compute" and not row["shared_bytes"]]


def kernels(rows: dict[str, dict[str, Any]], hlsl: Path = HLSL) -> bytes:
    """The module. Raises ShaderError where a file does not compile, a layout differs or a tool is missing."""
    names = kernel_entries(rows)
    with ThreadPoolExecutor() as pool:
        bodies = dict(zip(names, pool.map(lambda name: _body(hlsl, name), names), strict=True))
    source = PRELUDE.read_text("utf-8") + "".join(_entry(name, bodies[name], rows[name]) for name in names)
    with tempfile.TemporaryDirectory() as temporary:
        text, module = Path(temporary) / "kernels.cpp", Path(temporary) / "kernels.wasm"
        text.write_text(source, "utf-8")
        link = [f"-Wl,{option}" for option in (*_LINK, *(f"--export={name}" for name in names))]
        done = run([program("zig"), "c++", *_OPTIONS, *_CODE, *link, "-o", str(module), str(text)])
        if done.returncode or not module.is_file():
            said = done.stderr.decode(errors="replace").replace(f"{temporary}/", "")
            raise ShaderError(f"{said or 'no message'} (zig c++, the kernels as WebAssembly)")
        return module.read_bytes()


def _body(hlsl: Path, name: str) -> str:
    """The entry as C++, without Slang's prelude and without what walks groups of threads. All calls are inlined."""
    text = slang(hlsl, name, "cpp").rpartition(_END_OF_PRELUDE)[2].partition(_WRAPPERS)[0]
    text = text.replace(f"void _{name}(", f"static void _{name}(")
    return re.sub(r"^static ", "INLINE static ", text, flags=re.MULTILINE)


def _entry(name: str, body: str, row: dict[str, Any]) -> str:
    """An entry in a namespace of its own, its layout checked, and the function that is exported."""
    (block,) = row["uniform_blocks"]
    struct = f"SLANG_ParameterGroup_{block['name']}_0"
    members = _members(name, body, struct, block)
    checks = "".join(
        f'static_assert(offsetof({struct}, {members[m["name"]]}) == {m["offset"]}, "{name}: {m["name"]}");\n'
        for m in block["members"]
    )
    bind = "\n".join(
        f"    bound.{buffer['name']}_0.elements = "
        f"reinterpret_cast<decltype(bound.{buffer['name']}_0.elements)>(params[{number}]);"
        for number, buffer in enumerate(row["storage"])
    )
    kernel = _KERNEL.format(
        name=name,
        block=struct,
        buffers=len(row["storage"]),
        bind=bind,
        constants=block["name"],
        usual=_usual(name, members),
    )
    return f"namespace entry_{name}\n{{\n{body}\n{checks}}}\n\n{kernel}\n"


def _members(name: str, body: str, struct: str, block: dict[str, Any]) -> dict[str, str]:
    """{member of the block: its name in C++}. Raises ShaderError where the struct has others."""
    found = re.search(rf"struct {struct}\n\{{\n(.*?)\}};", body, re.DOTALL)
    members = {m.rpartition("_")[0]: m for m in re.findall(r"(\w+);", found[1] if found else "")}
    if list(members) != [m["name"] for m in block["members"]]:
        text = f"{block['name']} has other members in C++ than in reflection.json"
        raise ShaderError(f"{text} (slangc, entry {name})")
    return members


def _usual(name: str, members: dict[str, str]) -> str:
    values = {f"constants.{members[constant]}": value for constant, value in USUAL.get(name, {}).items()}
    if not values:
        return ""
    same = " && ".join(f"{constant} == {value}" for constant, value in values.items())
    known = "".join(f"        {constant} = {value};\n" for constant, value in values.items())
    return f"    if ({same})\n    {{\n{known}        return {name}_loop(bound, first, rows);\n    }}\n"
