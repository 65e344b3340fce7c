"""Who is filmed: a head with an identity, a skin, a shirt, hair and glasses, and how all of it moves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.captures.mesh_raster import Surface
from avatar_trainer.head import (
    NECK,
    ROOT,
    BodyModel,
    Head,
    Mesh,
    build_body_model,
    closing_lids,
    load_head_model,
    neck_height,
    smoothstep,
)
from avatar_trainer.head.person import with_own_lids
from samples.capture.extras import Extra, glasses, hair, worn_with
from samples.capture.eyes import lid_shade
from samples.capture.model import EYES, GLOSS, WET
from samples.films.motion import Motion
from samples.films.shirt import Shirt, folds, shirt, shoulders
from samples.films.skin import SKINS, painted
from samples.films.table import SCAN, Film
from samples.subjects.head import DATA, load_head
from samples.subjects.take import Take, joint_motion, performed, posed_vertices

Array = npt.NDArray[Any]

CLOTH_GLOSS = (0.0, 1.0)
CHIN_SHADE = 0.28  # of the light that the chin keeps from the throat
PERSONAL = 0.15  # how much the size of an expression differs from one person to the next
SHUT = ("eyeBlink", "jaw", "mouthClose", "eyeLook")  # shapes that are the same for all


@dataclass(frozen=True)
class Posed:
    """A figure in one pose, in its own space: +Y up, +Z towards the camera, metres."""

    vertices: Array  # [V, 3]
    normals: Array  # [V, 3]


@dataclass(frozen=True)
class Person:
    """The figure of a film; its vertices are those of the head, then what it wears."""

    film: Film
    head: Head
    body: BodyModel
    shirt: Shirt
    rigid: tuple[tuple[Extra, int], ...]  # what is worn, and the joint that it follows

    @property
    def names(self) -> tuple[str, ...]:
        """The expressions, in the head's order."""
        return self.head.expression_names

    @cached_property
    def surface(self) -> Surface:
        """The figure at rest, without light; skin under the shirt is left out."""
        image, uv = painted(load_head(), SKINS[self.film.skin])
        v, seen = len(self.head.vertices), ~self.shirt.hidden
        none = np.zeros(v, np.float32)
        surface = Surface(
            self.head.vertices, self.head.triangles[seen], uv[seen], image, none, none, np.ones(v, np.float32)
        )
        for extra in (self._cloth, *(extra for extra, _ in self.rigid)):
            surface = worn_with(surface, extra, extra.vertices, extra.shade, extra.shade)
        return surface

    @cached_property
    def _cloth(self) -> Extra:
        at = self.head.vertices[self.shirt.follows] + self.shirt.offset
        rgb = np.tile(self.film.shirt, (len(self.shirt.triangles), 1))
        return Extra(at, self.shirt.triangles, rgb, folds(at, self.film.seed), CLOTH_GLOSS)

    @cached_property
    def shade(self) -> Array:
        """Factor [V] on the light: lids over the eyeballs, the chin over the throat, roots of hair, folds."""
        rest = Mesh(self.head.vertices, self.head.triangles)
        own = lid_shade(self.head, rest)
        throat = smoothstep(neck_height(self.head.vertices), -0.045, -0.075) * self.head.in_part(
            "face", "head"
        )
        own = own * (1 - CHIN_SHADE * throat)
        return np.concatenate([own, self._cloth.shade, *(extra.shade for extra, _ in self.rigid)])

    @cached_property
    def gloss(self) -> tuple[Array, Array]:
        """(strength [V], exponent [V]) of the highlights."""
        table = np.tile(GLOSS["skin"], (len(self.shade), 1))
        v = len(self.head.vertices)
        table[:v][self.head.in_part(*WET)] = GLOSS["wet"]
        table[:v][self.head.in_part(*EYES)] = GLOSS["eye"]
        table[:v][self.head.in_part("mouth_socket", "eye_sockets"), 0] = 0
        begin = v + len(self.shirt.follows)
        table[v:begin] = CLOTH_GLOSS
        for extra, _ in self.rigid:
            table[begin : begin + len(extra.vertices)] = extra.gloss
            begin += len(extra.vertices)
        return table[:, 0], table[:, 1]

    @cached_property
    def above_shirt(self) -> Array:
        """[V] 1 of the head, hair and glasses, 0 of the shirt."""
        worn = [np.full(len(extra.vertices), float(joint == NECK)) for extra, joint in self.rigid]
        return np.concatenate([np.ones(len(self.head.vertices)), np.zeros(len(self.shirt.follows)), *worn])

    def take(self, motion: Motion) -> Take:
        """The motion as parameters of the body model."""
        take = performed(
            self.body, np.zeros(self.body.shapedirs_identity.shape[2]), self.names, motion.weights
        )
        take.pose[:, ROOT], take.pose[:, NECK] = motion.root, motion.neck
        return take

    def joint(self, take: Take, frame: int, joint: int) -> tuple[Array, Array]:
        """(R, t) of the trunk or the skull: a point x that follows it is at R x + t."""
        return joint_motion(self.body, take, frame, joint)

    def posed(self, take: Take, frame: int) -> Posed:
        """The figure in a frame of a take."""
        mesh = Mesh(posed_vertices(self.body, take, frame), self.head.triangles)
        cloth = mesh.vertices[self.shirt.follows] + self.shirt.offset
        vertices = [mesh.vertices, cloth]
        normals = [mesh.vertex_normals, Mesh(cloth, self.shirt.triangles).vertex_normals]
        for extra, joint in self.rigid:
            turn, shift = self.joint(take, frame, joint)
            vertices.append(extra.vertices @ turn.T + shift)
            normals.append(extra.vertex_normals @ turn.T)
        return Posed(np.concatenate(vertices), np.concatenate(normals))


