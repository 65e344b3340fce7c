"""The native player with files that nobody should trust, with sanitizers, and with memory that runs out."""

from __future__ import annotations

import json
import re
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from random import Random

import numpy as np
import pytest

from tests.players.hostile.packs import HOSTILE, changed
from tests.players.native import ask
from tests.players.native.machines import Machine
from tests.session.native import NATIVE


def test_changed_programs_have_the_verdict_of_python(
    machine: Machine, unity_cases: Path, tmp_path: Path
) -> None:
    text = (unity_cases / "programs.json").read_text()
    (tmp_path / "programs.json").write_text(re.sub("10{400}", '"Infinity"', text))
    (found,) = ask("programs", [tmp_path], tmp_path, machine)
    told = json.loads(text)["programs"]
    planted = 0
    for index, one in enumerate(told):
        field = found[f"{index}/field"].decode() or None
        reason = found[f"{index}/reason"].decode()
        assert field == one["field"], (index, reason)
        if one["message"]:
            planted += 1
            assert one["message"] in reason.replace("is false", "is False").replace("is true", "is True")
    assert len(told) > 800 and planted > 40 and sum(one["field"] is None for one in told) > 50


def test_hostile_packs_are_refused_by_name(machine: Machine, unity_cases: Path, tmp_path: Path) -> None:
    hostile = unity_cases / "hostile"
    told, sound = (json.loads((hostile / f"{name}.json").read_text()) for name in ("hostile", "sound"))
    _write_stream(
        [(hostile / name).read_bytes() for name in [*(one["file"] for one in told), *sound]], tmp_path
    )
    (found,) = ask("refusals", [tmp_path], tmp_path, machine)
    lines = [line.decode("utf-8", "replace") for line in found.values()]
    for one, line in zip(told, lines, strict=False):
        message = one["message"].replace("com.avatar-export.player", "the player")
        assert line.startswith("a.avatar: ") and message in line, (one["what"], line)
        assert one.get("field") is None or f": {one['field']}: " in line, (one["what"], line)
    assert lines[len(told) :] == [""] * len(sound)


@pytest.mark.hypothesis
def test_mutated_packs_are_refused_or_can_be_played(
    machine: Machine, unity_cases: Path, tmp_path: Path
) -> None:
    (tmp_path / "files.bin").symlink_to((unity_cases / "mutated.bin").resolve())
    (found,) = ask("refusals", [tmp_path], tmp_path, machine)
    lines = [line.decode("utf-8", "replace") for line in found.values()]
    assert all("\n" not in line and len(line) < 500 for line in lines)
    loaded = lines.count("")
    print(f"mutated packs: {loaded} loaded, {len(lines) - loaded} refused")
    assert loaded > len(lines) // 100 and len(lines) - loaded > len(lines) // 4


def test_gzip_is_inflated_as_zlib_inflates_it(machine: Machine, tmp_path: Path) -> None:
    """Every kind of block, codes of 1 to 15 bits, near and far matches; then the same files, damaged."""
    files = [file for data in _texts() for file in _compressed(data)]
    rng = Random(5)
    for file in list(files):
        for _ in range(12):
            at = rng.randrange(10, len(file))
            files.append(file[:at] + bytes([file[at] ^ 1 << rng.randrange(8)]) + file[at + 1 :])
        files.append(file[: rng.randrange(10, len(file))])
    _write_stream(files, tmp_path)
    (found,) = ask("inflated", [tmp_path], tmp_path, machine)
    sound = 0
    for number, file in enumerate(files):
        want = _by_zlib(file)
        assert (found[f"{number}/wrong"] == b"") == (want is not None), (number, found[f"{number}/wrong"])
        if want is not None:
            assert found[f"{number}/bytes"] == want, number
            sound += 1
    assert sound >= len(files) // 14 and sound < len(files) // 2


def _texts() -> list[bytes]:
    """Bytes of every kind: none, one, skewed so that codes are long, matches at every distance."""
    rng = np.random.default_rng(4)
    skewed = rng.geometric(0.5, 60_000).clip(0, 40).astype(np.uint8).tobytes()
    places = (np.cumsum(rng.integers(0, 9, 40_000)) % 33_000).astype("<u2").tobytes()
    far = rng.integers(0, 256, 33_000, np.uint8).tobytes()
    return [b"", b"x", b"ab" * 9000, bytes(70_000), skewed, far + far[5:900] + far, places]


def _compressed(data: bytes) -> Iterator[bytes]:
    half = len(data) // 2
    strategies = (zlib.Z_HUFFMAN_ONLY, zlib.Z_RLE, zlib.Z_FIXED)
    for level, strategy in ((0, 0), (1, 0), (9, 0), *((9, strategy) for strategy in strategies)):
        packer = zlib.compressobj(level, zlib.DEFLATED, 31, 9, strategy)
        first = packer.compress(data[:half]) + packer.flush(zlib.Z_FULL_FLUSH)
        yield first + packer.compress(data[half:]) + packer.flush()


def _by_zlib(file: bytes) -> bytes | None:
    reader = zlib.decompressobj(31)
    try:
        data = reader.decompress(file)
    except zlib.error:
        return None
    return data if reader.eof and not reader.unused_data else None


def _write_stream(files: list[bytes], folder: Path) -> None:
    (folder / "files.bin").write_bytes(b"".join(struct.pack("<I", len(file)) + file for file in files))


def test_arguments_that_cannot_be_used_are_refused(
    machine: Machine, unity_cases: Path, tmp_path: Path
) -> None:
    """Every function of the header: NULL, numbers that are not finite, what is not there, the wrong order."""
    for own, case in (("pack", "joints"), ("other", "wide")):
        (tmp_path / f"{own}.avatar").symlink_to((unity_cases / case / "pack.avatar").resolve())
    whole = (unity_cases / "joints" / "pack.avatar").read_bytes()
    file = changed(whole, lambda document: document["avatar"].update(name=HOSTILE))
    (tmp_path / "hostile.avatar").write_bytes(file)
    (found,) = ask("refused", [tmp_path], tmp_path, machine)
    assert {what: said for what, said in found.items() if said} == {}
    header = "".join(path.read_text() for path in (NATIVE / "include").iterdir())
    declared = re.findall(r"AVATAR_API [^;]*?(avatar_\w+)\(", header)
    table = (NATIVE / "tests" / "refused.cpp").read_text()
    assert len(declared) > 70 and [name for name in declared if not re.search(rf"\b{name}\b", table)] == []


@pytest.mark.parametrize("name", ["joints", "wide"])
def test_memory_neither_grows_nor_is_taken_in_a_frame(
    machine: Machine, name: str, unity_cases: Path, tmp_path: Path
) -> None:
    (found,) = ask("memory", [unity_cases / name], tmp_path, machine)
    sound, blocks, size, during, calls = struct.unpack("<5Q", found["counted"])
    assert (sound, blocks, size, during) == (1, 0, 0, 0)
    assert calls > 51
    tried, wrong = struct.unpack("<2Q", found["failing"])
    assert wrong == 0 and tried > 10
