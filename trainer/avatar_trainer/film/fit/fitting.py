"""The fit of the head model to a film: keyframes give identity and the skin's look, every frame is fitted to these."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from avatar_runtime import F32, F64, I64
from avatar_trainer.film.fit import landmark_fit, photometric, silhouette
from avatar_trainer.film.fit.images import bands
from avatar_trainer.film.fit.landmark_map import SKIN, LandmarkMap, seen_from
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.film.fit.solve import Prior, step
from avatar_trainer.film.fit.surface import SurfacePoints
from avatar_trainer.head import Head, Mesh, head_for, load_head_model, load_tracking_head

STAGES = ("landmarks", "skin", "outline")
SKIN_POINTS = 1400  # of the dense fit
NARROW_FACE = 6706  # vertices: ICT-FaceKit's face without ears, throat and forehead's edge comes first
# Of the dense fit of keyframes: (blurs of the band in millimetres of the face, steps).
KEY_LEVELS = (((4.0, 16.0), 8), ((2.0, 10.0), 8), ((1.2, 8.0), 8))
FRAME_LEVELS = ((1, 6), (2, 6))  # of every frame: (index of KEY_LEVELS, steps)
LANDMARK_ROUNDS = 3
LANDMARK_STEPS, FRAME_LANDMARK_STEPS = 25, 8
OUTLINE_FROM = 1  # the first level at which the outline is compared
LANDMARK_SHARE = 0.05  # weight of landmarks beside the skin
NORMALS_EVERY = 4  # steps
FACE_MM = 180.0
# Lids fold away when eyes open, so their skin has no look of its own: what a blink moves so far is not compared.
BLINKS, STILL_LID = ("eyeBlinkLeft", "eyeBlinkRight"), 0.001  # metres
LEAST_SIGMA = 0.5  # pixels
LANDMARK_STRENGTH, DENSE_STRENGTH = 20.0, 1.5  # of the identity's prior: frames; share of the frames
CHUNK = 48  # frames that are fitted at once

Grey = npt.NDArray[np.uint8]
Said = Callable[[str], None]


@dataclass(frozen=True)
class Seen:
    """What the networks saw in T frames."""

    places: F64  # [T, 478, 2] pixels
    scores: F64  # [T, 52]
    rotation: F64  # [T, 3, 3] camera from head, about right
    size: tuple[int, int]  # width, height

    def of(self, rows: I64) -> Seen:
        """Some frames."""
        return replace(self, places=self.places[rows], scores=self.scores[rows], rotation=self.rotation[rows])


class Surface:
    """The head's points that are compared with the pictures: landmarks, then skin."""

    def __init__(self, head: Head, known: LandmarkMap, skin: I64) -> None:
        self.head, self.known, self.skin = head, known, skin
        corners, share = known.triangle_corners[:SKIN], known.barycentric[:SKIN]
        self.landmarks = SurfacePoints.on_triangles(head, corners, share)
        self.outline, self.outline_weight = silhouette.candidates(head)
        self.points = SurfacePoints.joined(
            self.landmarks,
            SurfacePoints.at_vertices(head, self.skin),
            SurfacePoints.at_vertices(head, self.outline),
        )
        self.dense = np.arange(SKIN, SKIN + SKIN_POINTS)
        self.rim = np.arange(SKIN + SKIN_POINTS, len(self.points.neutral))

    @staticmethod
    def of_model(known: LandmarkMap, seed: int) -> Surface:
        """Of the head model; `seed` chooses the vertices of the skin."""
        head = load_head_model()
        lids = np.maximum(*(np.linalg.norm(head.expression(name), axis=1) for name in BLINKS))
        skin = np.flatnonzero(head.in_part("face")[:NARROW_FACE] & (lids[:NARROW_FACE] < STILL_LID))
        chosen = np.random.default_rng(seed).choice(skin, SKIN_POINTS, replace=False)
        return Surface(head, known, np.sort(chosen))

    def of_person(self, identity: F64) -> Surface:
        """The same points of a person, whose own head has lids that close on its eyes, and no identity modes."""
        return Surface(head_for(identity), self.known, self.skin)

    def vertices(self, identity: F64) -> F64:
        """[V, 3] of the person at rest."""
        moved: F64 = self.head.vertices + np.tensordot(identity, self.head.identity.astype(np.float64), 1)
        return moved

    def normals(self, identity: F64) -> F64:
        """[V, 3] at rest."""
        found: F64 = Mesh(self.vertices(identity), self.head.triangles).vertex_normals
        return found

    def on_outline(self, fit: Fit, size: tuple[int, int]) -> F64:
        """[T, C] the weight of each of `rim` where it is on the outline of the head."""
        coarse, rows = load_tracking_head(self.head)
        expressions = self.head.expressions[:, rows].astype(np.float64)
        at_rest = self.vertices(fit.identity)
        seen = silhouette.outline(
            fit,
            at_rest[rows] + np.tensordot(fit.weights, expressions, 1),
            coarse.triangles,
            size,
            self.points.posed(fit.identity, fit.weights)[:, self.rim],
            self.normals(fit.identity)[self.outline],
        )
        return seen * self.outline_weight


