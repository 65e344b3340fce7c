"""Worked numbers of the porter's guide: one vertex through `skin`, one Gaussian through `bind_surface`, by hand.

`python docs/tools/worked_numbers.py` prints them. Plain NumPy by the formulas of SPEC.md, on trained samples; it shares
no code with the runtime, and ends with an error where the samples' own reference vectors disagree.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
ROOT = Path(__file__).resolve().parents[2]
TRAINED = ROOT / "samples" / "trained"
CONSTANTS = ROOT / "schema" / "avatar_schema" / "v1" / "constants.json"
TYPES = {"F64": "<f8", "F32": "<f4", "U32": "<u4", "U16": "<u2", "I64": "<i8", "I32": "<i4"}
CASE = "posed"


def safetensors(path: Path) -> dict[str, Array]:
    """All tensors of a file."""
    data = path.read_bytes()
    (size,) = struct.unpack_from("<Q", data)
    header = json.loads(data[8 : 8 + size])
    return {
        name: np.frombuffer(
            data[8 + size + about["data_offsets"][0] : 8 + size + about["data_offsets"][1]],
            TYPES[about["dtype"]],
        ).reshape(about["shape"])
        for name, about in header.items()
        if name != "__metadata__"
    }


def tolerance(bundle: Path, tensor: str) -> float:
    """The absolute tolerance that cases.json states for a tensor."""
    document = json.loads((bundle / "reference" / "cases.json").read_text("utf-8"))
    outputs = [
        out for case in document["cases"] for stage in case["stages"] for out in stage["outputs"].values()
    ]
    return float(next(out["atol"] for out in outputs if out["tensor"] == tensor))


def show(value: Any, digits: int = 6) -> str:
    """Numbers in a line."""
    return "  ".join(
        f"{x + 0.0:.{digits}f}".replace("-0." + "0" * digits, "0." + "0" * digits) for x in np.ravel(value)
    )


def compare(lines: list[str], name: str, got: Array, want: Array, limit: float) -> None:
    """The reference's numbers; an error where ours differ by more than it allows."""
    assert np.abs(got - want).max() <= limit, (name, got, want)
    lines.append(f"{'reference/ has':22s} {show(want)}   within its tolerance of {limit:.1e}")


def skin_numbers() -> str:
    """One vertex of the head of Gaussian blendshapes that hangs on two joints."""
    bundle = TRAINED / "head_blendshapes"
    rig, golden = (
        safetensors(bundle / "rig.safetensors"),
        safetensors(bundle / "reference" / "vectors.safetensors"),
    )
    names = json.loads((bundle / "avatar.json").read_text("utf-8"))["joints"]
    ptr, weights = rig["skin.row_ptr"], rig["skin.weight"]
    rows = golden["vertices"]
    spread = [min(weights[ptr[v] : ptr[v + 1]]) if ptr[v + 1] - ptr[v] == 2 else 0 for v in rows]
    row = int(np.argmax(spread))
    vertex, start, end = int(rows[row]), int(ptr[rows[row]]), int(ptr[rows[row] + 1])
    v, matrices = (
        golden[f"{CASE}/morph/vertices"][row].astype(float),
        golden[f"{CASE}/joints/skin_matrix"].astype(float),
    )
    lines = [f"row {row} of the reference is vertex {vertex}", f"{'after morph, metres':22s} {show(v)}", ""]
    total = np.zeros((3, 4))
    for entry in range(start, end):
        joint, weight = int(rig["skin.column"][entry]), float(weights[entry])
        lines.append(
            f"entry {entry}: joint {joint} ({names[joint]}), weight {weight:.6f}, skin matrix, rows 0 to 2:"
        )
        lines += [f"    {show(line)}" for line in matrices[joint][:3]]
        total += weight * matrices[joint][:3]
    lines += ["", "weighted sum:", *(f"    {show(line)}" for line in total), ""]
    posed = total @ [*v, 1]
    late = rig["late_morphs.row_ptr"]
    lines.append(
        f"{'late morphs':22s} {'none of this vertex' if late[vertex] == late[vertex + 1] else 'some'}"
    )
    lines.append(f"{'sum times vertex':22s} {show(posed)}")
    compare(
        lines,
        "skin",
        posed,
        golden[f"{CASE}/skin/posed_vertices"][row],
        tolerance(bundle, f"{CASE}/skin/posed_vertices"),
    )
    return fenced(lines)


def unit(x: Array) -> Array:
    return x / np.linalg.norm(x)


def times(p: Array, q: Array) -> Array:
    """Hamilton product, w x y z."""
    w, x, y, z = p
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]) @ q


def quaternion(m: Array) -> Array:
    """Of a rotation matrix, w x y z, w not negative."""
    (a, b, c), (d, e, f), (g, h, i) = m
    four = np.array(
        [[1 + a + e + i, h - f, c - g, d - b], [h - f, 1 + a - e - i, b + d, c + g],
         [c - g, b + d, 1 - a + e - i, f + h], [d - b, c + g, f + h, 1 - a - e + i]]
    )  # fmt: skip
    q = unit(four[np.argmax(np.diag(four))])
    return -q if q[0] < 0 else q


def frame(a: Array, b: Array, c: Array) -> Array:
    """Of a triangle by SplattingAvatar, columns X Y Z."""
    z = unit(b - a)
    m = unit(np.cross(z, c - a))
    x = unit(np.cross(z, m))
    return np.stack([x, unit(np.cross(z, x)), z], axis=1)


