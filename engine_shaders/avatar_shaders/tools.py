"""The tools that turn HLSL into other languages: glslang, spirv-val, spirv-cross."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from avatar_shaders.entries import ENTRIES, HLSL_ONLY
from avatar_shaders.spirv import with_bindings

PACKAGES = {  # program: the Debian package that holds it
    "glslangValidator": "glslang-tools",
    "spirv-val": "spirv-tools",
    "spirv-cross": "spirv-cross",
}
_STAGES = {"compute": "comp", "vertex": "vert", "fragment": "frag"}
# Not optimised (-Od): the generated text keeps functions and names, and every operation rounds as in the HLSL.
# The optimiser would make fma() of sums of products, which GLSL ES 3.10 does not have.
_GLSLANG = ("-D", "-V", "-Od", "--auto-map-bindings", "--auto-map-locations")
_GL = ("--combined-samplers-inherit-bindings", "--no-support-nonzero-baseinstance")
_CROSS = {  # language: options of spirv-cross
    "glsl430": ("--version", "430", "--no-es", *_GL),
    "glsl310es": ("--version", "310", "--es", *_GL),
    "msl": ("--msl", "--msl-version", "20100", "--msl-decoration-binding"),
    "reflect": ("--reflect",),
}
_CLIP_Z = "--fixup-clipspace"  # HLSL writes clip z in 0..w, GL wants -w..w
_FAULT = re.compile(r"^(?:ERROR: )?(?P<file>[^:\n]+):(?P<line>\d+): (?P<text>.+)$", re.MULTILINE)


class ShaderError(Exception):
    """A shader that does not compile, or a missing tool. One line: where, what, which tool reports it."""

    def __init__(self, message: str, *, file: str | None = None, line: int | None = None):
        self.file, self.line = file, line
        super().__init__(" ".join(message.split()))


def spirv(folder: Path, entry: str, *, options: tuple[str, ...] = ()) -> bytes:
    """The validated SPIR-V of an entry whose HLSL lies in `folder`; `options` go to glslang.

    Raises ShaderError, which names the file and line of the first fault, also in an included file.
    """
    row = (ENTRIES | HLSL_ONLY)[entry]
    return compile_file(folder / row.hlsl, entry, row.kind, (f"-I{folder}", *options))


def compile_file(file: Path, entry: str, kind: str, options: tuple[str, ...] = ()) -> bytes:
    """The validated SPIR-V of an entry of any HLSL file. Raises ShaderError."""
    if not file.is_file():
        raise ShaderError(f"{file}: no such file (entry {entry})", file=file.name)
    with tempfile.TemporaryDirectory() as temporary:
        module = Path(temporary) / "module.spv"
        command = ["glslangValidator", *_GLSLANG, "-S", _STAGES[kind], "-e", entry, *options]
        done = _run([*command, "-o", str(module), str(file)])
        if done.returncode or not module.is_file():
            raise _refused("glslangValidator", entry, file, done.stdout)
        checked = _run(["spirv-val", str(module)])
        if checked.returncode:
            raise _refused("spirv-val", entry, file, checked.stdout + checked.stderr)
        return with_bindings(module.read_bytes())


def cross(module: bytes, language: str, *, vertex: bool = False, options: tuple[str, ...] = ()) -> str:
    """A module as text of a language, or for "reflect" its interface as JSON. Raises ShaderError."""
    command = ["spirv-cross", "-", "--remove-unused-variables", *_CROSS[language], *options]
    done = _run(command + [_CLIP_Z] * (vertex and language in ("glsl430", "glsl310es")), module)
    if done.returncode:
        raise ShaderError(f"{done.stderr.decode(errors='replace')} (spirv-cross to {language})")
    return done.stdout.decode()


@cache
def versions() -> dict[str, str]:
    """Versions of glslang and spirv-cross, the tools that write the generated text. Raises ShaderError."""
    glslang = _run(["glslangValidator", "--version"]).stdout.decode().splitlines()[0]
    return {"glslang": glslang.rpartition(" ")[2], "spirv-cross": _spirv_cross_version()}


def _spirv_cross_version() -> str:
    """spirv-cross tells its revision only; Debian's package does not even tell that."""
    told = _run(["spirv-cross", "--revision"])
    revision = (told.stdout + told.stderr).decode().strip()
    if "Debian" in revision and shutil.which("dpkg-query"):
        return (
            _run(["dpkg-query", "-W", "-f", "${Version}", "spirv-cross"]).stdout.decode().strip() or revision
        )
    return revision


def _run(command: list[str], data: bytes | None = None) -> subprocess.CompletedProcess[bytes]:
    try:
        return subprocess.run(command, input=data, capture_output=True)
    except FileNotFoundError:
        tool = command[0]
        raise ShaderError(f"{tool} is not installed; on Debian: apt-get install {PACKAGES[tool]}") from None


def _refused(tool: str, entry: str, file: Path, output: bytes) -> ShaderError:
    """The first fault that a tool names, as one line."""
    text = output.decode(errors="replace")
    found = _FAULT.search(text)
    if found:
        name, line = Path(found["file"]).name, int(found["line"])
        via = "" if name == file.name else f", included by {file.name}"
        return ShaderError(
            f"{name}:{line}: {found['text']} ({tool}, entry {entry}{via})", file=name, line=line
        )
    said = [line.strip() for line in text.splitlines() if line.strip() not in ("", str(file))]
    return ShaderError(
        f"{file.name}: {'; '.join(said) or 'no message'} ({tool}, entry {entry})", file=file.name
    )
