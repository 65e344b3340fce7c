"""Bundles of released versions load, are sound, and play as they did when their version wrote them."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from avatar_runtime.bundle import MANIFEST, load
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.commands import Run
from tests.measured import Measure
from tests.released import DATA, MAKE, SPLATS, WITH_REFERENCE, played, vectors_of

BUNDLES = sorted(DATA.glob("*/*.avatar.zip"))
ROUNDINGS = (
    64  # of float32 at an array's largest value: sums of tens of terms, in another order on another CPU
)


def name_of(bundle: Path) -> str:
    return f"{bundle.parent.name}/{bundle.name.partition('.')[0]}"


def holds_a_reference(bundle: Path) -> bool:
    with zipfile.ZipFile(bundle) as archive:
        return "reference/cases.json" in archive.namelist()


def errors(run: Run, bundle: Path) -> list[str]:
    """What `validate` finds wrong."""
    told = json.loads(run("validate", bundle, "--json")[1])
    return [f"{problem['path']}: {problem['message']}" for problem in told if not problem["warning"]]


def is_older(problem: str) -> bool:
    """Whether `convert` mends it: what is computed of the other files is now computed in another way."""
    return problem.startswith(f"{MANIFEST}: $.engine.") or problem.endswith(
        "run `convert` again to write it anew"
    )


REFERENCES = [bundle for bundle in BUNDLES if holds_a_reference(bundle)]


def test_the_first_version_left_a_bundle_of_every_system() -> None:
    kept = {name_of(bundle) for bundle in BUNDLES}
    assert kept >= {f"0.1.0/{name}" for name in MAKE}
    assert {name_of(bundle) for bundle in REFERENCES} >= {f"0.1.0/{name}" for name in WITH_REFERENCE}


@pytest.mark.parametrize("bundle", BUNDLES, ids=name_of)
def test_bundles_of_released_versions_play_as_they_did(bundle: Path, run: Run, measured: Measure) -> None:
    with zipfile.ZipFile(bundle) as archive:
        manifest = json.loads(archive.read("avatar.json"))
    assert manifest["asset"]["generator"] == f"avatar-export {bundle.parent.name}"
    assert manifest["name"] == bundle.name.partition(".")[0]
    assert not [problem for problem in errors(run, bundle) if not is_older(problem)]
    avatar = load(bundle)
    with np.load(vectors_of(bundle)) as file:
        kept = {name: file[name] for name in file.files}
    now = played(avatar, {name: kept[name] for name in kept if name not in SPLATS})
    for name in SPLATS:
        allowed = ROUNDINGS * np.finfo(np.float32).eps * np.abs(kept[name]).max()
        off = np.abs(now[name] - kept[name]).max()
        measured("bundles of released versions, of what rounding allows", float(off / allowed))
        assert off <= allowed, name
    camera = Camera.orbit(kept["mean"].mean(axis=0), 1.0, 0.0, 0.0, 0.9, 48, 48)
    assert Player(avatar, "reference").frame(Pose(), camera).image.transmittance.min() < 0.9


@pytest.mark.parametrize("bundle", REFERENCES, ids=name_of)
def test_references_of_released_versions_hold(bundle: Path, run: Run) -> None:
    code, output, error = run("conform", bundle, "--backend", "reference")
    assert code == 0, output + error
