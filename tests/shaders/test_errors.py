"""What goes wrong names the file, the line of the include, and the tool."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from avatar_shaders import ENTRIES, tools
from avatar_shaders.generate import HLSL, generate, generate_all
from avatar_shaders.reflect import interface
from avatar_shaders.slang import slang, wgsl
from avatar_shaders.tools import PACKAGES, WHEELS, ShaderError, cross, program, spirv


@pytest.fixture
def altered(tmp_path: Path) -> Path:
    """A copy of the HLSL that a test may break."""
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
    assert message.startswith(f"splat.hlsli:{line}: ") and "\n" not in message
    assert "glslangValidator, entry project, included by project.hlsl" in message


def test_a_fault_in_the_file_itself_names_its_line(altered: Path) -> None:
    path = altered / "activate.hlsl"
    bad = "    uint row = id.x + nowhere;"
    path.write_text(path.read_text("utf-8").replace("    uint row = id.x;", bad), "utf-8")
    with pytest.raises(ShaderError) as caught:
        generate(altered, ["activate"])
    assert str(caught.value).startswith(f"activate.hlsl:{line_of(path, bad)}: ")
    assert "included by" not in str(caught.value)


def test_a_missing_include_and_a_missing_entry_are_named(altered: Path) -> None:
    (altered / "skin.hlsli").unlink()
    with pytest.raises(ShaderError, match=r"skin\.hlsl:5: .*skin\.hlsli"):
        generate(altered, ["skin"])
    text = (altered / "activate.hlsl").read_text("utf-8")
    (altered / "activate.hlsl").write_text(text.replace("void activate(", "void other("), "utf-8")
    with pytest.raises(ShaderError, match=r"activate\.hlsl: .*Entry point not found.*entry activate"):
        generate(altered, ["activate"])
    (altered / "morph.hlsl").unlink()
    with pytest.raises(ShaderError, match=r"morph\.hlsl: no such file"):
        generate_all(altered)


def test_constants_that_direct3d_packs_in_another_way_are_refused(altered: Path) -> None:
    """A float3 after a uint begins at 4 in a cbuffer and at 16 in std140: one block of bytes could not serve both."""
    path = altered / "activate.hlsl"
    text = path.read_text("utf-8")
    assert "    uint count;" in text
    path.write_text(text.replace("    uint count;", "    uint count; float3 tight;"), "utf-8")
    with pytest.raises(
        ShaderError, match=r"activate\.hlsl: .*cannot be expressed.*spirv-cross.*entry activate"
    ):
        generate(altered, ["activate"], ["glsl310es"])


@pytest.mark.parametrize("tool", PACKAGES)
def test_a_missing_tool_says_what_to_install(
    tool: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for other in PACKAGES.keys() - {tool}:
        found = shutil.which(other)
        assert found
        (tmp_path / other).symlink_to(found)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(
        ShaderError, match=f"{tool} is not installed; on Debian: apt-get install {PACKAGES[tool]}"
    ):
        generate(HLSL, ["activate"])


@pytest.mark.parametrize("tool", WHEELS)
def test_a_missing_tool_of_a_python_package_says_what_to_install(
    tool: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tools, "find_spec", lambda name: None)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(ShaderError, match=rf"^{tool} is not installed; it comes with: pip install .*=="):
        program(tool)


def test_tools_are_found_in_this_environment_before_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "ziglang"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "zig").touch()
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "ziglang", raising=False)
    assert program("zig") == str(package / "zig")


def test_what_slang_refuses_names_its_line(altered: Path) -> None:
    path = altered / "activate.hlsl"
    bad = "    uint row = id.x + Nowhere<uint>(1);"
    path.write_text(path.read_text("utf-8").replace("    uint row = id.x;", bad), "utf-8")
    with pytest.raises(ShaderError, match=rf"^activate\.hlsl:{line_of(path, bad)}: .*slangc, entry activate"):
        slang(altered, "activate", "wgsl")


def test_constants_that_wgsl_places_elsewhere_are_refused(altered: Path) -> None:
    row = interface("activate", ENTRIES["activate"], cross(spirv(altered, "activate"), "reflect"), "")
    path = altered / "activate.hlsl"
    for good, bad, said in (
        ("    uint count;", "    uint other; uint count;", "ActivateConstants.count lies elsewhere"),
        ("[5 count]", "", "WGSL binds .*; reflection.json has Splats"),
    ):
        text = path.read_text("utf-8").replace(good, bad)
        if not bad:
            text = text.replace("Splats", "Others")
        path.write_text(text, "utf-8")
        with pytest.raises(ShaderError, match=said):
            wgsl(altered, "activate", row)


def test_the_command_says_it_in_one_line(altered: Path, tmp_path: Path) -> None:
    (altered / "activate.hlsl").write_text("void nothing() { x; }\n", "utf-8")
    command = [sys.executable, "-m", "avatar_shaders", "--hlsl", str(altered), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("avatar_shaders: activate.hlsl:1: ") and done.stderr.count("\n") == 1
