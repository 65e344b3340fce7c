"""The built wheel, installed in a clean environment, runs the command line and reads its schema."""

from __future__ import annotations

import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = {"avatar_schema", "avatar_shaders", "avatar_runtime", "avatar_export", "avatar_trainer"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "-o", str(folder), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    return next(folder.glob("*.whl"))


def test_wheel_holds_exactly_our_packages(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == PACKAGES
    for needed in (
        "avatar_schema/v1/avatar.schema.json",
        "avatar_schema/v1/constants.json",
        "avatar_runtime/py.typed",
        "avatar_shaders/reflection.json",
        "avatar_shaders/hlsl/splat.hlsli",
    ):
        assert needed in names
    assert any(name.endswith("NOTICE.md") for name in names)


def test_wheel_runs_in_a_clean_environment(wheel: Path, tmp_path: Path) -> None:
    """The wheel alone is installed; its dependencies are lent by path, so that nothing of the checkout is seen."""
    venv.create(tmp_path / "env", with_pip=True)
    python = tmp_path / "env" / "bin" / "python"
    subprocess.run(
        [str(python), "-m", "pip", "install", "-q", "--no-deps", "--no-index", str(wheel)], check=True
    )
    site = next((tmp_path / "env" / "lib").glob("python3*")) / "site-packages"
    borrowed = [p for p in sys.path if p.endswith("site-packages")]
    (site / "borrowed.pth").write_text("".join(f"import sys; sys.path.append({p!r})\n" for p in borrowed))
    code = (
        "import avatar_schema, avatar_export; from avatar_schema import schema, constants;"
        "assert schema('avatar')['title'] and constants()['low_pass'] == 0.3; print(avatar_export.__file__)"
    )
    ran = subprocess.run([str(python), "-c", code], check=True, capture_output=True, text=True, cwd=tmp_path)
    assert str(site) in ran.stdout
    code = (
        "import avatar_shaders as s; print(all(s.source(e, l) for l in ('hlsl', *s.LANGUAGES) for e in s.ENTRIES),"
        "all(s.ENTRIES.keys() == s.reflection(l).keys() for l in s.LANGUAGES))"
    )
    shaders = subprocess.run(
        [str(python), "-c", code], check=True, capture_output=True, text=True, cwd=tmp_path
    )
    assert shaders.stdout.split() == ["True", "True"]
    command = tmp_path / "env" / "bin" / "avatar-export"
    listed = subprocess.run(
        [str(command), "systems"], check=True, capture_output=True, text=True, cwd=tmp_path
    )
    assert "gaussian_blendshapes" in listed.stdout
    refused = subprocess.run(
        [str(command), "inspect", "nothing-here"], capture_output=True, text=True, cwd=tmp_path
    )
    assert refused.returncode == 2
    assert refused.stderr.strip() == "avatar-export: nothing-here: no such file or folder"
