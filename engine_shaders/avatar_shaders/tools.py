"""The tools that turn HLSL into other languages: glslang, spirv-val, spirv-cross, and where Slang and Zig are found."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from avatar_shaders.entries import ENTRIES, HLSL_ONLY
from avatar_shaders.spirv import with_bindings

PACKAGES = {  # program: the Debian package that holds it
    "glslangValidator": "glslang-tools",
    "spirv-val": "spirv-tools",
    "spirv-cross": "spirv-cross",
}
WHEELS = {  # program: where it lies in which Python package, and how to install that
    "slangc": ("slangtorch/bin/slangc", "pip install --no-deps slangtorch==1.3.22"),
    "zig": ("ziglang/zig", "pip install ziglang==0.17.1"),
}
_STAGES = {"compute": "comp", "vertex": "vert", "fragment": "frag"}
# Not optimised (-Od): the generated text keeps functions and names, and every operation rounds as in the HLSL.
# The optimiser would make fma() of sums of products, which GLSL ES 3.10 does not have.
_GLSLANG = ("-D", "-V", "-Od", "--auto-map-bindings", "--auto-map-locations")
_GL = ("--combined-samplers-inherit-bindings", "--no-support-nonzero-baseinstance")
_CROSS = {  # language: options of spirv-cross
    "glsl430": ("--version", "430", "--no-es", *_GL),
    "glsl310es": ("--version", "310", "--es", *_GL),
    "glsl300es": ("--version", "300", "--es", *_GL),
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
        done = run([*command, "-o", str(module), str(file)])
        if done.returncode or not module.is_file():
            raise _refused("glslangValidator", entry, file, done.stdout)
        checked = run(["spirv-val", str(module)])
        if checked.returncode:
            raise _refused("spirv-val", entry, file, checked.stdout + checked.stderr)
        return with_bindings(module.read_bytes())


def cross(module: bytes, language: str, *, vertex: bool = False, options: tuple[str, ...] = ()) -> str:
    """A module as text of a language, or for "reflect" its interface as JSON. Raises ShaderError."""
    command = ["spirv-cross", "-", "--remove-unused-variables", *_CROSS[language], *options]
    done = run(command + [_CLIP_Z] * (vertex and language.startswith("glsl")), module)
    if done.returncode:
        raise ShaderError(f"{done.stderr.decode(errors='replace')} (spirv-cross to {language})")
    return done.stdout.decode()


def versions() -> dict[str, str]:
    """Versions of the tools that write what is generated. Raises ShaderError."""
    return {tool: version(tool) for tool in ("glslang", "spirv-cross", "slang", "zig")}


@cache
def version(tool: str) -> str:
    """The version of a tool of versions(). Raises ShaderError."""
    if tool == "spirv-cross":
        return _spirv_cross_version()
    if tool == "glslang":
        first = run(["glslangValidator", "--version"]).stdout.decode().splitlines()[0]
        return first.rpartition(" ")[2]
    output = run([program("slangc"), "-version"] if tool == "slang" else [program("zig"), "version"])
    return (output.stdout + output.stderr).decode().strip()


def _spirv_cross_version() -> str:
    """spirv-cross prints only its revision; Debian's package does not print even that."""
    output = run(["spirv-cross", "--revision"])
    revision = (output.stdout + output.stderr).decode().strip()
    if "Debian" in revision and shutil.which("dpkg-query"):
        return (
            run(["dpkg-query", "-W", "-f", "${Version}", "spirv-cross"]).stdout.decode().strip() or revision
        )
    return revision


def program(name: str) -> str:
    """Path of a tool that comes in a Python package: of this environment, else of PATH. Raises ShaderError."""
    inside, install = WHEELS[name]
    package, _, rest = inside.partition("/")
    spec = find_spec(package)
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        if (Path(folder) / rest).is_file():
            return str(Path(folder) / rest)
    path = shutil.which(name)
    if path is None:
        raise ShaderError(f"{name} is not installed; it comes with: {install}")
    return path


def run(command: list[str], data: bytes | None = None) -> subprocess.CompletedProcess[bytes]:
    """A finished process of a tool, whatever its exit status. Raises ShaderError where the tool is missing."""
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
