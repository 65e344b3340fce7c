"""What goes wrong names the file, the line of the include, and the tool."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from avatar_shaders.generate import HLSL, generate
from avatar_shaders.slang import slang
from avatar_shaders.tools import PACKAGES, ShaderError


@pytest.fixture
def altered(tmp_path: Path) -> Path:
    return Path(shutil.copytree(HLSL, tmp_path / "hlsl"))


def line_of(path: Path, text: str) -> int:
    return path.read_text("utf-8").splitlines().index(text) + 1


def test_a_fault_in_an_include_names_its_line(altered: Path) -> None:
    core = altered / "splat.hlsli"
    good, bad = "    return AVATAR_SH_C0_0 * k0;", "    return AVATAR_SH_C0_0 * nowhere;"
    core.write_text(core.read_text("utf-8").replace(good, bad), "utf-8")
    with pytest.raises(ShaderError, match="'nowhere'") as caught:
        generate(altered, ["project"])
    line = line_of(core, bad)
    assert (caught.value.file, caught.value.line) == ("splat.hlsli", line)
    message = str(caught.value)
    assert message.startswith(f"splat.hlsli:{line}: ") and "\n" not in message and "project.hlsl" in message


def test_constants_that_direct3d_packs_in_another_way_are_refused(altered: Path) -> None:
    """A float3 after a uint begins at 4 in a cbuffer and at 16 in std140: one block of bytes could not serve both."""
    path = altered / "activate.hlsl"
    text = path.read_text("utf-8")
    assert "    uint count;" in text
    path.write_text(text.replace("    uint count;", "    uint count; float3 tight;"), "utf-8")
    with pytest.raises(ShaderError, match=r"activate\.hlsl: .*cannot be expressed"):
        generate(altered, ["activate"], ["glsl430"])


@pytest.mark.parametrize("tool", PACKAGES)
def test_a_missing_tool_says_what_to_install(
    tool: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for other in PACKAGES.keys() - {tool}:
        found = shutil.which(other)
        assert found
        (tmp_path / other).symlink_to(found)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ShaderError, match=f"{tool} is not installed.*{PACKAGES[tool]}"):
        generate(HLSL, ["activate"])


def test_what_slang_refuses_names_its_line(altered: Path) -> None:
    path = altered / "activate.hlsl"
    bad = "    uint row = id.x + Nowhere<uint>(1);"
    path.write_text(path.read_text("utf-8").replace("    uint row = id.x;", bad), "utf-8")
    with pytest.raises(ShaderError, match=rf"^activate\.hlsl:{line_of(path, bad)}: .*slangc, entry activate"):
        slang(altered, "activate", "wgsl")
