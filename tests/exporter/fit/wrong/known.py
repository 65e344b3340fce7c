"""Mistakes that a file tells by itself: values in another form, exchanged names, embeddings and regressors off."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from avatar_runtime.driving.arkit import ARKIT_NAMES
from tests.exporter.fit.wrong import inputs
from tests.exporter.fit.wrong.inputs import Arrays, Make, clip_of, embedded, folder_of, of_rows, rows_of
from tests.exporter.fit.wrong.line import KNOWN, Line

SH_C0 = 0.28209479
HALF, SOME = 0.5, 0.3  # of the rows
PAIRS = (("browInnerUp", "jawOpen"), ("mouthSmileLeft", "eyeBlinkRight"))
RIGGED = ("blendshapes", "head", "rigged")


def _sigmoid(x: Any) -> Any:
    return 1 / (1 + np.exp(-x))


def _rgb(dc: Any) -> Any:
    return np.clip(0.5 + SH_C0 * dc, 0, 1)


def _exchange_names(a: Sequence[Any], pairs: Sequence[tuple[str, str]]) -> list[Any]:
    order = {**{x: y for x, y in pairs}, **{y: x for x, y in pairs}}
    return [order.get(str(name), name) for name in a]


SIDES = [(n, n.replace("Left", "Right")) for n in ARKIT_NAMES if n.endswith("Left")]
ONE_SIDE = [("browDownLeft", "browDownRight")]


def _renamed(pairs: Sequence[tuple[str, str]]) -> Iterator[tuple[str, Make]]:
    def body(a: Arrays) -> None:
        a["expression_names"] = np.array(_exchange_names(a["expression_names"], pairs))

    def glb(document: Any) -> None:
        for mesh in document["meshes"]:
            mesh["extras"]["targetNames"] = _exchange_names(mesh["extras"]["targetNames"], pairs)

    yield from ((system, inputs.body_model(system, body)) for system in RIGGED)
    yield "lam", inputs.skin_glb(glb)


def _columns(a: Arrays, pair: tuple[str, str]) -> None:
    names = a["expression_names"].tolist()
    i, j = map(names.index, pair)
    a["shapedirs_expression"][:, :, [i, j]] = a["shapedirs_expression"][:, :, [j, i]]


def _deltas(i: int, j: int) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        for name in ("xyz_t", "rot_t", "scale_t", "opacity_t", "shs_t"):
            path = next(folder.glob("fix_chkpnt*")) / f"{name}.npy"
            values = np.load(path)
            values[..., [i, j]] = values[..., [j, i]]
            np.save(path, values)

    return edit


def _exchanged() -> dict[str, Make]:
    found: dict[str, Make] = {}
    for pair in PAIRS:
        found |= {f"{system}, names of {pair[0]}": make for system, make in _renamed([pair])}
        found |= {
            f"{system}, directions of {pair[0]}": inputs.body_model(
                system, lambda a, pair=pair: _columns(a, pair)
            )
            for system in RIGGED
        }
    return found | {
        f"blendshapes, deltas {i} and {j}": folder_of("blendshapes", _deltas(i, j))
        for i, j in ((2, 24), (7, 40))
    }


def _eyelids(sides: Sequence[str]) -> dict[str, Make]:
    def still(folder: Path) -> None:
        path = next(folder.glob("fix_chkpnt*")) / "eyelid.npy"
        values = np.load(path)
        values[..., [0, 1][: len(sides)]] = 0
        np.save(path, values)

    def flat(a: Arrays) -> None:
        for side in sides:
            a["shapedirs_expression"][:, :, a["expression_names"].tolist().index(f"eyeBlink{side}")] = 0

    def glb(document: Any) -> None:
        for mesh in document["meshes"]:
            for part in mesh["primitives"]:
                count = document["accessors"][part["attributes"]["POSITION"]]["count"]
                zero = {"componentType": 5126, "count": count, "type": "VEC3", "min": [0] * 3, "max": [0] * 3}
                document["accessors"].append(zero)
                for side in sides:
                    at = mesh["extras"]["targetNames"].index(f"eyeBlink{side}")
                    part["targets"][at] = {"POSITION": len(document["accessors"]) - 1}

    label = " and ".join(sides).lower()
    return {
        f"blendshapes, {label}": folder_of("blendshapes", still),
        f"head, {label}": inputs.body_model("head", flat),
        f"lam, {label}": inputs.skin_glb(glb),
    }


def _percent(every: bool) -> dict[str, Make]:
    def poses(folder: Path, sound: Path) -> Path:
        document = json.loads(sound.read_text())
        for frame in document["frames"]:
            weights = 100 * np.array(frame["expression"])
            frame["expression"] = (
                weights if every else np.where(np.arange(len(weights)) == 24, weights, weights / 100)
            ).tolist()
        (folder / "flame_params.json").write_text(json.dumps(document))
        return folder / "flame_params.json"

    percent = np.array([100 if every or name == "jawOpen" else 1 for name in ARKIT_NAMES])
    clip = clip_of(percent * np.abs(np.sin(np.arange(40)[:, None] / 9 + np.arange(len(ARKIT_NAMES)))))

    def head(given: Any, folder: Path) -> Any:
        source, options = given.head
        return source, options | {"poses": poses(folder, options["poses"])}

    label = "all" if every else "one"
    return {
        f"blendshapes, {label}": inputs.with_option("blendshapes", clips=clip),
        f"head, {label}": head,
        f"lam, {label}": inputs.with_option("lam", clips=clip),
    }


def _embeddings() -> dict[str, Make]:
    changes: dict[str, tuple[str, Callable[[Any], Any]]] = {
        "weights rolled": ("barycentric", lambda b: np.roll(b, 1, axis=1)),
        "triangles off by one": ("triangle", lambda t: np.maximum(t - 1, 0)),
    }
    return {
        f"{system}, {what}, {share:.0%}": folder_of(system, embedded(system, name, of_rows(change, share)))
        for system in ("trained", "body", "points")
        for what, (name, change) in changes.items()
        for share in (1, SOME)
    }


def _regressors() -> dict[str, Make]:
    def shifted(by: int) -> Callable[[Arrays], None]:
        return lambda a: a.update(J_regressor=np.roll(a["J_regressor"], by, axis=1))

    cases = ((system, by) for system in RIGGED for by in (1, 137))
    return {f"{system}, by {by}": inputs.body_model(system, shifted(by)) for system, by in cases}


def _zero(quat: Any) -> Any:
    return np.zeros_like(quat)


LINES = (
    Line("scales that are lengths, not logarithms", KNOWN, r"scales seem to be lengths",
         rows_of(("blendshapes", "trained", "lam"), "scale", np.exp, (1, SOME))),
    Line("scales in millimetres (plus ln 1000)", KNOWN, r"scales seem to be in millimetres",
         rows_of(("blendshapes", "trained", "lam"), "scale", lambda s: s + np.log(1000), (1, SOME))),
    Line("opacities of 0..1, not logits", KNOWN, r"seem to be no logits",
         rows_of(("blendshapes", "trained", "lam"), "opacity", _sigmoid, (1, HALF))),
    Line("opacities with the other sign", KNOWN, r"opacities seem to have the other sign",
         rows_of(("blendshapes", "trained", "points"), "opacity", np.negative, (1, HALF))),
    Line("colours of 0..255", KNOWN, r"RGB 0\.\.255|LAM stores plain RGB",
         rows_of(("blendshapes", "trained"), "dc", lambda c: 255 * _rgb(c), (1, SOME))
         | rows_of(("lam",), "dc", lambda c: 255 * c, (1, SOME))),
    Line("colours of 0..1 in place of SH", KNOWN, r"seem to be RGB 0\.\.1",
         rows_of(("blendshapes", "trained", "points"), "dc", _rgb, (1, HALF))),
    Line("rotations that are zero", KNOWN, r"rotations of .* are zero",
         rows_of(("blendshapes", "trained", "lam"), "rot", _zero, (1, 0.05))),
    Line("eyelids whose deltas are zero", KNOWN, r"are all zero: eyes never close",
         _eyelids(("Left", "Right")) | _eyelids(("Left",))),
    Line("names of left and right exchanged", KNOWN, r"on another side than their names",
         {f"{system}, all": make for system, make in _renamed(SIDES)}
         | {f"{system}, one pair": make for system, make in _renamed(ONE_SIDE)}),
    Line("names, directions or deltas of two expressions exchanged", KNOWN,
         r"than their names tell|up for down|moves like", _exchanged()),
    Line("weights of clips in percent", KNOWN, r"are the weights percent", _percent(True) | _percent(False)),
    Line("embeddings with rolled weights, or triangles off by one", KNOWN, r"look at the embedding", _embeddings()),
    Line("columns of the joint regressor shifted", KNOWN, r"columns of the joint regressor", _regressors()),
)  # fmt: skip
