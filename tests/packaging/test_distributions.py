"""What `make dist` makes, what a checkout installs as, and the one version of both."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from dataclasses import replace
from email import message_from_bytes
from pathlib import Path

import pytest

import avatar_export
from tests.released import DATA
from tools import dist

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PACKAGES = {
    Path(folder).name: ROOT / folder
    for row in PROJECT["tool"]["distributions"].values()
    for folder in row["packages"]
}
EDITABLE = "import sys, hatchling.build; print(hatchling.build.build_editable(sys.argv[1]))"


def test_both_carry_the_one_version(built: dict[str, list[Path]]) -> None:
    files = sorted(file.name for pair in built.values() for file in pair)
    assert files == [
        f"avatar_{name}-{dist.version()}{end}"
        for name in ("export", "export_runtime")
        for end in ("-py3-none-any.whl", ".tar.gz")
    ]
    assert f"avatar-export-runtime=={dist.version()}" in dist.distributions()["avatar-export"].dependencies


def test_the_version_stands_in_one_place() -> None:
    assert avatar_export.__version__ == dist.version()
    assert "version" not in PROJECT["project"]
    literal = re.compile(rf"(?<![\d.]){re.escape(dist.version())}(?![\d.])")
    files = [path for folder in PACKAGES.values() for path in sorted(folder.rglob("*.py"))]
    where = [path.name for path in files if literal.search(path.read_text("utf-8"))]
    assert where == ["version.py"]
    for line in (ROOT / "pyproject.toml").read_text("utf-8").splitlines():
        assert "avatar" not in line or not literal.search(line), line
    citation = ROOT / "CITATION.cff"
    if citation.exists():
        assert f"\nversion: {dist.version()}\n" in citation.read_text("utf-8")


def test_bundles_name_their_writer_as_ever() -> None:
    assert f"avatar-export {dist.version()}" == avatar_export.GENERATOR
    with zipfile.ZipFile(DATA / "0.1.0" / "lam.avatar.zip") as archive:
        assert b'"generator": "avatar-export 0.1.0"' in archive.read("avatar.json")


def test_the_same_checkout_gives_the_same_bytes(built: dict[str, list[Path]], tmp_path: Path) -> None:
    """Of sdists; that an sdist builds the same wheel, `dist.make` has seen."""
    given = dist.distributions()["avatar-export-runtime"]
    [again] = dist.build(dist.assemble(given, tmp_path), tmp_path, "sdist")
    assert again.read_bytes() == built[given.name][0].read_bytes()


def test_each_package_is_in_one_distribution(wheels: dict[str, Path]) -> None:
    tops: dict[str, list[str]] = {}
    for name, wheel in wheels.items():
        with zipfile.ZipFile(wheel) as archive:
            for top in {entry.partition("/")[0] for entry in archive.namelist()}:
                tops.setdefault(top, []).append(name)
    assert {top for top in tops if not top.endswith(".dist-info")} == PACKAGES.keys()
    assert all(len(owners) == 1 for owners in tops.values())


@pytest.mark.parametrize("fault", ["more", "less", "address"])
def test_the_check_sees_faults(
    fault: str, built: dict[str, list[Path]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file too many, a file too few, metadata that an index refuses."""
    given = dist.distributions()["avatar-export-runtime"]
    files = dist.sources(given)
    if fault == "more":
        monkeypatch.setattr(dist, "sources", lambda _: dict(list(files.items())[1:]))
    elif fault == "less":
        monkeypatch.setattr(dist, "sources", lambda _: files | {"avatar_runtime/new.py": Path("new.py")})
    else:
        given = replace(given, dependencies=("numpy @ file:///numpy", "jsonschema"))
    with pytest.raises(
        dist.DistError, match={"more": "holds also", "less": "lacks", "address": "depends on"}[fault]
    ):
        dist.check(given, *built["avatar-export-runtime"])


def test_a_stray_file_in_a_package_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dist, "checkout", lambda: {"some_package/notes.txt": tmp_path})
    given = replace(dist_row(), packages=("some_package",))
    with pytest.raises(dist.DistError, match=r"some_package/notes.txt: not a file of a package"):
        dist.sources(given)


def dist_row() -> dist.Distribution:
    return dist.Distribution("a", "1", "", "", (), (), {}, {}, {})


def test_a_checkout_installs_as_one(tmp_path: Path) -> None:
    """`pip install .`: all five packages, every dependency, no distribution that an index would be asked for."""
    wheel = root_wheel(tmp_path)
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
        info = message_from_bytes(archive.read(f"avatar_export-{dist.version()}.dist-info/METADATA"))
    assert held == {name for given in dist.distributions().values() for name in dist.sources(given)}
    for folder in PACKAGES.values():
        assert {path.relative_to(folder.parent).as_posix() for path in folder.rglob("*.py")} <= held
    base = {line for line in info.get_all("Requires-Dist", []) if "extra ==" not in line}
    split = {line for given in dist.distributions().values() for line in given.dependencies}
    assert base == {line for line in split if not line.startswith("avatar-export-runtime")}
    assert "Private :: Do Not Upload" in info.get_all("Classifier", [])


def root_wheel(out: Path) -> Path:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(out)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return next(out.glob("*.whl"))


def test_an_editable_install_sees_every_source_root(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", EDITABLE, tmp_path], cwd=ROOT, check=True, capture_output=True
    )
    with zipfile.ZipFile(tmp_path / done.stdout.decode().split()[-1]) as archive:
        [path_file] = [name for name in archive.namelist() if name.endswith(".pth")]
        roots = archive.read(path_file).decode().split()
    assert {Path(root).resolve() for root in roots} == {folder.parent for folder in PACKAGES.values()}
