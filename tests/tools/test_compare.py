"""What fell is named: over a repository whose bench prints what a file says."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from bench.compare import __main__ as compare

BENCH = """
import sys
from pathlib import Path
assert ("--no-save" in sys.argv) == Path("new").exists()
print(Path(__file__).with_name("said.txt").read_text())
"""
BEFORE = "a_wall 100 ms\nb_cpu 10 s\nc 60 dB\nd 5 MB\ne 3 1\nf 30 frames/s\ngone 1 s\n/some/where.csv\n"
SAME = "a_wall 109 ms\nb_cpu 9 s\nc 55 dB\nd 5.4 MB\ne 9 1\nf 28 frames/s\nnew 1 s\n"
WORSE = "a_wall 111 ms\nb_cpu 12 s\nc 50 dB\nd 6 MB\ne 9 1\nf 20 frames/s\n"


def git(repository: Path, *words: str) -> None:
    who = ("-c", "user.name=a", "-c", "user.email=a@b.c")
    subprocess.run(["git", *who, *words], cwd=repository, check=True, capture_output=True)


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One commit, whose bench says BEFORE."""
    made = tmp_path / "repository"
    (made / "bench").mkdir(parents=True)
    (made / "bench" / "__init__.py").touch()
    (made / "bench" / "__main__.py").write_text(BENCH)
    (made / "bench" / "said.txt").write_text(BEFORE)
    git(made, "init", "-q")
    git(made, "add", ".")
    git(made, "commit", "-qm", "one")
    monkeypatch.setattr(compare, "ROOT", made)
    return made


def run(repository: Path, said: str, *words: str, monkeypatch: pytest.MonkeyPatch) -> object:
    """The exit code of a comparison with a newer state whose bench says `said`."""
    (repository / "new").touch()
    (repository / "bench" / "said.txt").write_text(said)
    monkeypatch.setattr("sys.argv", ["compare", "--only", "backends", "packs", "--rounds", "2", *words])
    with pytest.raises(SystemExit) as stopped:
        compare.main()
    kept = subprocess.run(
        ["git", "worktree", "list"], cwd=repository, capture_output=True, text=True, check=True
    )
    assert kept.stdout.count("\n") == 1, "the checkout is gone"
    return stopped.value.code


def test_what_fell_by_more_than_a_tenth_is_named(
    repository: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    git(repository, "tag", "v1")
    assert run(repository, SAME, monkeypatch=monkeypatch) == 0
    assert capsys.readouterr().out == "0 of 5 rows fell by more than a tenth; in one checkout alone: 2\n"
    assert run(repository, WORSE, "--against", "HEAD", monkeypatch=monkeypatch) == 1
    assert capsys.readouterr().out.splitlines() == [
        "f: 20 frames/s where it was 30, 33% worse",
        "b_cpu: 12 s where it was 10, 20% worse",
        "d: 6 MB where it was 5, 20% worse",
        "c: 50 dB where it was 60, 17% worse",
        "a_wall: 111 ms where it was 100, 11% worse",
        "5 of 5 rows fell by more than a tenth; in one checkout alone: 1",
    ]


def test_what_cannot_be_compared_is_one_line(
    repository: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(repository, SAME, monkeypatch=monkeypatch) == 2
    assert (
        capsys.readouterr().err
        == "no release is tagged here; name what to compare with: --against REVISION\n"
    )
    assert run(repository, SAME, "--against", "nothing", monkeypatch=monkeypatch) == 2
    said = capsys.readouterr().err
    assert said.startswith("nothing cannot be checked out: ") and said.count("\n") == 1


def test_the_best_round_counts() -> None:
    rounds = {"a": [(3.0, "ms"), (2.0, "ms")], "b": [(50.0, "dB"), (51.0, "dB")], "c": [(1.0, "1")]}
    assert compare.best(rounds) == {"a": (2.0, "ms"), "b": (51.0, "dB")}
