"""The unofficial code's files, against its own formulas written out again."""

from __future__ import annotations

import json
import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.asm import maths
from avatar_export.asm.model import AsmFace, Take
from avatar_export.asm.unofficial import detect, files_of, read_folder
from avatar_runtime.io.errors import AvatarError
from tests.asm_faces import grid
from tests.exporter.asm.unofficial_files import BONES, UPRIGHT, parameters, rig_info, write_folder

Array = npt.NDArray[Any]
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


def bones() -> dict[str, Any]:
    found: dict[str, Any] = rig_info(np.random.default_rng(0))["metarig"]["bones"]
    return found


def test_the_template_is_the_mesh_in_metres(face: AsmFace) -> None:
    vertices, triangles, uv = grid()
    t = face.template
    np.testing.assert_allclose(t.vertices, vertices, atol=1e-7)
    assert t.bone_names == BONES and (t.parents == -1).all() and t.weight_rule == "softplus"
    assert sorted(map(tuple, t.triangles.tolist())) == sorted(map(tuple, triangles.tolist()))
    seam = uv.copy()
    seam[[*SEAM], 0] += 3  # of their first corners, which are in the other chart
    np.testing.assert_allclose(t.uv, seam, atol=1e-6)


def test_triangles_across_the_seam_come_last(face: AsmFace) -> None:
    beyond = grid()[1][:2].tolist()
    across = [bool(SEAM & {*t}) and t not in beyond for t in face.template.triangles.tolist()]
    assert 3 < sum(across) < 20 and across == sorted(across)


def test_bones_stand_at_their_heads(face: AsmFace) -> None:
    """B' of the code at zeta's start: the bind matrix moved by v_t - tail."""
    found = maths.bind_matrices(face.template, face.binding)
    vertices = 100.0 * face.template.vertices.astype(np.float64)
    for j, name in enumerate(BONES):
        bind = to_mesh() @ np.array(bones()[name]["matrix"])
        tail = (to_mesh() @ np.append(bones()[name]["tail"], 1))[:3]
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
        np.testing.assert_allclose(maths.mixture_weights(face.template, face.binding)[v], expected, rtol=1e-9)
        assert expected.max() > 1.5 * expected.min()


def test_a_pose_is_the_code_s(face: AsmFace) -> None:
    """M_l2w = M_root M_tau with M_tau = M_root^-1 B' M(tau): B' M(tau) B'^-1, whatever the root."""
    rng = np.random.default_rng(5)
    shape = (1, len(BONES), 3)
    take = Take(
        "t", 30.0, rng.normal(0, 0.3, shape), rng.normal(0, 0.01, shape), np.exp(rng.normal(0, 0.2, shape))
    )
    bind = maths.bind_matrices(face.template, face.binding)
    expected = bind @ maths.pose_matrices(take)[0] @ np.linalg.inv(bind)
    np.testing.assert_allclose(maths.skin_matrices(face, take)[0], expected, atol=1e-12)


def test_the_neutral_is_at_rest(face: AsmFace) -> None:
    (neutral,) = face.takes
    np.testing.assert_allclose(maths.posed(face, neutral), face.template.vertices, atol=1e-12)


def test_the_fewest_components_are_read_also_from_data(tmp_path: Path) -> None:
    write_folder(tmp_path / "repo" / "data", components=(5, 3))
    assert detect(tmp_path / "repo") and read_folder(tmp_path / "repo").binding.components == 3
    assert set(files_of(tmp_path / "repo")) == {"rig_info.json", "mu_face.obj", "inited_gmm_params_K3.pkl"}
    assert not detect(tmp_path)


def test_units_are_the_mesh_s(folder: Path, face: AsmFace) -> None:
    half = read_folder(folder, 200.0)
    np.testing.assert_allclose(2 * half.template.vertices, face.template.vertices, atol=1e-7)
    np.testing.assert_allclose(2 * half.template.rest_position, face.template.rest_position, atol=1e-7)


