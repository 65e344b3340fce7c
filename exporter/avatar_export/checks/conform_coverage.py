"""What a reference does not test: rules, SH degrees, parts and thresholds that its avatar lacks or does not reach.

A port can repeat such a reference without having them. A rule that the avatar has counts as tested only if each other
value of it gives other numbers. BUNDLES names a conformance avatar for each item; those of rules stand in their table.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from avatar_runtime.avatar import Avatar
from avatar_runtime.backends.reference import ReferenceBackend
from avatar_runtime.conformance import Reference
from avatar_runtime.conformance.judge import judge
from avatar_runtime.conformance.model import CaseVectors, Step, Tensor
from avatar_runtime.conformance.stages import run_stage
from avatar_runtime.engine_pose import rests_bound
from avatar_runtime.rules import JOINT_ROTATIONS, names
from avatar_runtime.subset import subset
from avatar_schema import constants, families, rules

WRITTEN_BY = "python -m tests.conformance.bundles OUT"  # in a clone of the repository
_SHOWN = {name: {v.name: v.shown_by for v in rule.values if v.shown_by} for name, rule in rules().items()}
BUNDLES = {name: items for name, items in _SHOWN.items() if items} | {
    "SH degree": {"0": "still", "1": "skin_unturned", "2": "skin_head_bone", "3": "skin_polar"},
    "part": {"late morphs": "skin_polar", "pose correctives": "skin_polar", "appearance deltas": "skin_polar",
             "joints that expressions move": "skin_polar", "rest that is not the binding pose": "surface_unbound",
             "light of a scene": "lit_head"},
    "threshold": {"near plane": "edges", "behind the camera": "edges", "on no tile": "edges",
                  "clamp of the Jacobian": "edges", "equal depths": "edges", "colour below 0": "edges",
                  "quaternion without length": "edges", "opacity below 1/255": "edges",
                  "alpha above 0.99": "edges", "alpha below 1/255": "edges", "end of a pixel at 1e-4": "edges",
                  "floors of vertex normals and quaternions": "surface_fine"},
}  # fmt: skip
RULED = ("joints", "bind")  # the stages that rules change
FLOORLESS = 1e6  # times the training units a bundle unit: floors are divided by the square of that


@dataclass(frozen=True)
class Gap:
    """An item that a reference does not test."""

    kind: str  # a key of BUNDLES
    value: str  # a key of BUNDLES[kind]
    same_as: tuple[str, ...] = ()  # values that give the same numbers, where the avatar has the item

    @property
    def bundle(self) -> str:
        """A conformance avatar that tests it."""
        return BUNDLES[self.kind][self.value]

    @property
    def text(self) -> str:
        """`polar3 (skin_polar)`; for an item that the avatar has, what gives the same numbers."""
        same = f" here gives the numbers of {' and '.join(self.same_as)}" if self.same_as else ""
        return f"{self.value}{same} ({self.bundle})"


def gaps(avatar: Avatar, reference: Reference) -> tuple[Gap, ...]:
    """What `reference` does not test, in the order of BUNDLES; it belongs to `avatar`."""
    tested = {
        "SH degree": _degrees(avatar, reference),
        "part": _parts(avatar),
        "threshold": _thresholds(avatar, reference),
    }
    found = []
    for kind, items in BUNDLES.items():
        if kind in tested:
            found += [Gap(kind, value) for value in items if value not in tested[kind]]
        else:
            found += _rule_gaps(avatar, reference, kind)
    return tuple(found)


def gap_lines(found: Iterable[Gap]) -> list[str]:
    """What was not tested in words, a line for each kind; [] if all was."""
    kinds: dict[str, list[str]] = {}
    for gap in found:
        kinds.setdefault(gap.kind, []).append(gap.text)
    lines = [f"not tested, {kind}: {', '.join(texts)}" for kind, texts in kinds.items()]
    last = f"in brackets: a bundle that tests it; `{WRITTEN_BY}` in a clone of the repository writes them"
    return [*lines, last] if lines else []


def _rule_gaps(avatar: Avatar, reference: Reference, rule: str) -> Iterator[Gap]:
    has = _values(avatar, reference, rule)
    for value in BUNDLES[rule]:
        same = () if value not in has else tuple(_same(avatar, reference, rule, value))
        if value not in has or same:
            yield Gap(rule, value, same)


def _values(avatar: Avatar, reference: Reference, rule: str) -> set[str]:
    """The values of a rule that the reference's rows play."""
    rows, rules = reference.rows, avatar.rules
    kept = {g.binding for g in avatar.groups if ((rows >= g.first) & (rows < g.first + g.count)).any()}
    read = {
        "binding": True,
        "position": avatar.embedding is not None,
        "scale": avatar.embedding is not None,
        "quaternion_sign": rules.rotation == "vertex_quaternion",
        "anchor": "anchor" in kept,
    }
    if not read.get(rule, True):
        return set()
    return kept if rule == "binding" else {getattr(rules, rule)}


