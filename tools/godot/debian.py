"""Packages of Debian's suite sid, without installing them: apt and dpkg-deb with a state of their own."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tarfile
from collections.abc import Sequence
from pathlib import Path

from tools.godot.installed import Missing

ELSE = "GODOT=/path/to/godot uses an engine that you have"
PROGRAMS = ("apt-get", "apt-config", "dpkg", "dpkg-deb")
KEYS = Path("/usr/share/keyrings")
# The machine's own settings of downloads (proxies, timeouts) go on; its hooks and sources do not.
CONFIG = """\
Dir::Etc::main "/dev/null";
Dir::Etc::parts "{folder}/parts";
Dir::Etc::sourcelist "{folder}/sid.sources";
Dir::Etc::sourceparts "-";
Dir::State "{folder}/state";
Dir::State::status "{folder}/status";
Dir::Cache "{folder}/cache";
APT::Sandbox::User "";
APT::Install-Recommends "false";
Acquire::Languages "none";
Acquire::Retries "3";
APT::Update::Error-Mode "any";
"""


def download(packages: Sequence[str], folder: Path) -> list[Path]:
    """The .deb files of packages and of all that they depend on, checked by apt. Raises Missing."""
    lacking = [name for name in PROGRAMS if shutil.which(name) is None]
    if lacking:
        raise Missing(f"{', '.join(lacking)} missing: the engine comes from Debian's packages; {ELSE}")
    found = mirrors()
    if not found:
        raise Missing(f"apt is configured with no mirror; {ELSE}")
    errors = []
    for mirror in found:
        configure(folder, mirror)
        error = asked(folder, "update")
        error = error or asked(folder, "install", "--yes", "--download-only", *packages)
        if not error:
            return sorted((folder / "cache" / "archives").glob("*.deb"))
        errors.append(error)
    raise Missing(
        f"apt got nothing of Debian's suite sid from {found[0]}: {errors[0]}; is there a net? {ELSE}"
    )


def mirrors() -> list[str]:
    """What apt is configured with, by whichever form of its files; what looks like a mirror of Debian comes first."""
    command = ["apt-get", "--print-uris", "update"]
    said = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    found = dict.fromkeys(re.findall(r"^'(.*?)/dists/(?!.*security)", said, re.MULTILINE))
    return sorted(found, key=lambda uri: "debian" not in uri)


def configure(folder: Path, mirror: str) -> None:
    """The state of an apt that knows one mirror and has nothing installed."""
    for name in ("parts", "state/lists/partial", "cache/archives/partial"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / "status").touch()
    keys = sorted(KEYS.glob("debian-archive-keyring.*"))
    signed = f"Signed-By: {keys[0]}\n" if keys else ""  # else apt's trusted keys
    source = f"Types: deb\nURIs: {mirror}\nSuites: sid\nComponents: main\n{signed}"
    (folder / "sid.sources").write_text(source)
    own = subprocess.run(["apt-config", "dump"], capture_output=True, text=True, check=True).stdout
    kept = [
        row
        for row in own.splitlines()
        if row.startswith(("Acquire::http", "Acquire::https", "Acquire::Check"))
    ]
    (folder / "apt.conf").write_text(CONFIG.format(folder=folder.resolve()) + "\n".join(kept) + "\n")


def asked(folder: Path, *command: str) -> str:
    """Runs apt-get; "" or the first error that it says."""
    done = subprocess.run(
        ["apt-get", "--quiet", *command],
        env={**os.environ, "APT_CONFIG": str(folder / "apt.conf"), "LC_ALL": "C"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode == 0:
        return ""
    errors = [row[2:].strip() for row in done.stderr.splitlines() if row.startswith("E:")]
    return errors[0] if errors else f"exit code {done.returncode}"


def triplet() -> str:
    """The folder of this machine's libraries: x86_64-linux-gnu."""
    asked_of = {"amd64": "x86_64", "arm64": "aarch64"}
    said = subprocess.run(["dpkg", "--print-architecture"], capture_output=True, text=True, check=True).stdout
    return f"{asked_of.get(said.strip(), said.strip())}-linux-gnu"


def version(files: Sequence[Path], package: str) -> str:
    """The version of a package among .deb files: NAME_VERSION_ARCHITECTURE.deb."""
    name = next(file.name for file in files if file.name.startswith(f"{package}_"))
    return name.split("_")[1].replace("%3a", ":")


def unpack(file: Path, root: Path, kept: Sequence[str], dropped: Sequence[str], but: Sequence[str]) -> None:
    """The files of a package whose path begins with one of `kept` and with none of `dropped`, or with one of `but`."""
    root.mkdir(parents=True, exist_ok=True)
    command = ["dpkg-deb", "--fsys-tarfile", str(file)]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE) as program,
        tarfile.open(fileobj=program.stdout, mode="r|") as archive,
    ):
        archive.extraction_filter = lambda member, _: (
            member
        )  # apt has checked it; older Pythons know no filter
        for member in archive:
            path = member.name.removeprefix("./")
            wanted = path.startswith(tuple(kept)) and not path.startswith(tuple(dropped))
            if (wanted or path.startswith(tuple(but))) and not member.linkname.startswith("/"):
                archive.extract(member, root, set_attrs=not member.isdir())
    if program.returncode:
        raise Missing(f"dpkg-deb cannot unpack {file.name}")
