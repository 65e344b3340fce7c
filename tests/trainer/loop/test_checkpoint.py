"""Checkpoints: what goes in comes out, and a file that is not whole is never taken for one."""

from __future__ import annotations

import hashlib
import json
import math
import os
from pathlib import Path
from typing import Any

import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.loop import checkpoint
from tests.trainer.tensors import same

HEAD = 16  # magic and length


def state() -> dict[str, Any]:
    generator = torch.Generator().manual_seed(3)
    return {
        "values": torch.randn(7, 3, generator=generator),
        "wide": torch.arange(5),
        "scalar": torch.tensor(2.5, dtype=torch.float64),
        "flags": torch.tensor([True, False, True]),
        "none": torch.zeros(0, 4),
        "strided": torch.arange(12.0).reshape(3, 4).T,
        "generator": generator.get_state(),
        "tree": {"a": [1, 2.5, None, True, "text", {"tensor": "0"}], "infinite": math.inf, "1/3": 1 / 3},
    }


def test_what_goes_in_comes_out(tmp_path: Path) -> None:
    path = checkpoint.write(tmp_path, 500, state())
    assert path.name == "iteration_000500.ckpt"
    found = checkpoint.read(path)
    assert found.iteration == 500 and same(found.state, state())
    found.state["values"] += 1  # its own memory


def test_the_last_two_are_kept(tmp_path: Path) -> None:
    for iteration in (999_999, 5, 1_000_000, 70, 1_000_001):
        checkpoint.write(tmp_path, iteration, {})
    assert [p.name for p in checkpoint.paths(tmp_path)] == [
        "iteration_1000000.ckpt",
        "iteration_1000001.ckpt",
    ]
    assert checkpoint.newest(tmp_path, pytest.fail).iteration == 1_000_001


def test_any_cut_and_any_changed_byte_is_seen(tmp_path: Path) -> None:
    path = checkpoint.write(tmp_path, 1, {"x": torch.arange(6.0), "y": 3})
    whole = path.read_bytes()
    for length in range(len(whole)):
        path.write_bytes(whole[:length])
        with pytest.raises(AvatarError):
            checkpoint.read(path)
    for at in range(len(whole)):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
        with pytest.raises(AvatarError):
            checkpoint.read(path)
    path.write_bytes(whole + b"\0")
    with pytest.raises(AvatarError):
        checkpoint.read(path)


def test_the_one_before_is_taken_with_a_note(tmp_path: Path) -> None:
    for iteration in (1, 2):
        newest = checkpoint.write(tmp_path, iteration, {"x": torch.ones(1)})
    newest.write_bytes(newest.read_bytes()[:-40])
    notes: list[str] = []
    found = checkpoint.newest(tmp_path, notes.append)
    assert found is not None and found.iteration == 1
    assert len(notes) == 1 and "iteration_000002.ckpt" in notes[0] and "is cut" in notes[0]
    checkpoint.path_of(tmp_path, 1).write_bytes(b"junk")
    with pytest.raises(AvatarError, match="every checkpoint here is damaged; --no-resume"):
        checkpoint.newest(tmp_path, notes.append)


def test_a_write_that_fails_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = [checkpoint.write(tmp_path, i, state()).read_bytes() for i in (1, 2)]

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        checkpoint.write(tmp_path, 3, state())
    with pytest.raises(TypeError, match="cannot hold a object"):
        checkpoint.write(tmp_path, 3, {"x": object()})
    assert sorted(p.name for p in tmp_path.iterdir()) == ["iteration_000001.ckpt", "iteration_000002.ckpt"]
    assert [p.read_bytes() for p in checkpoint.paths(tmp_path)] == kept


def test_a_file_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []
    fsync, replace = os.fsync, Path.replace

    def synced(descriptor: int) -> None:
        calls.append("folder" if os.path.isdir(f"/proc/self/fd/{descriptor}") else "file")
        fsync(descriptor)

    def renamed(path: Path, target: Path) -> Path:
        assert checkpoint.partials(tmp_path) == [path]
        calls.append("rename")
        return replace(path, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(Path, "replace", renamed)
    checkpoint.write(tmp_path, 1, {})
    assert calls == ["file", "rename", "folder"]
    assert checkpoint.partials(tmp_path) == []


def test_keys_are_texts(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="not all texts"):
        checkpoint.write(tmp_path, 1, {"x": {1: 2}})


def sealed(path: Path, tree: object, tensors: bytes = (2).to_bytes(8, "little") + b"{}") -> Path:
    """A file whose lengths and SHA-256 are right, whatever it says."""
    text = tree if isinstance(tree, bytes) else json.dumps(tree).encode()
    body = len(text).to_bytes(8, "little") + text + tensors
    path.write_bytes(b"AVTRAIN1" + len(body).to_bytes(8, "little") + body + hashlib.sha256(body).digest())
    return path


NOTHING = {"dict": {}}
WRONG: list[Any] = [
    [],
    3,
    None,
    b"not JSON",
    b"[" * 100_000,
    {"dict": {"iteration": 1}},
    {"dict": {"iteration": "1", "state": NOTHING}},
    {"dict": {"iteration": 1, "state": {"dict": {"x": [1]}}}},
    {"dict": {"iteration": 1, "state": {"dict": {"x": {"tensor": "0", "bool": False}}}}},
    {"dict": {"iteration": 1, "state": {"dict": {"x": {"other": 1}}}}},
]


@pytest.mark.parametrize("tree", WRONG, ids=[str(i) for i in range(len(WRONG))])
def test_a_sealed_file_with_another_tree_is_bad_data(tmp_path: Path, tree: object) -> None:
    with pytest.raises(AvatarError, match=r"iteration_000001\.ckpt"):
        checkpoint.read(sealed(checkpoint.path_of(tmp_path, 1), tree))


def test_sizes_are_checked_before_memory_is_asked_for(tmp_path: Path) -> None:
    good = {"dict": {"iteration": 1, "state": NOTHING}}
    path = sealed(checkpoint.path_of(tmp_path, 1), good)
    assert checkpoint.read(path).state == {}
    huge = (1 << 62).to_bytes(8, "little")
    path.write_bytes(b"AVTRAIN1" + huge + path.read_bytes()[HEAD:])
    with pytest.raises(AvatarError, match="is cut"):
        checkpoint.read(path)
    header = json.dumps({"0": {"dtype": "F32", "shape": [1 << 40], "data_offsets": [0, 1 << 42]}}).encode()
    for tensors in (huge, len(header).to_bytes(8, "little") + header):
        with pytest.raises(AvatarError):
            checkpoint.read(sealed(path, good, tensors))


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    path = checkpoint.path_of(tmp_path, 1)
    os.mkfifo(path)
    with pytest.raises(AvatarError, match="not a regular file"):
        checkpoint.read(path)