def landmarks_of(seen: Seen, fit: Fit, known: LandmarkMap, own: F64 | None = None) -> landmark_fit.Landmarks:
    """Where the mapped points are, after what is known of the network's errors; `own`: this face's, by `own_errors`."""
    yaw, pitch = seen_from(fit.rotation, fit.translation)
    places = known.corrected(seen.places, yaw, pitch, seen.scores)
    sigma = known.sigma_at(yaw)
    if own is not None:
        places = places - known.placed(own, seen.places)
        sigma = sigma * np.sqrt(1 - known.film_share)
    size, _ = known.frame(seen.places)
    sigma = np.maximum(sigma[:, :SKIN] * size[:, None], LEAST_SIGMA)
    return landmark_fit.Landmarks(places[:, :SKIN], sigma, np.arange(SKIN))


def own_errors(surface: Surface, seen: Seen, fit: Fit) -> F64:
    """[478] complex, in sizes of the face: what of the landmarks' errors stays the same over a film, by a fit to it."""
    away = np.zeros_like(seen.places)
    found = landmarks_of(seen, fit, surface.known).places
    camera = fit.in_camera(surface.landmarks.posed(fit.identity, fit.weights))
    away[:, :SKIN] = found - fit.pixels(camera)
    return surface.known.of_film(away, seen.places)


def prior_of(seen: Seen, fit: Fit, known: LandmarkMap, strength: float) -> Prior:
    """Weights as MediaPipe has them, each with the deviation that it has proved to have."""
    weights, sigma = known.prior(seen.scores, *seen_from(fit.rotation, fit.translation))
    return Prior(weights, sigma, strength, fit.focal, 0.0)


@dataclass(frozen=True)
class Keyframes:
    """What they give to all other frames."""

    fit: Fit
    own: F64  # [478] as `own_errors`
    looks: tuple[photometric.Look, ...]  # one a level


def fit_keyframes(
    surface: Surface,
    seen: Seen,
    grey: Sequence[Grey],
    masks: Sequence[Grey],
    focal: float,
    principal: F64,
    said: Said,
    stage: str,
) -> Keyframes:
    """Identity, and pose and weights of the keyframes; `stage`: the last of STAGES that is done."""
    known, modes = surface.known, len(surface.head.identity)
    fit = landmark_fit.begin(seen.places, seen.rotation, principal, focal, len(known.names), modes)
    own: F64 | None = None
    for _ in range(LANDMARK_ROUNDS):
        prior = prior_of(seen, fit, known, LANDMARK_STRENGTH)
        fit = landmark_fit.fitted(
            fit, surface.landmarks, landmarks_of(seen, fit, known, own), prior, LANDMARK_STEPS, said
        )
        own = own_errors(surface, seen, fit)
    assert own is not None
    prior = prior_of(seen, fit, known, DENSE_STRENGTH * len(seen.places))
    looks = []
    for level, (_, steps) in enumerate(KEY_LEVELS if stage != STAGES[0] else ()):
        outlined = level >= OUTLINE_FROM and stage == STAGES[2]
        edges = [silhouette.edge_distance(mask) for mask in masks] if outlined else ()
        fit, look = dense(surface, fit, seen, grey, level, steps, prior, own, None, edges)
        looks.append(look)
        said(f"skin: level {level + 1} of {len(KEY_LEVELS)}, identity {np.linalg.norm(fit.identity):.2f}")
    return Keyframes(fit, own, tuple(looks))