def _same(avatar: Avatar, reference: Reference, rule: str, value: str) -> Iterator[str]:
    """Other values of the rule whose outputs are within the tolerances in every case."""
    if rule == "binding":
        return
    rotations = [family for family in families() if avatar.rules.rotation in names("rotation", family)]
    known = names(rule)
    if rule in ("rotation", "position", "scale"):
        embedded = avatar.embedding is not None
        family = next(f for f in rotations if families()[f].embedded == embedded)
        known = names(rule, family)
    for other in known:
        if other == value or (other in JOINT_ROTATIONS and avatar.rules.rotation_joint is None):
            continue
        changed = replace(avatar, rules=replace(avatar.rules, **{rule: other}))
        if all(_repeats(changed, reference, stage) for stage in RULED):
            yield other


def _repeats(changed: Avatar, reference: Reference, stage: str, arrays: tuple[str, ...] = ()) -> bool:
    """Whether `changed` repeats a stage of the reference: all outputs, or those of `arrays`."""
    part = subset(changed, reference.rows, reference.vertices).avatar
    backend = ReferenceBackend(part)
    for vectors, step in _steps(reference, stage):
        inputs = {array: reference.tensors[name] for array, name in step.inputs.items()}
        with np.errstate(all="ignore"):
            got = run_stage(changed, backend, stage, step.profile, inputs, vectors.case.camera)
        verdicts = judge(step, got, reference.tensors)
        if not all(verdict.passed for array, verdict in verdicts.items() if array in (arrays or verdicts)):
            return False
    return True


def _steps(reference: Reference, stage: str) -> Iterator[tuple[CaseVectors, Step]]:
    for vectors in reference.cases:
        for step in vectors.steps:
            if step.stage == stage:
                yield vectors, step


def _degrees(avatar: Avatar, reference: Reference) -> set[str]:
    """The avatar's degree, if a kept row has coefficients of it that are not 0."""
    degree = avatar.sh_degree
    return (
        {str(degree)} if avatar.gaussians.sh[reference.rows, degree**2 : (degree + 1) ** 2].any() else set()
    )


def _parts(avatar: Avatar) -> set[str]:
    shapes, rig = avatar.blendshapes, avatar.rig
    has = {
        "late morphs": bool(avatar.eyelids),
        "pose correctives": rig is not None and len(rig.corrective_joints) > 0,
        "appearance deltas": shapes.appearance.entries > 0,
        "joints that expressions move": rig is not None and bool(rig.joint_basis.any()),
        "rest that is not the binding pose": rig is not None and not rests_bound(rig),
        "light of a scene": avatar.relight is not None,
    }
    return {name for name, found in has.items() if found}


