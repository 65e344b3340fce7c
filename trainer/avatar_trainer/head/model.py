"""The head model: ICT-FaceKit's mesh and shapes, and heads on this mesh."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from avatar_trainer.head.mesh import Array, Mesh, smoothstep

DATA = Path(__file__).parent / "data"
GREY = 128  # display sRGB, of 255; the model has no colours

# ICT's lips always cover the teeth, also with an open jaw; these shares of other shapes part them in jawOpen.
LIPS_OF_JAW_OPEN = {"mouthLowerDown": 0.85, "mouthUpperUp": 0.4}

# ICT's mouthClose shuts a jaw that is wide open; by itself it would lift the lips over the nose.
MOUTH_CLOSE_SHARE = 0.2

# ICT's cheekPuff hardly shows from the front.
CHEEK_PUFF_GAIN = 1.6

# ICT's eyeBlink leaves a slit open, at the inner corner the longest: its gain at the inner and the outer corner, and
# where these lie, metres from the eye's centre towards the temple.
BLINK_GAIN, CORNERS = (1.27, 1.04), (-0.009, 0.009)

# Rotation of an eyeball by a full eyeLook weight, radians about (x, y): x down, y towards the subject's left.
EYE_TURN: dict[str, tuple[float, float]] = {
    "eyeLookUpLeft": (-0.30, 0.0),
    "eyeLookDownLeft": (0.36, 0.0),
    "eyeLookInLeft": (0.0, -0.5),
    "eyeLookOutLeft": (0.0, 0.5),
    "eyeLookUpRight": (-0.30, 0.0),
    "eyeLookDownRight": (0.36, 0.0),
    "eyeLookInRight": (0.0, 0.5),
    "eyeLookOutRight": (0.0, -0.5),
}


@dataclass(frozen=True)
class Head(Mesh):
    """A head with colours, parts and shapes."""

    colors: Array  # f64 [V, 3], display sRGB, 0..1
    part: Array  # i64 [F], index into part_names
    part_names: tuple[str, ...]
    expression_names: tuple[str, ...]  # 51 ARKit names, all but tongueOut
    expressions: Array  # f32 [K, V, 3], metres
    identity: Array  # f32 [M, V, 3], metres for one standard deviation

    def in_part(self, *names: str) -> Array:
        """Mask of the vertices [V] that a triangle of these parts uses."""
        mask = np.zeros(len(self.vertices), bool)
        mask[self.triangles[self.triangles_in(*names)]] = True
        return mask

    def triangles_in(self, *names: str) -> Array:
        """Mask of the triangles [F] of these parts."""
        mask: Array = np.isin(self.part, [self.part_names.index(n) for n in names])
        return mask

    def expression(self, name: str) -> Array:
        """Offsets [V, 3] of one ARKit shape at full weight."""
        offsets: Array = self.expressions[self.expression_names.index(name)]
        return offsets

    @cached_property
    def eye_centres(self) -> Array:
        """Centres [2, 3] of the left and right eyeball: the sphere nearest to it."""
        centres = []
        for name in ("left_eye", "right_eye"):
            x = self.vertices[self.in_part(name)]
            system = np.c_[2 * x, np.ones(len(x))]
            centres.append(np.linalg.lstsq(system, (x**2).sum(axis=1), rcond=None)[0][:3])
        return np.array(centres)


def neck_height(vertices: Array) -> Array:
    """Height [V] in metres across the neck, which leans forward.

    Chin, jaw and skull lie above -0.065, throat and nape below.
    """
    height: Array = vertices[:, 1] + 0.8 * vertices[:, 2]
    return height


def smooth_over_mesh(head: Head, values: Array, rounds: int) -> Array:
    """Vertex values averaged `rounds` times with those of their neighbours."""
    edges = np.concatenate([head.triangles[:, [i, j]] for i in range(3) for j in range(3) if i != j])
    degree = np.maximum(np.bincount(edges[:, 0], minlength=len(values)), 1)
    for _ in range(rounds):
        values = 0.5 * values + 0.5 * np.bincount(edges[:, 0], values[edges[:, 1]], len(values)) / degree
    return values


@cache
def head_arrays() -> dict[str, Array]:
    """What data/head_model.npz holds, as it is stored: centimetres, sparse expressions. Not to be written to.

    neutral f32 [V, 3]; triangles [F, 3]; part [F] and part_names; expression_names [K], whose offsets f16 are rows
    expression_ptr[k]..expression_ptr[k + 1] of expression_offset, of the vertices in expression_index; identity
    f16 [M, V, 3], for one standard deviation.
    """
    with np.load(DATA / "head_model.npz", allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def head_of(vertices: Array, colors: Array, modes: int | None = None) -> Head:
    """The head with these vertices f32 [V, 3], centimetres; colors u8 [V, 3]; the first `modes` identity modes."""
    data = head_arrays()
    ptr = data["expression_ptr"]
    expressions = np.zeros((len(ptr) - 1, *vertices.shape), np.float32)
    for k, shape in enumerate(expressions):
        rows = slice(ptr[k], ptr[k + 1])
        shape[data["expression_index"][rows]] = data["expression_offset"][rows].astype(np.float32) / 100
    names = tuple(data["expression_names"].tolist())
    for lips, share in LIPS_OF_JAW_OPEN.items():
        for side in ("Left", "Right"):
            expressions[names.index("jawOpen")] += share * expressions[names.index(lips + side)]
    expressions[names.index("mouthClose")] *= MOUTH_CLOSE_SHARE
    expressions[names.index("cheekPuff")] *= CHEEK_PUFF_GAIN
    return Head(
        vertices=vertices.astype(np.float64) / 100,
        colors=colors.astype(np.float64) / 255,
        triangles=data["triangles"].astype(np.int64),
        part=data["part"].astype(np.int64),
        part_names=tuple(data["part_names"].tolist()),
        expression_names=names,
        expressions=expressions,
        identity=data["identity"][:modes].astype(np.float32) / 100,
    )


def load_head_model() -> Head:
    """ICT's own neutral in one grey, 60 identity modes, and lids that close."""
    neutral = head_arrays()["neutral"]
    return closing_lids(head_of(neutral, np.full(neutral.shape, GREY, np.uint8)))


def closing_lids(head: Head) -> Head:
    """`head` whose eyelids, moved by eyeBlink, meet along their whole length at the same weight."""
    expressions = head.expressions.copy()
    for side, name in enumerate(("eyeBlinkLeft", "eyeBlinkRight")):
        temporal = (head.vertices[:, 0] - head.eye_centres[side, 0]) * (1, -1)[side]
        inner, outer = BLINK_GAIN
        gain = inner + (outer - inner) * smoothstep(temporal, *CORNERS)
        expressions[head.expression_names.index(name)] *= gain[:, None]
    return replace(head, expressions=expressions)


def part_of(head: Head, rows: Array, triangles: Array, part: Array) -> Head:
    """The vertices `rows`; `triangles` [F, 3] index them, `part` [F] is theirs."""
    return replace(
        head,
        vertices=head.vertices[rows],
        colors=head.colors[rows],
        triangles=triangles,
        part=part,
        expressions=head.expressions[:, rows],
        identity=head.identity[:, rows],
    )