def area(a: Array, b: Array, c: Array) -> float:
    return float(np.linalg.norm(np.cross(b - a, c - a))) / 2


def surface_numbers() -> str:
    """One Gaussian of the SplattingAvatar head, rules `vertex_quaternion`, `normal`, `linear_area`, `w_positive`."""
    bundle = TRAINED / "head_splatting"
    manifest = json.loads((bundle / "avatar.json").read_text("utf-8"))
    rules, u = manifest["rules"], manifest["units"]["training_per_bundle"]
    assert (rules["rotation"], rules["position"], rules["scale"], rules["quaternion_sign"], rules["normal"]) == (
        "vertex_quaternion", "normal", "linear_area", "w_positive", "unit",
    )  # fmt: skip
    constants = json.loads(CONSTANTS.read_text("utf-8"))
    constants = constants.get("constants", constants)
    normal_floor, quaternion_floor = (
        constants[name]["value"] / u**2 for name in ("normal_floor", "quaternion_floor")
    )
    embedding = safetensors(bundle / "embedding.safetensors")
    golden = safetensors(bundle / "reference" / "vectors.safetensors")
    triangles, canonical = embedding["triangles"].astype(int), embedding["canonical_vertices"].astype(float)
    around_ptr, around = (
        embedding["vertex_triangle_ptr"].astype(int),
        embedding["vertex_triangle"].astype(int),
    )
    posed = dict(
        zip(golden["vertices"].tolist(), golden[f"{CASE}/skin/posed_vertices"].astype(float), strict=True)
    )

    def ring(vertex: int) -> Array:
        return around[around_ptr[vertex] : around_ptr[vertex + 1]]

    def kept(i: int) -> bool:
        near = triangles[np.concatenate([ring(v) for v in embedding["vertex_ids"][i]])]
        return set(near.ravel().tolist()) <= posed.keys() and abs(embedding["displacement"][i]) > 1e-3

    row, i = next((row, int(i)) for row, i in enumerate(golden["rows"]) if kept(int(i)))
    k, b, d = (
        int(embedding["triangle"][i]),
        embedding["barycentric"][i].astype(float),
        float(embedding["displacement"][i]),
    )
    corners = triangles[k]
    lines = [f"row {row} of the reference is Gaussian {i}: triangle {k}, vertices {corners.tolist()}"]
    lines += [f"{'barycentrics b':22s} {show(b)}", f"{'displacement d, metres':22s} {show([d])}", ""]
    normals, quaternions = [], []
    for v in corners:
        normal, q = np.zeros(3), np.zeros(4)
        for t in ring(v):
            p, p0 = [posed[int(c)] for c in triangles[t]], canonical[triangles[t]]
            normal += np.cross(p[1] - p[0], p[2] - p[0])
            q += area(*p0) * quaternion(frame(*p) @ frame(*p0).T)
        normals.append(normal / max(float(np.linalg.norm(normal)), normal_floor))
        quaternions.append(q / max(float(np.linalg.norm(q)), quaternion_floor))
        lines.append(f"vertex {v}, which {len(ring(v))} triangles share")
        lines += [f"    {'posed':18s} {show(posed[int(v)])}", f"    {'normal':18s} {show(normals[-1])}"]
        lines.append(f"    {'quaternion wxyz':18s} {show(quaternions[-1])}")
    p = b @ np.array([posed[int(v)] for v in corners])
    n, q_mesh = unit(b @ np.array(normals)), b @ np.array(quaternions)
    mean = p + d * n
    turned = times(unit(q_mesh), embedding["local_quat_wxyz"][i].astype(float))
    lines += ["", f"{'P = sum b_c V_c':22s} {show(p)}", f"{'n = unit(sum b_c n_c)':22s} {show(n)}"]
    lines += [f"{'P + d n':22s} {show(mean)}", f"{'q_mesh = sum b_c q_c':22s} {show(q_mesh)}"]
    lines.append(f"{'unit(q_mesh) q_local':22s} {show(turned)}")
    ratio = area(*[posed[int(v)] for v in corners]) / area(*canonical[corners])
    stored = golden[f"{CASE}/blend/log_scale"][row].astype(float)
    scale = stored + np.log(ratio)
    lines += [f"{'a, ratio of areas':22s} {show([ratio])}", f"{'log scale stored, l':22s} {show(stored)}"]
    lines.append(f"{'l + ln a':22s} {show(scale)}")
    world = golden[f"{CASE}/pose/world_from_avatar"]
    moved, turned = world[:3, :3] @ mean + world[:3, 3], times(quaternion(world[:3, :3]), turned)
    lines += ["", f"{'X mean':22s} {show(moved)}   X = world_from_avatar"]
    at = f"{CASE}/bind"
    compare(lines, "mean", moved, golden[f"{at}/mean"][row], tolerance(bundle, f"{at}/mean"))
    lines.append(f"{'quat(X) q':22s} {show(turned)}")
    compare(lines, "quat", turned, golden[f"{at}/quat_wxyz"][row], tolerance(bundle, f"{at}/quat_wxyz"))
    lines.append(f"{'log scale':22s} {show(scale)}")
    compare(lines, "scale", scale, golden[f"{at}/log_scale"][row], tolerance(bundle, f"{at}/log_scale"))
    return fenced(lines)


def fenced(lines: list[str]) -> str:
    return "\n".join(["```text", *lines, "```"])


if __name__ == "__main__":
    print(skin_numbers(), surface_numbers(), sep="\n\n")
