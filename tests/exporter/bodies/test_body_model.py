"""Body models of both layouts and every container read to the same arrays; unsound ones are refused."""

from __future__ import annotations

import pickle
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.bodies.body_model import JOINT_NAMES, BodyModel, read_body_model
from avatar_export.provenance import BODY_LICENCE, BODY_RESTRICTION, body_restriction
from tests.exporter.refusals import refused
from tests.hostile import Canary, Torch, modules, py2_array, py2_dict

V, F, J, S, E = 11, 7, 5, 4, 3
ROOT = 2**32 - 1


def flame(expressions: int = E, joints: int = J) -> dict[str, Any]:
    """A FLAME-layout model of V vertices with random values: 300 identity directions, then expressions."""
    rng = np.random.default_rng(5)
    weights = rng.random((V, joints))
    weights[::2, -1] = 0
    regressor = np.where(rng.random((joints, V)) < 0.4, rng.random((joints, V)), 0)
    parents = [ROOT, *np.maximum(np.arange(1, joints) - 2, 0)]
    return {
        "v_template": rng.normal(size=(V, 3)),
        "f": rng.integers(0, V, (F, 3)).astype(np.uint32),
        "shapedirs": rng.normal(size=(V, 3, 300 + expressions)),
        "posedirs": rng.normal(size=(V, 3, 9 * (joints - 1))),
        "J_regressor": regressor,
        "weights": weights / weights.sum(axis=1, keepdims=True),
        "kintree_table": np.array([parents, range(joints)], np.uint32),
    }


def expect(body: BodyModel, want: Mapping[str, Any]) -> None:
    for got, key in ((body.v_template, "v_template"), (body.posedirs, "posedirs")):
        np.testing.assert_array_equal(got, want[key].astype("f4"))
    np.testing.assert_array_equal(body.identity_dirs, want["shapedirs"][..., :300].astype("f4"))
    np.testing.assert_array_equal(body.expression_dirs, want["shapedirs"][..., 300:].astype("f4"))
    np.testing.assert_array_equal(body.triangles, want["f"])
    np.testing.assert_array_equal(body.joint_regressor, want["J_regressor"].astype("f4"))
    np.testing.assert_array_equal(body.skin_weights, want["weights"].astype("f4"))
    assert body.parents.tolist() == [-1, *want["kintree_table"][0][1:]]
    assert body.triangles.dtype == np.uint32 and body.parents.dtype == np.int32


def test_a_licence_that_the_file_states(tmp_path: Path) -> None:
    np.savez(tmp_path / "free.npz", **flame(), licence=np.array(["MIT"]))
    licence = read_body_model(tmp_path / "free.npz").licence
    assert body_restriction(licence) == BODY_LICENCE + "MIT"
    np.savez(tmp_path / "silent.npz", **flame())
    assert body_restriction(read_body_model(tmp_path / "silent.npz").licence) == BODY_RESTRICTION


class State:
    """An object that pickles as its attributes; subclasses take the names of chumpy's and scipy's classes."""

    def __init__(self, **state: Any):
        self.__dict__.update(state)


def chumpy(array: np.ndarray, kind: type) -> State:
    """What chumpy's __getstate__ keeps of a Ch."""
    bookkeeping = {"v": {"deps": {"x"}, "value": None, "out_of_date": True}}
    return kind(x=array, _dirty_vars={"x"}, _itr=None, _depends_on_deps=bookkeeping, _make_dense=False)


def compressed(dense: np.ndarray, by_column: bool, kind: type) -> State:
    """A csc or csr matrix by its definition, with an entry split in two, as scipy may keep it."""
    lines = dense.T if by_column else dense
    rows = [[(i, x / 2) for i, x in enumerate(line) if x for _ in "ab"] for line in lines]
    flat = [entry for row in rows for entry in row]
    return kind(
        _shape=dense.shape, maxprint=50, format="csc" if by_column else "csr",
        data=np.array([x for _, x in flat]), indices=np.array([i for i, _ in flat], np.int32),
        indptr=np.cumsum([0, *(len(row) for row in rows)]).astype(np.int32),
    )  # fmt: skip


def flame_pickle(
    content: Mapping[str, Any], protocol: int, sparse: str = "csc", module: str = "csc"
) -> bytes:
    """As FLAME is distributed: chumpy arrays and a sparse joint regressor."""
    ch, matrix = type("Ch", (State,), {}), type("matrix", (State,), {})
    with modules(chumpy__ch={"Ch": ch}, **{f"scipy__sparse__{module}": {f"{sparse}_matrix": matrix}}):
        return pickle.dumps(
            {
                **content,
                "v_template": chumpy(content["v_template"], ch),
                "shapedirs": chumpy(content["shapedirs"], ch),
                "J_regressor": compressed(content["J_regressor"], sparse == "csc", matrix),
                "bs_style": "lbs",
            },
            protocol,
        )


