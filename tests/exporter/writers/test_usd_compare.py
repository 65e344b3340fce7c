"""A stored rig.usdc against the one made again; the stored one may be anything."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Sdf

from avatar_export.writers.usd.compare import same_usd
from avatar_export.writers.usd.difference import _limit_memory, difference
from avatar_export.writers.usd.layer import layer_bytes, open_layer
from avatar_export.writers.usd.stage import MESH, ROOT, SPLATS, rig_usdc
from avatar_runtime.io.errors import AvatarError
from tests.avatars import full_avatar

GOOD = rig_usdc(full_avatar())
Edit = Callable[[Any], object]


def edited(edit: Edit) -> Any:
    layer = open_layer(GOOD)
    edit(layer)
    return layer


def scaled(path: str, factor: float) -> Edit:
    """All numbers of an attribute, default and samples, times a factor."""

    def apply(layer: Any) -> None:
        attribute = layer.GetAttributeAtPath(path)

        def times(value: Any) -> Any:
            array = np.array(value)
            return type(value).FromNumpy((array * array.dtype.type(factor)).astype(array.dtype))

        if attribute.default is not None:
            attribute.default = times(attribute.default)
        for time in layer.ListTimeSamplesForPath(path):
            layer.SetTimeSample(path, time, times(layer.QueryTimeSample(path, time)))

    return apply


@pytest.mark.parametrize(
    "attribute",
    [
        f"{MESH}.points",
        f"{MESH}.primvars:skel:jointWeights",
        f"{SPLATS}.orientations",
        f"{SPLATS}.radiance:sphericalHarmonicsCoefficients",
        "/avatar/world_from_avatar/skeleton.bindTransforms",
        "/avatar/clips/nod.rotations",
        "/avatar/clips/nod.blendShapeWeights",
        f"{ROOT}.extent",
    ],
)
def test_numbers_may_differ_by_rounding_only(attribute: str) -> None:
    new = open_layer(GOOD)
    assert difference(edited(scaled(attribute, 1 + 4e-7)), new) is None
    found = difference(edited(scaled(attribute, 1 + 4e-6)), new)
    assert found is not None and found.startswith(f"{attribute} has another ")


def test_exact_values_and_structure_may_not_differ() -> None:
    ways: tuple[tuple[str, Edit], ...] = (
        ("is missing", lambda layer: layer.GetPrimAtPath(MESH).nameChildren.__delitem__("jawOpen")),
        ("is not expected", lambda layer: Sdf.PrimSpec(layer.GetPrimAtPath(ROOT), "more", Sdf.SpecifierDef)),
        ("on one side only", lambda layer: layer.GetPrimAtPath(ROOT).SetInfo("hidden", True)),
        ("on one side only", lambda layer: layer.subLayerPaths.append("a.usda")),
        ("another displayName", lambda layer: layer.GetPrimAtPath(ROOT).SetInfo("displayName", "x")),
        ("another default", lambda layer: set_first(layer, f"{MESH}.faceVertexIndices", 7)),
        ("another default", lambda layer: set_first(layer, f"{MESH}.skel:blendShapes", "x")),
        ("another framesPerSecond", lambda layer: setattr(layer, "framesPerSecond", 25)),
        ("another timeSamples", lambda layer: layer.EraseTimeSample("/avatar/clips/nod.rotations", 1)),
        ("another customData", lambda layer: custom(layer, {"formatVersion": "9.0", "generator": "x"})),
        ("children in another order", lambda layer: to_the_end(layer, "/avatar/clips/nod")),
    )
    for said, edit in ways:
        found = difference(edited(edit), open_layer(GOOD))
        assert found is not None and said in found, (said, found)


def to_the_end(layer: Any, path: str) -> None:
    """Makes a prim the last of its siblings."""
    aside = open_layer(GOOD)
    del layer.GetPrimAtPath(path).nameParent.nameChildren[Sdf.Path(path).name]
    assert Sdf.CopySpec(aside, path, layer, path)


def set_first(layer: Any, path: str, value: Any) -> None:
    attribute = layer.GetAttributeAtPath(path)
    attribute.default = type(attribute.default)([value, *list(attribute.default)[1:]])


def custom(layer: Any, said: dict[str, str]) -> None:
    layer.GetPrimAtPath(ROOT).SetInfo("customData", {"avatar": said})


def test_another_generator_is_no_difference() -> None:
    ours = open_layer(GOOD)
    said = dict(ours.GetPrimAtPath(ROOT).GetInfo("customData")["avatar"])
    newer = edited(lambda layer: custom(layer, {**said, "generator": "avatar-export 99"}))
    assert difference(newer, ours) is None


def test_other_bytes_of_the_same_layer_are_the_same(tmp_path: Path) -> None:
    """As an older release of the library packs it."""
    good, old = tmp_path / "good.usdc", tmp_path / "old.usdc"
    good.write_bytes(GOOD)
    program = f"from pxr import Sdf; Sdf.Layer.FindOrOpen({str(good)!r}).Export({str(old)!r})"
    environment = {**os.environ, "USD_WRITE_NEW_USDC_FILES_AS_VERSION": "0.7.0"}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True, capture_output=True)
    assert old.read_bytes()[8:11] == b"\0\7\0" != GOOD[8:11]
    assert same_usd(old.read_bytes(), GOOD) is None
    other = rig_usdc(replace(full_avatar(), name="Somebody else"))
    assert same_usd(other, GOOD) == f"{ROOT} has another displayName"


def test_equal_bytes_are_not_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("a process was started"))
    assert same_usd(GOOD, GOOD) is None
    for data in (b"", b"PXR-USD", b"#usda 1.0"):
        with pytest.raises(AvatarError, match="is not a USD crate file"):
            same_usd(data, GOOD)
    assert same_usd(GOOD + bytes(100_000), GOOD) == f"{len(GOOD) + 100_000} bytes, expected about {len(GOOD)}"


def test_damaged_files_differ_or_cannot_be_read() -> None:
    rng = np.random.default_rng(5)
    unread = 0
    for flips in (30, 300):
        damaged = bytearray(GOOD)
        for at in rng.integers(8, len(GOOD), flips):
            damaged[at] ^= int(rng.integers(1, 256))
        try:
            same_usd(bytes(damaged), GOOD)
        except AvatarError as error:
            assert "convert again" in str(error)
            unread += 1
    assert unread


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "can be read"),
        ("raise MemoryError", "can be read"),
        ("print('no answer')", "can be read"),
        ("import time; time.sleep(60)", "takes more than 0.2 s"),
    ],
)
def test_a_reader_that_crashes_or_hangs_ends_nothing_here(
    program: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    python = tmp_path / "python"
    python.write_text(f"#!{sys.executable}\n{program}\n")
    python.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(python))
    with pytest.raises(AvatarError, match=said):
        same_usd(GOOD[:-1] + b"x", GOOD, seconds=0.2 if "sleep" in program else 60)


def test_memory_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[int, Any] = {}
    monkeypatch.setattr(resource, "setrlimit", asked.__setitem__)
    _limit_memory(1 << 20)
    assert asked == {resource.RLIMIT_AS: (4096 + 64 << 20,) * 2, resource.RLIMIT_CORE: (0, 0)}


def test_no_module_of_the_current_folder_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("pxr", "numpy", "json"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["", ".", *sys.path])
    layer = edited(lambda layer: layer.GetPrimAtPath(ROOT).SetInfo("displayName", "x"))
    assert same_usd(layer_bytes(layer), GOOD) == f"{ROOT} has another displayName"
    assert not (tmp_path / "ran").exists()