def person(film: Film) -> Person:
    """The person of a film."""
    scan = load_head()
    head = closing_lids(scan) if film.identity == SCAN else _with_identity(scan, film.identity)
    trunk, triangles = shoulders(head)
    rgb = np.tile(film.shirt, (len(triangles), 1))
    rigid = [(Extra(trunk, triangles, rgb, folds(trunk, film.seed), CLOTH_GLOSS), ROOT)]
    if film.hair is not None:
        made = _fitted(hair, scan, head)
        tint = np.divide(film.hair, (0.215, 0.150, 0.105))
        rigid.append((replace(made, rgb=np.clip(made.rgb * tint, 0, 1)), NECK))
    if film.glasses:
        rigid.append((_fitted(glasses, scan, head), NECK))
    return Person(film, head, build_body_model(head), shirt(head), tuple(rigid))


def _with_identity(scan: Head, row: int) -> Head:
    """The scan's topology in a random shape, whose expressions are a little smaller or larger."""
    with np.load(DATA / "film_heads.npz", allow_pickle=False) as file:
        vertices = file["vertices"][row].astype(np.float64) / 100
    low = scan.in_part("face", "head") & (
        scan.vertices[:, 1] < -0.15
    )  # the bust stands where the scan's does
    vertices += (scan.vertices[low] - vertices[low]).mean(axis=0)
    rng = np.random.default_rng(1000 + row)
    size = 1 + PERSONAL * rng.uniform(-1, 0.7, len(scan.expression_names))
    size[[name.startswith(SHUT) for name in scan.expression_names]] = 1
    own = with_own_lids(load_head_model(), replace(scan, vertices=vertices))
    return replace(own, expressions=own.expressions * size[:, None, None].astype(np.float32))


def _fitted(make: Any, scan: Head, head: Head) -> Extra:
    """What was made for the scan, on another head: moved as the skull differs (affine)."""
    rows = np.flatnonzero(scan.in_part("face", "head") & (neck_height(scan.vertices) > -0.02))
    source = np.c_[head.vertices[rows], np.ones(len(rows))]
    back = np.linalg.lstsq(source, scan.vertices[rows], rcond=None)[0]
    like = replace(head, vertices=head.vertices @ back[:3] + back[3])
    made: Extra = make(like)
    return replace(made, vertices=(made.vertices - back[3]) @ np.linalg.inv(back[:3]))
