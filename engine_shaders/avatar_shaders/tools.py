"""The tools that turn HLSL into other languages: glslang, spirv-val, spirv-cross."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from avatar_shaders import ENTRIES
from avatar_shaders.spirv import with_bindings

PACKAGES = {  # program: the Debian package that holds it
    "glslangValidator": "glslang-tools",
    "spirv-val": "spirv-tools",
    "spirv-cross": "spirv-cross",
}
_STAGES = {"compute": "comp", "vertex": "vert", "fragment": "frag"}
_GL = ("--combined-samplers-inherit-bindings", "--no-support-nonzero-baseinstance")
_CROSS = {  # language: options of spirv-cross
    "glsl430": ("--version", "430", "--no-es", *_GL),
    "glsl310es": ("--version", "310", "--es", *_GL),
    "msl": ("--msl", "--msl-version", "20100", "--msl-decoration-binding"),
    "reflect": ("--reflect",),
}
_CLIP_Z = "--fixup-clipspace"  # HLSL writes clip z in 0..w, GL wants -w..w
_ERROR = re.compile(r"^(?:ERROR: )?(?P<file>[^:\n]+):(?P<line>\d+): (?P<text>.+)$", re.MULTILINE)


class ShaderError(Exception):
    """A shader that does not compile, or a tool that is not there. One line: where, which tool, what it says."""

    def __init__(self, message: str, *, file: str | None = None, line: int | None = None):
        self.file, self.line = file, line
        super().__init__(" ".join(message.split()))


def spirv(folder: Path, entry: str, *, options: tuple[str, ...] = ()) -> bytes:
    """The validated SPIR-V of an entry whose HLSL lies in `folder`.

    Raises ShaderError, which names the file and line of the first fault, be it in an include.
    """
    row = ENTRIES[entry]
    source = folder / row.hlsl
    if not source.is_file():
        raise ShaderError(f"{source}: no such file (entry {entry})", file=row.hlsl)
    with tempfile.TemporaryDirectory() as temporary:
        module = Path(temporary) / "module.spv"
        # Not optimised (-Od): the text that comes out keeps functions and names, and no rounding step is lost
        # to a fused or factored expression.
        command = ["glslangValidator", "-D", "-V", "-Od", "--auto-map-bindings", "--auto-map-locations"]
        command += ["-S", _STAGES[row.kind], "-e", entry, f"-I{folder}", "-o", str(module), *options]
        done = _run([*command, str(source)])
        if done.returncode or not module.is_file():
            raise _refused("glslangValidator", entry, folder, done.stdout.decode(errors="replace"))
        checked = _run(["spirv-val", str(module)])
        if checked.returncode:
            raise _refused("spirv-val", entry, folder, checked.stderr.decode(errors="replace"))
        return with_bindings(module.read_bytes())


def cross(module: bytes, entry: str, language: str) -> str:
    """A SPIR-V module of an entry as text of a language, or for "reflect" its interface as JSON."""
    options = ["--remove-unused-variables", *_CROSS[language]]
    if ENTRIES[entry].kind == "vertex" and language.startswith("glsl"):
        options.append(_CLIP_Z)
    done = _run(["spirv-cross", "-", *options], module)
    if done.returncode:
        raise _refused("spirv-cross", entry, None, done.stderr.decode(errors="replace"))
    return done.stdout.decode()


@cache
def versions() -> dict[str, str]:
    """What wrote the generated text: the versions of glslang and spirv-cross."""
    glslang = _run(["glslangValidator", "--version"]).stdout.decode().splitlines()[0]
    return {"glslang": glslang.rpartition(" ")[2], "spirv-cross": _spirv_cross_version()}


def _spirv_cross_version() -> str:
    """spirv-cross knows its revision only, and as packaged by Debian not even that."""
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
        package = PACKAGES.get(command[0], command[0])
        raise ShaderError(
            f"{command[0]} is not installed; on Debian: apt-get install {package}", file=None
        ) from None


def _refused(tool: str, entry: str, folder: Path | None, text: str) -> ShaderError:
    """The first fault of a tool's output as one line."""
    source = ENTRIES[entry].hlsl
    found = _ERROR.search(text)
    if found:
        file = Path(found["file"])
        name = str(file.relative_to(folder)) if folder and file.is_relative_to(folder) else file.name
        where, line, message = name, int(found["line"]), found["text"]
        via = "" if name == source else f", included by {source}"
        return ShaderError(f"{where}:{line}: {message} ({tool}, entry {entry}{via})", file=where, line=line)
    said = [part.strip() for part in text.splitlines() if part.strip() and not part.strip().endswith(source)]
    return ShaderError(f"{source}: {'; '.join(said) or 'no message'} ({tool}, entry {entry})", file=source)