def dense(
    surface: Surface,
    fit: Fit,
    seen: Seen,
    grey: Sequence[Grey],
    level: int,
    steps: int,
    prior: Prior,
    own: F64 | None,
    look: photometric.Look | None,
    edges: Sequence[F32] = (),
) -> tuple[Fit, photometric.Look]:
    """`fit` after some steps on pictures of one band; without a `look` that of these frames.

    `edges`: of the masks, as `silhouette.edge_distance` makes them; none: the outline is not compared.
    """
    (fine, wide), _ = KEY_LEVELS[level]
    scale = landmark_fit.face_pixels(seen.places) / FACE_MM
    images = [bands(one, fine * scale, wide * scale) for one in grey]
    landmarks = landmarks_of(seen, fit, surface.known, own)
    found = look
    for count in range(steps):
        if count % NORMALS_EVERY == 0:
            normals = surface.normals(fit.identity)[surface.skin]
            rim = surface.on_outline(fit, seen.size) if edges else None
        skin, found = photometric.rows(fit, surface.points, surface.dense, normals, images, look)
        marks = landmark_fit.rows(fit, surface.points, landmarks, landmark_fit.TOGETHER * LANDMARK_SHARE)
        compared = [skin, marks]
        if edges and rim is not None:
            compared.append(silhouette.rows(fit, surface.points, surface.rim, rim, edges, scale * FACE_MM))
        fit = step(surface.points, fit, compared, prior)
    assert found is not None
    return fit, found


def fit_frames(
    surface: Surface,
    keys: Keyframes,
    seen: Seen,
    grey: Callable[[I64], Sequence[Grey]],
    said: Callable[[int], None],
) -> Fit:
    """Every frame, by the identity and the look of the keyframes; `grey` reads pictures of some frames."""
    known, parts = surface.known, []
    surface = surface.of_person(keys.fit.identity)
    none = np.zeros(len(surface.head.identity))
    for begin in range(0, len(seen.places), CHUNK):
        rows = np.arange(begin, min(begin + CHUNK, len(seen.places)))
        some = seen.of(rows)
        fit = landmark_fit.begin(
            some.places,
            some.rotation,
            keys.fit.principal,
            keys.fit.focal,
            len(known.names),
            len(none),
        )
        for _ in range(2):
            prior = replace(prior_of(some, fit, known, 1.0), identity=False)
            fit = landmark_fit.fitted(
                fit, surface.landmarks, landmarks_of(some, fit, known, keys.own), prior, FRAME_LANDMARK_STEPS
            )
        prior = replace(prior_of(some, fit, known, 1.0), identity=False)
        pictures = grey(rows)
        for level, steps in FRAME_LEVELS if keys.looks else ():
            fit, _ = dense(surface, fit, some, pictures, level, steps, prior, keys.own, keys.looks[level])
        parts.append(fit)
        said(int(rows[-1]) + 1)
    return replace(
        parts[0],
        identity=keys.fit.identity,
        weights=np.concatenate([part.weights for part in parts]),
        rotation=np.concatenate([part.rotation for part in parts]),
        translation=np.concatenate([part.translation for part in parts]),
    )
