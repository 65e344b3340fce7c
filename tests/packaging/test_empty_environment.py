"""The built wheels in an empty environment: avatar-export-runtime alone plays, avatar-export on it converts.

`make test-more` runs this.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.exporter.readers import lam_files
from tests.packaging.environments import Environment, empty
from tests.released import DATA
from tools import dist

pytestmark = pytest.mark.more
BUNDLE = DATA / "0.1.0" / "every_field.avatar.zip"
EXTRAS = {  # libraries that come with an extra
    "avatar-export-runtime": {"llvmlite", "moderngl", "numba", "onnx", "onnxruntime"},
    "avatar-export": {"cv2", "dask", "distributed", "fsspec", "mediapipe", "onnx", "torch", "ufbx"},
}
IMPORT_ALL = """
import importlib, json, pkgutil, sys
missing = set()
def note(_):
    missing.add(sys.exc_info()[1].name)
for package in sys.argv[1:]:
    modules = pkgutil.walk_packages(importlib.import_module(package).__path__, package + ".", note)
    for module in [m.name for m in modules if not m.name.endswith("__main__")]:
        try:
            importlib.import_module(module)
        except ModuleNotFoundError as error:
            missing.add(error.name)
print(json.dumps(sorted(missing)))
"""
PLAY = """
import json, sys
from avatar_runtime.bundle import load
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
avatar = load(sys.argv[1])
player = Player(avatar)
pose = Pose({avatar.expression_names[0]: 0.5})
camera = Camera.orbit(player.animate(pose).mean.mean(axis=0), 0.6, 0.3, 0.0, 0.7, 64, 48)
frame = player.frame(pose, camera)
print(json.dumps({
    "shape": frame.rgb8().shape,
    "drawn": float(1 - frame.image.transmittance.min()),
    "modules": sorted({name.partition(".")[0] for name in sys.modules} - sys.stdlib_module_names),
}))
"""
SHADERS = """
import avatar_shaders as s
from avatar_schema import constants, schema
assert schema("avatar")["title"] and constants()["low_pass"] == 0.3
assert all(s.source(e, l) for l in ("hlsl", *s.LANGUAGES) for e in s.ENTRIES)
assert all(s.ENTRIES.keys() == s.reflection(l).keys() for l in s.LANGUAGES)
"""


def names(listed: tuple[str, ...]) -> set[str]:
    return {dist.Requirement(line).name for line in listed}


def packages(name: str) -> list[str]:
    return [Path(folder).name for folder in dist.distributions()[name].packages]


@pytest.fixture(scope="module")
def runtime(wheels: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """An environment with avatar-export-runtime, NumPy, jsonschema and what these two need."""
    environment = empty(tmp_path_factory.mktemp("runtime"))
    environment.lend(names(dist.distributions()["avatar-export-runtime"].dependencies))
    environment.install(wheels["avatar-export-runtime"])
    return environment


@pytest.fixture(scope="module")
def exporter(wheels: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """An environment with both distributions and their base dependencies."""
    environment = empty(tmp_path_factory.mktemp("exporter"))
    listed = names(sum((given.dependencies for given in dist.distributions().values()), ()))
    environment.lend(listed - dist.distributions().keys())
    environment.install(*wheels.values())
    return environment


def test_the_runtime_needs_numpy_and_jsonschema_only(runtime: Environment) -> None:
    assert names(dist.distributions()["avatar-export-runtime"].dependencies) == {"jsonschema", "numpy"}
    missing = set(json.loads(runtime.script(IMPORT_ALL, *packages("avatar-export-runtime"))))
    assert missing <= EXTRAS["avatar-export-runtime"]


def test_the_runtime_alone_plays_a_bundle(runtime: Environment) -> None:
    played = json.loads(runtime.script(PLAY, BUNDLE))
    assert played["shape"] == [48, 64, 3] and played["drawn"] > 0.5
    loaded = set(played["modules"])
    assert loaded >= {"avatar_runtime", "avatar_schema", "jsonschema", "numpy"}
    assert not loaded & EXTRAS["avatar-export-runtime"]
    runtime.script(SHADERS)


def test_the_runtime_is_typed_and_brings_no_command(runtime: Environment) -> None:
    assert all(
        (runtime.site / package / "py.typed").is_file() for package in packages("avatar-export-runtime")
    )
    assert not list((runtime.folder / "bin").glob("avatar-*"))


def test_the_exporter_needs_what_it_lists(exporter: Environment) -> None:
    missing = set(json.loads(exporter.script(IMPORT_ALL, *packages("avatar-export"))))
    assert missing <= EXTRAS["avatar-export"]


def test_the_exporter_converts(exporter: Environment, tmp_path: Path) -> None:
    trained = lam_files.write_zip(tmp_path / "made.zip", lam_files.files(animation=None))
    options = ("--no-preview", "--no-reference")
    exporter.run("avatar-export", "convert", trained, "--out", tmp_path / "made", *options)
    assert {"rig.glb", "rig.usdc", "splats.glb"} <= {path.name for path in (tmp_path / "made").iterdir()}