def as_npz(path: Path, content: Mapping[str, Any]) -> Path:
    np.savez_compressed(path, **content)
    return path


def as_bytes(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("protocol", range(6))
def test_flame_pickle_with_chumpy_and_sparse(tmp_path: Path, protocol: int) -> None:
    body = read_body_model(as_bytes(tmp_path / "generic_model.pkl", flame_pickle(flame(), protocol)))
    expect(body, flame())
    assert body.joint_names == ("root", "neck", "jaw", "leftEye", "rightEye")
    assert body.expression_names == ("exp_000", "exp_001", "exp_002")


def test_other_containers(tmp_path: Path) -> None:
    content = flame()
    python_2 = py2_dict({key: py2_array(value) for key, value in content.items()})
    for data in (python_2, pickle.dumps(content)):
        expect(read_body_model(as_bytes(tmp_path / "m.pkl", data)), content)
    expect(read_body_model(as_npz(tmp_path / "m.npz", content)), content)


def test_chumpy_selection(tmp_path: Path) -> None:
    content = flame()
    ch, select = type("Ch", (State,), {}), type("Select", (State,), {})
    picked = content["shapedirs"][..., 1:]
    index = np.arange(content["shapedirs"].size).reshape(content["shapedirs"].shape)[..., 1:].ravel()
    with modules(chumpy__ch={"Ch": ch}, chumpy__reordering={"Select": select}):
        chosen = select(a=chumpy(content["shapedirs"], ch), idxs=index, preferred_shape=picked.shape)
        good = pickle.dumps({**content, "shapedirs": chosen}, 2)
        chosen.idxs = index + 1
        outside = pickle.dumps({**content, "shapedirs": chosen}, 2)
        chosen.preferred_shape = (V, 3, 10**9)
        too_large = pickle.dumps({**content, "shapedirs": chosen}, 2)
    body = read_body_model(as_bytes(tmp_path / "m.pkl", good))
    np.testing.assert_array_equal(body.identity_dirs, picked[..., :300].astype("f4"))
    for data, message in ((outside, "reaches outside"), (too_large, "has shape")):
        refused(f"shapedirs: .*{message}", read_body_model, as_bytes(tmp_path / "m.pkl", data))


def test_smpl_layout(tmp_path: Path) -> None:
    content = flame(0, 24)
    content["shapedirs"] = content["shapedirs"][..., :10]
    body = read_body_model(as_npz(tmp_path / "smpl.npz", content))
    expect(body, content)
    assert body.joint_names == JOINT_NAMES[24] and body.joint_names[15] == "head"
    assert body.posedirs.shape == (V, 3, 207) and body.expression_names == ()
    renamed = {**content, "posedirs": content["posedirs"].reshape(3 * V, 207).T}
    renamed["faces"], renamed["lbs_weights"] = renamed.pop("f"), renamed.pop("weights")
    renamed["parents"] = np.array([-1, *renamed.pop("kintree_table")[0][1:].astype(int)])
    expect(read_body_model(as_npz(tmp_path / "smplx.npz", renamed)), content)


def test_split_directions_and_names(tmp_path: Path) -> None:
    content = flame()
    both = content.pop("shapedirs")
    content |= {"shapedirs_identity": both[..., :S], "shapedirs_expression": both[..., 300:]}
    body = read_body_model(as_npz(tmp_path / "m.npz", {**content, "expression_names": ["a", "b", "jawOpen"]}))
    assert body.expression_names == ("a", "b", "jawOpen")
    np.testing.assert_array_equal(body.identity_dirs, both[..., :S].astype("f4"))
    np.testing.assert_array_equal(body.expression_dirs, both[..., 300:].astype("f4"))
    for names in (["a", "b"], ["a", "a", "b"], ["a", "b", ""]):
        path = as_npz(tmp_path / "m.npz", {**content, "expression_names": names})
        refused("expression_names", read_body_model, path)
    pickled = pickle.dumps({**content, "expression_names": ["x", "y", "z"]})
    assert read_body_model(as_bytes(tmp_path / "m.pkl", pickled)).expression_names == ("x", "y", "z")
    assert read_body_model(as_npz(tmp_path / "m.npz", flame(joints=6))).joint_names[5] == "joint_5"


def put(index: Any, value: Any) -> Callable[[np.ndarray], np.ndarray]:
    def change(array: np.ndarray) -> np.ndarray:
        array = array.copy()
        array[index] = value
        return array

    return change


UNSOUND: list[tuple[str, Callable[[Any], Any] | None, str]] = [
    ("v_template", None, "v_template: is missing; .*has: f, shapedirs"),
    ("f", None, "f or faces: is missing"),
    ("v_template", lambda a: a[:, :2], r"v_template: has shape \[11, 2\], expected \[any, 3\]"),
    ("v_template", lambda a: a[:0], "v_template: has no vertices"),
    *(("v_template", put((4, 1), value), r"v_template: \[4, 1\] is not a finite number") for value in (np.nan, 1e300)),
    ("v_template", lambda a: a.astype(bool), "numbers are needed"),
    ("f", put((5, 2), V), rf"f: \[5\] = .* there are {V} vertices"),
    ("f", lambda a: a.astype(float), "f: has type float64, whole numbers"),
    ("shapedirs", lambda a: a[1:], r"shapedirs: has shape \[10, 3, 303\], expected \[11, 3, any\]"),
    ("posedirs", lambda a: a[..., :35], r"posedirs: has shape .* expected \[11, 3, 36\]"),
    ("J_regressor", lambda a: a[1:], r"J_regressor: has shape \[4, 11\], expected \[5, 11\]"),
    ("weights", lambda a: a * 1.01, "weights: row 0 sums to 1.01, "),
    ("weights", lambda a: a + np.array([[-1, 1, 0, 0, 0]]), "weights: row 0 sums to 1, its smallest weight is -"),
    ("weights", lambda a: a[:, :0], "weights: has no joints"),
    *(("kintree_table", put((0, 2), parent), f"joint 2 has parent {parent}") for parent in (2, 4)),
    ("kintree_table", lambda a: a[:, :4], "kintree_table: has shape"),
    ("kintree_table", put((1, 2), 9), "row 1 is not 0, 1, 2"),
    ("kintree_table", lambda a: a[0, :3], "parents: has shape"),
]  # fmt: skip


@pytest.mark.parametrize(("key", "change", "message"), UNSOUND, ids=[message for *_, message in UNSOUND])
def test_unsound_models(tmp_path: Path, key: str, change: Callable[[Any], Any] | None, message: str) -> None:
    content = flame()
    array = content.pop(key)
    if change is not None:
        content = {name: change(array) if name == key else content[name] for name in flame()}
    npz, pkl = as_npz(tmp_path / "m.npz", content), as_bytes(tmp_path / "m.pkl", pickle.dumps(content))
    for path in (npz, pkl):
        assert refused(message, read_body_model, path).file == str(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"_shape": (10**6, 10**6)}, "larger than any joint regressor"),
        ({"_shape": (5, -1)}, "no shape"),
        ({"_shape": (4, V)}, "index outside 0..3"),
        ({"indptr": np.zeros(V + 1, np.int32)}, "inconsistent"),
        ({"indices": np.zeros(3)}, "not whole numbers"),
        ({"data": None}, "no array data"),
        ({"data": np.array(["x"])}, "U1"),
    ],
)
def test_unsound_sparse_matrices(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    content, matrix = flame(), type("matrix", (State,), {})
    content["J_regressor"][4, 0] = 0.5
    sparse = compressed(content["J_regressor"], True, matrix)
    sparse.__dict__.update(change)
    with modules(scipy__sparse__csc={"csc_matrix": matrix}):
        data = pickle.dumps({**content, "J_regressor": sparse}, 2)
    refused(f"J_regressor: .*{message}", read_body_model, as_bytes(tmp_path / "m.pkl", data))


def test_chumpy_objects_without_an_array_are_refused(tmp_path: Path) -> None:
    ch = type("Ch", (State,), {})
    looped = ch()
    looped.x = looped
    with modules(chumpy__ch={"Ch": ch}):
        for value in (ch(), ch(x=3), looped):
            path = as_bytes(tmp_path / "m.pkl", pickle.dumps({**flame(), "v_template": value}, 2))
            refused("v_template: a chumpy object holds no array", read_body_model, path)


def test_what_is_no_body_model(tmp_path: Path) -> None:
    for data, message in (
        (b"", "neither .npz nor .pkl"), (b"5402\n5454\n", "neither .npz nor .pkl"), (b"\x80\x02", "truncated"),
        (pickle.dumps([1]), "does not hold a dict"), (pickle.dumps({}), "v_template: is missing; .*nothing$"),
        (pickle.dumps({"v_template": 3}), "v_template: is not an array"),
        (b"PK\x03\x04" + bytes(99), "truncated zip"),
    ):  # fmt: skip
        refused(message, read_body_model, as_bytes(tmp_path / "m.pkl", data))
    refused(r"cannot be read \(No such file or directory\)$", read_body_model, tmp_path / "missing.npz")
    frame = Torch().save(tmp_path / "00000.frame", {"flame": {"shape": np.zeros(3, "f4")}})
    refused(r"a file of torch\.save", read_body_model, frame)
    with zipfile.ZipFile(tmp_path / "other.zip", "w") as other:
        other.writestr("readme.txt", "hello")
    refused("a zip without arrays", read_body_model, tmp_path / "other.zip")
    np.savez(tmp_path / "o.npz", v_template=np.array([None]))
    refused("v_template: holds pickled objects", read_body_model, tmp_path / "o.npz")
    canary = Canary(tmp_path)
    for data in canary.pickles(2).values():
        refused("refused", read_body_model, as_bytes(tmp_path / "m.pkl", data))
    assert not canary.file.exists()
