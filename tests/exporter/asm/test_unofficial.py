"""The unofficial code's files, built by hand, and what is read against its own formulas written out again."""

from __future__ import annotations

import json
import math
import pickle
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.asm import maths
from avatar_export.asm.model import AsmFace
from avatar_export.asm.unofficial import read_folder
from tests.asm_faces import grid
from tests.exporter.refusals import put, refused

Array = npt.NDArray[Any]

BONES = ("nose", "nose.001", "lip.T.L", "ear.L")
SCALE = 77.15  # of the rig in the scene
# The mesh in the scene, Z up.
UPRIGHT = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0.25], [0, 0, 0, 1.0]])
PLACE = {"scale": [1.0] * 3, "rotation_euler": [0.0] * 3, "location": [0.0] * 3}


def bones(rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """name -> head, tail and matrix in the rig's own space; `face` first, as Blender writes it."""
    found: dict[str, dict[str, Any]] = {}
    for name in ("face", *BONES):
        matrix = np.eye(4)
        matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        matrix[:3, :3] *= np.sign(np.linalg.det(matrix[:3, :3]))
        matrix[:3, 3] = rng.uniform(-0.05, 0.05, 3)
        tail = (matrix[:3, 3] + 0.08 * matrix[:3, 1]).tolist()
        bone = {"head": matrix[:3, 3].tolist(), "tail": tail, "length": 0.08, **PLACE}
        kin = (
            {"parent": "spine.006", "children": [*BONES]}
            if name == "face"
            else {"parent": "face", "children": []}
        )
        found[name] = {**bone, **kin, "matrix": matrix.tolist(), "matrix_basis": np.eye(4).tolist()}
    return found


def rig_info(rng: np.random.Generator) -> dict[str, Any]:
    """What rig_info.json holds."""
    rig = np.diag([SCALE, SCALE, SCALE, 1.0])
    rig[:3, 3] = (0.0, 2.0, -3.0)
    return {
        "mu_face": {**PLACE, "matrix_world": UPRIGHT.tolist()},
        "metarig": {**PLACE, "matrix_world": rig.tolist(), "bones": bones(rng)},
    }


def parameters(rng: np.random.Generator, components: int) -> dict[str, Array]:
    """What inited_gmm_params_KN.pkl holds: pi and the diagonal before softplus."""
    j = len(BONES)
    return {
        "pi": rng.normal(0, 2, (j, components)).astype("f4"),
        "mu": rng.normal(0, 0.05, (j, components, 2)).astype("f4"),
        "scale_tril": rng.normal([-2, -2, 0], [0.5, 0.5, 0.05], (j, components, 3)).astype("f4"),
    }


def obj_text() -> str:
    """The grid in centimetres; its first two triangles lie beyond a seam, in a chart of their own."""
    vertices, triangles, uv = grid()
    lines = [f"v {x} {y} {z}" for x, y, z in (100.0 * vertices).tolist()]
    lines += [f"vt {u} {v}" for u, v in uv.tolist()]
    lines += [f"vt {u + 3} {v}" for u, v in uv.tolist()]  # the other chart
    for f, corners in enumerate(triangles.tolist()):
        shift = len(uv) if f < 2 else 0
        lines.append("f " + " ".join(f"{c + 1}/{c + 1 + shift}" for c in corners))
    return "\n".join(lines) + "\n"


def write_folder(folder: Path, seed: int = 0, components: tuple[int, ...] = (2, 3)) -> Path:
    """The three files, one pickle for each number of components."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig_info.json").write_text(json.dumps(rig_info(rng)))
    (folder / "mu_face.obj").write_text(obj_text())
    for k in components:
        (folder / f"inited_gmm_params_K{k}.pkl").write_bytes(pickle.dumps(parameters(rng, k)))
    return folder


SEAM = {*grid()[1][:2].ravel().tolist()}  # vertices of the triangles beyond the seam


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(tmp_path_factory.mktemp("unofficial"))


@pytest.fixture(scope="module")
def face(folder: Path) -> AsmFace:
    return read_folder(folder)


def to_mesh() -> Array:
    rig = np.array(rig_info(np.random.default_rng(0))["metarig"]["matrix_world"])
    return np.asarray(np.linalg.inv(UPRIGHT) @ rig)


def stored_bones() -> dict[str, Any]:
    found: dict[str, Any] = rig_info(np.random.default_rng(0))["metarig"]["bones"]
    return found


def test_the_template_is_the_mesh_in_metres(face: AsmFace) -> None:
    vertices, triangles, uv = grid()
    t = face.template
    np.testing.assert_allclose(t.vertices, vertices, atol=1e-7)
    assert t.bone_names == BONES and (t.parents == -1).all() and t.weight_rule == "softplus"
    still = maths.posed(face, *face.takes)  # the neutral is at rest
    np.testing.assert_allclose(still, t.vertices, atol=1e-12)
    assert sorted(map(tuple, t.triangles.tolist())) == sorted(map(tuple, triangles.tolist()))
    seam = uv.copy()
    seam[[*SEAM], 0] += 3  # of their first corners, which are in the other chart
    np.testing.assert_allclose(t.uv, seam, atol=1e-6)


def test_bones_stand_at_their_heads(face: AsmFace) -> None:
    """B' of the code at zeta's start: the bind matrix moved by v_t - tail."""
    found = maths.bind_matrices(face.template, face.binding)
    vertices = 100.0 * face.template.vertices.astype(np.float64)
    for j, name in enumerate(BONES):
        bind = to_mesh() @ np.array(stored_bones()[name]["matrix"])
        tail = (to_mesh() @ np.append(stored_bones()[name]["tail"], 1))[:3]
        nearest = int(np.argmin(((vertices - tail) ** 2).sum(axis=1)))
        assert face.template.anchor_vertex[j] == nearest
        np.testing.assert_allclose(100 * found[j, :3, :3], bind[:3, :3], rtol=1e-6, atol=1e-5)
        np.testing.assert_allclose(100 * found[j, :3, 3], bind[:3, 3] + vertices[nearest] - tail, atol=1e-5)
        # The unit is no longer visible in that rig: an even scale, as engines hold it.
        linear = found[j, :3, :3]
        np.testing.assert_allclose(linear.T @ linear, (linear[:, 0] @ linear[:, 0]) * np.eye(3), atol=1e-6)


def test_weights_are_the_code_s(face: AsmFace) -> None:
    rng = np.random.default_rng(0)
    rig_info(rng)
    given = {key: value.astype(np.float64) for key, value in parameters(rng, 2).items()}
    uv = face.template.uv.astype(np.float64)

    def softplus(x: float) -> float:
        return math.log(1 + math.exp(x))

    for v in face.template.anchor_vertex.tolist():
        mixtures = []
        for j in range(len(BONES)):
            shares = [softplus(x) for x in given["pi"][j]]
            total = 0.0
            for k, share in enumerate(shares):
                t0, t1, t2 = given["scale_tril"][j, k]
                lower = np.array([[softplus(t0), 0], [t2, softplus(t1)]])
                mean = given["mu"][j, k] + uv[face.template.anchor_vertex[j]]
                z = np.linalg.solve(lower, uv[v] - mean)
                density = math.exp(-0.5 * float(z @ z)) / (2 * math.pi * lower[0, 0] * lower[1, 1])
                total += share / sum(shares) * density
            mixtures.append(softplus(total))
        expected = np.array(mixtures) / sum(mixtures)
        np.testing.assert_allclose(
            maths.mixture_weight_rows(face.template, face.binding, slice(None))[v], expected, rtol=1e-9
        )
        assert expected.max() > 1.5 * expected.min()


def rig(*at: Any) -> Callable[[Path], None]:
    """Puts the last of `at` into the metarig of rig_info.json."""

    def apply(folder: Path) -> None:
        document = json.loads((folder / "rig_info.json").read_text())
        put(*at)(document)
        (folder / "rig_info.json").write_text(json.dumps(document))

    return apply


def pickled(make: Callable[[dict[str, Array]], object]) -> Callable[[Path], None]:
    def apply(folder: Path) -> None:
        made = make(parameters(np.random.default_rng(0), 2))
        (folder / "inited_gmm_params_K2.pkl").write_bytes(pickle.dumps(made))

    return apply


def mesh(new: str) -> Callable[[Path], None]:
    """The first corner of the first face of the .obj as `new`."""

    def apply(folder: Path) -> None:
        path = folder / "mu_face.obj"
        path.write_text(path.read_text().replace("f 1/", new, 1))

    return apply


class Trap:
    """Would run a program if it were unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return (print, ("unpickled",))


IN = ("metarig", "bones")
BAD: list[tuple[Callable[[Path], object], str]] = [
    (lambda folder: (folder / "rig_info.json").write_text("{"), r"rig_info\.json: is not valid JSON"),
    (rig("metarig", None), "metarig: is missing or not an object"),
    (rig(*IN, {"face": {}}), r"bones: has 0 bones; 1 to"),
    (rig(*IN, "nose", "matrix", [[1, 0]]), r"nose\.matrix: expected \[4, 4\] finite numbers"),
    (rig(*IN, "ear.L", "tail", ["a", "b", "c"]), r"ear\.L\.tail: is missing or not an array"),
    (rig("mu_face", "matrix_world", np.zeros((4, 4)).tolist()), r"mu_face\.matrix_world: has no inverse"),
    (pickled(lambda p: {k: v[:3] for k, v in p.items()}), r"pi: expected \[4, K\], one row per bone"),
    (pickled(lambda p: p | {"mu": p["mu"][:, :1]}), r"mu: expected \[4, 2, 2\]"),
    (pickled(lambda p: {k: v for k, v in p.items() if k != "mu"}), "mu: is missing"),
    (pickled(lambda p: p | {"mu": p["mu"] * np.float32(np.nan)}), "mu: holds NaN, an infinity"),
    (pickled(lambda p: p | {"pi": p["pi"] * 0 - np.array([[0], [0], [1e5], [0]])}),
     r"inited_gmm_params_K2\.pkl: pi: gives no weight to bone lip\.T\.L"),
    (pickled(lambda p: p | {"pi": Trap()}), "print"),
    (mesh("f 1//"), "line"),
    (mesh("f 1/9"), "without a valid texture coordinate"),
    (mesh("f 2/2 1/"), "more than three corners"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), BAD, ids=[message for _, message in BAD])
def test_bad_files(
    folder: Path,
    tmp_path: Path,
    change: Callable[[Path], object],
    message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    change(shutil.copytree(folder, tmp_path / "m"))
    refused(message, read_folder, tmp_path / "m")
    assert not capsys.readouterr().out