def _thresholds(avatar: Avatar, reference: Reference) -> set[str]:
    """The thresholds that have rows or pixels on the side where they decide."""
    found = set()
    for _, step in _steps(reference, "activate"):
        quat = reference.tensors[step.inputs["quat_wxyz"]]
        found |= {"quaternion without length"} if (np.linalg.norm(quat, axis=1) == 0).any() else set()
    for vectors, step in _steps(reference, "project"):
        found |= _projected(avatar, reference, vectors, step)
    for _, step in _steps(reference, "raster"):
        found |= _composited(reference, step)
    turned = avatar.rules.rotation == "vertex_quaternion" or avatar.rules.position == "normal"
    if avatar.embedding is not None and turned:
        fine = replace(avatar, training_per_bundle=avatar.training_per_bundle * FLOORLESS)
        if not _repeats(fine, reference, "bind", ("mean", "quat_wxyz")):
            found.add("floors of vertex normals and quaternions")
    return found


def _projected(avatar: Avatar, reference: Reference, vectors: CaseVectors, step: Step) -> set[str]:
    camera, tensors = vectors.case.camera, reference.tensors
    out = {array: tensors[expected.tensor] for array, expected in step.outputs.items()}
    view = camera.camera_from_world.astype(np.float64)
    p = tensors[step.inputs["mean"]].astype(np.float64) @ view[:3, :3].T + view[:3, 3]
    z, drawn, near = p[:, 2], out["radius"] > 0, avatar.raster.near
    seen = np.where(drawn, z, 1.0)
    slope = np.abs(p[:, :2] / seen[:, None]) / [camera.tan_half_fov_x, camera.tan_half_fov_y]
    depth = out["depth"][drawn]
    has = {
        "near plane": (z > 0) & (z <= near),
        "behind the camera": z <= 0,
        "on no tile": (z > near) & ~drawn,
        "clamp of the Jacobian": drawn & (slope > constants()["frustum_clamp"]).any(axis=1),
        "equal depths": len(np.unique(depth)) < len(depth),
        "colour below 0": (out["rgb"][drawn] == 0).any(),
        "opacity below 1/255": drawn & (out["opacity"] < 1 / constants()["alpha_min_denominator"]),
    }
    return {name for name, found in has.items() if np.any(found)}


def _composited(reference: Reference, step: Step) -> set[str]:
    """Of the kept pixels of one image."""
    x: dict[str, Tensor] = {array: reference.tensors[name] for array, name in step.inputs.items()}
    if step.pixels is None or not len(x["order"]):
        return set()
    case = next(c.case for c in reference.cases if any(s is step for s in c.steps))
    pixels, order, c = reference.tensors[step.pixels].astype(np.int64), x["order"], constants()
    at = np.stack([pixels % case.camera.width, pixels // case.camera.width], axis=1)
    off = x["centre"][order].astype(np.float64)[:, None] - at
    conic = x["conic"][order].astype(np.float64)[:, None]
    power = -0.5 * (conic[..., 0] * off[..., 0] ** 2 + conic[..., 2] * off[..., 1] ** 2)
    power -= conic[..., 1] * off[..., 0] * off[..., 1]
    faintest = 1 / c["alpha_min_denominator"]
    # The others are fainter than half of the faintest.
    near = np.flatnonzero((power <= 0) & (power > np.log(faintest / 2) - 1))
    alpha = np.zeros(power.shape)
    opacity = x["opacity"][order].astype(np.float64)
    alpha.reshape(-1)[near] = opacity[near // len(pixels)] * np.exp(power.reshape(-1)[near])
    shown = np.where(alpha < faintest, 0.0, np.minimum(alpha, c["alpha_max"]))
    has = {
        "alpha above 0.99": alpha > c["alpha_max"],
        "alpha below 1/255": (alpha < faintest) & (alpha > faintest / 2),
        "end of a pixel at 1e-4": np.prod(1 - shown, axis=0) < c["transmittance_min"],
    }
    return {name for name, found in has.items() if np.any(found)}