def edited(change: Callable[[dict[str, Any]], None]) -> Callable[[Path], None]:
    def apply(folder: Path) -> None:
        document = json.loads((folder / "rig_info.json").read_text())
        change(document)
        (folder / "rig_info.json").write_text(json.dumps(document))

    return apply


def pickled(make: Callable[[dict[str, Array]], object]) -> Callable[[Path], None]:
    def apply(folder: Path) -> None:
        made = make(parameters(np.random.default_rng(0), 2))
        (folder / "inited_gmm_params_K2.pkl").write_bytes(pickle.dumps(made))

    return apply


def text(name: str, old: str, new: str) -> Callable[[Path], None]:
    def apply(folder: Path) -> None:
        path = folder / name
        path.write_text(path.read_text().replace(old, new, 1))

    return apply


class Trap:
    """Would run a program if it were unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return (print, ("unpickled",))


BAD: dict[str, tuple[Callable[[Path], None], str]] = {
    "no JSON": (lambda f: (f / "rig_info.json").write_text("{"), r"rig_info\.json: is not valid JSON"),
    "no rig": (edited(lambda d: d.pop("metarig")), "metarig: is missing or not an object"),
    "no bone": (edited(lambda d: d["metarig"].update(bones={"face": {}})), r"bones: has 0 bones; 1 to"),
    "short matrix": (
        edited(lambda d: d["metarig"]["bones"]["nose"].update(matrix=[[1, 0]])),
        r"nose\.matrix: expected \[4, 4\] finite numbers",
    ),
    "ragged": (
        edited(lambda d: d["metarig"]["bones"]["nose"].update(matrix=[[1, 0], [1]])),
        r"nose\.matrix: is missing or not an array",
    ),
    "words": (
        edited(lambda d: d["metarig"]["bones"]["ear.L"].update(tail=["a", "b", "c"])),
        r"ear\.L\.tail: is missing or not an array",
    ),
    "infinite": (
        edited(lambda d: d["metarig"]["bones"]["ear.L"].update(tail=[0, math.inf, 0])),
        r"ear\.L\.tail: expected \[3\] finite",
    ),
    "flat world": (
        edited(lambda d: d["mu_face"].update(matrix_world=np.zeros((4, 4)).tolist())),
        r"mu_face\.matrix_world: has no inverse",
    ),
    "other bones": (
        pickled(lambda p: {k: v[:3] for k, v in p.items()}),
        r"pi: expected \[4, K\], one row per bone",
    ),
    "other width": (pickled(lambda p: p | {"mu": p["mu"][:, :1]}), r"mu: expected \[4, 2, 2\]"),
    "no mu": (pickled(lambda p: {k: v for k, v in p.items() if k != "mu"}), "mu: is missing"),
    "not finite": (pickled(lambda p: p | {"mu": p["mu"] * np.float32(np.nan)}), "mu: holds NaN, an infinity"),
    "whole numbers": (
        pickled(lambda p: p | {"mu": p["mu"].astype(int)}),
        "mu: is missing or does not hold floats",
    ),
    "no weight": (
        pickled(lambda p: p | {"pi": p["pi"] * 0 - np.array([[0], [0], [1e5], [0]])}),
        r"inited_gmm_params_K2\.pkl: pi: gives no weight to bone lip\.T\.L",
    ),
    "a trap": (pickled(lambda p: p | {"pi": Trap()}), "print"),
    "no places": (text("mu_face.obj", "f 1/", "f 1//"), "line"),
    "place beyond": (text("mu_face.obj", "f 1/", "f 1/9"), "without a valid texture coordinate"),
    "place beyond all": (text("mu_face.obj", "f 1/", f"f 1/{'9' * 30}"), "line .* has no texture coordinate"),
    "a quad": (text("mu_face.obj", "f 1/", "f 2/2 1/"), "more than three corners"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_in_one_line(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    change, message = BAD[name]
    folder = write_folder(tmp_path / "m")
    change(folder)
    with pytest.raises(AvatarError, match=message) as caught:
        read_folder(folder)
    assert "\n" not in str(caught.value) and not capsys.readouterr().out
