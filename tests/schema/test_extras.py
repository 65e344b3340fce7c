"""What a message about a missing library tells the user to type."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from avatar_schema import extras

ROOT = Path(__file__).parents[2]
FLOORS = ("schema", "engine_shaders", "runtime", "exporter", "trainer")
OTHERS = {
    "gsplat",
    "lpips",
    "{LPIPS}",
    "{cluster.DASHBOARD}",
    "--no-deps",
    "ziglang==0.17.1",
}  # nobody's extra
METADATA = {
    "avatar-export": ['numba>=0.61; python_version < "3.15"', 'avatar-export-runtime[gl]==0.1.0; extra == "gl"',
                      "avatar-export[gl,fbx]; extra == 'all'", 'ufbx<1,>=0.0.5; extra == "fbx"'],
    "avatar-export-runtime": ["numpy>=1.26", 'moderngl>=5.12; extra == "gl"'],
}  # fmt: skip


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        ("gl", 'pip install "moderngl>=5.12"'),
        ("fbx", 'pip install "ufbx<1,>=0.0.5"'),
        ("all", 'pip install "moderngl>=5.12" "ufbx<1,>=0.0.5"'),
    ],
)
def test_an_installed_package_names_the_libraries(
    extra: str, said: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """And never a name of ours, which an index may give to somebody else."""
    monkeypatch.setattr(extras, "CHECKOUT", tmp_path)
    monkeypatch.setattr(extras, "requires", METADATA.__getitem__)
    assert extras.how_to_install(extra) == said


def test_no_message_asks_an_index_for_a_name_of_ours() -> None:
    for folder in FLOORS:
        for path in (ROOT / folder).rglob("*.py"):
            if path.name != "extras.py":
                asked = re.findall(r"pip install ([^\s\"'`]+)", path.read_text("utf-8"))
                assert set(asked) <= OTHERS, path
