"""What `tools.godot.fetch` says where it gets nothing, and where the engine is there already."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tools.godot import VERSION, debian

APT = """'http://a.example/tool/dists/stable/InRelease' a 0
'http://a.example/debian-security/dists/bookworm-security/InRelease' b 0
'{}/dists/trixie/InRelease' c 0
'{}/dists/trixie/main/binary-amd64/Packages.xz' d 0"""


def said(**environment: str) -> tuple[int, str]:
    """Exit code and the one line of the command."""
    done = subprocess.run(
        [sys.executable, "-m", "tools.godot.fetch"],
        env={**{k: v for k, v in os.environ.items() if k != "GODOT"}, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    (line,) = (done.stdout + done.stderr).splitlines()
    return done.returncode, line


@pytest.mark.parametrize(
    ("unpacked", "told"), [(VERSION, ""), ("4.7", f" (this checkout is tested with {VERSION})")]
)
def test_an_engine_that_is_there_needs_no_net(tmp_path: Path, unpacked: str, told: str) -> None:
    stamp = {"wanted": VERSION, "godot": f"{unpacked}+ds-1", "mesa-vulkan-drivers": "26"}
    (tmp_path / "root").mkdir()
    (tmp_path / "root" / "versions.json").write_text(json.dumps(stamp))
    found = said(AVATAR_GODOT_DIR=str(tmp_path), PATH="")
    assert found == (0, f"Godot {unpacked}+ds-1{told}, Mesa 26: {tmp_path}")


def test_without_apt_it_says_what_is_missing(tmp_path: Path) -> None:
    code, line = said(AVATAR_GODOT_DIR=str(tmp_path), PATH=str(tmp_path))
    assert code == 2 and line.startswith("Godot was not run: apt-get, apt-config, dpkg, dpkg-deb missing")
    assert line.endswith("GODOT=/path/to/godot uses an engine that you have") and not [*tmp_path.iterdir()]


def test_another_engine_must_be_a_program(tmp_path: Path) -> None:
    assert said(GODOT=str(tmp_path)) == (2, f"Godot was not run: GODOT={tmp_path} is no program")
    assert said(GODOT=sys.executable) == (0, f"Godot: {sys.executable}, which GODOT names")


@pytest.mark.more
@pytest.mark.skipif(not shutil.which("apt-get"), reason="apt is missing")
def test_without_a_net_it_says_so(tmp_path: Path) -> None:
    code, line = said(
        AVATAR_GODOT_DIR=str(tmp_path), http_proxy="http://127.0.0.1:9", https_proxy="http://127.0.0.1:9"
    )
    assert code == 2 and "; is there a net? GODOT=" in line and not [*tmp_path.iterdir()]


@pytest.mark.parametrize(
    "mirror", ["https://mirror.example/debian", "mirror+file:/etc/apt/mirrors/debian.list"]
)
def test_the_mirror_of_debian_is_asked_first(
    mirror: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    apt = tmp_path / "apt-get"
    apt.write_text(f"#!/bin/sh\ncat <<'END'\n{APT.format(mirror, mirror)}\nEND\n")
    apt.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    assert debian.mirrors() == [mirror, "http://a.example/tool"]
