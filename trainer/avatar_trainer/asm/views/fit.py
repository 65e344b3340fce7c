"""A still head's face and cameras from uncalibrated images of many sides: ASM appendix D.

Differences from the paper, or details that it does not state: the first shape is the template's, not a network's
(D.1); the first poses are found from its landmarks; texels of the uv map are sampled directly, at first coarse ones in
small images.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from avatar_export.asm import AsmFace, Binding, Template
from avatar_runtime import F32, F64, I64, AvatarError
from avatar_trainer.asm.kernels.consistency import Scene, consistency
from avatar_trainer.asm.kernels.mixture import mixture_weights_cpu
from avatar_trainer.asm.model import Face, TemplateTensors, posed, rotation_matrices
from avatar_trainer.asm.strain import Edges, strain_energy
from avatar_trainer.asm.views.energy import (
    FLAT,
    Cameras,
    Pairs,
    Priors,
    Texels,
    edge_energy,
    landmark_energy,
    prior_energy,
)
from avatar_trainer.asm.views.files import FEWEST_SEEN, Views
from avatar_trainer.asm.views.pose import pose_from_points
from avatar_trainer.asm.views.sight import (
    FEWEST_VIEWS,
    Sight,
    contour_pairs,
    contour_points,
    seen_texels,
    sight,
    texel_map,
    whole_patches,
)
from avatar_trainer.settings import MOST_ITERATIONS, expect_ranges


class Level(NamedTuple):
    """One part of a fit, from coarse to fine."""

    share: float  # of the iterations
    texels: int  # along an edge of the uv map; 0: no photometric consistency yet
    shrink: int  # pixels of the images along an edge of one averaged pixel
    reach: float  # pixels between contours, at most


LEVELS = (Level(0.2, 0, 1, 16.0), Level(0.25, 64, 4, 8.0), Level(0.3, 128, 2, 5.0), Level(0.25, 192, 1, 4.0))
# Steps of Adam, in the unit of each parameter: uv, logarithms, radians, metres.
STEPS = {
    "zeta": 7e-4,
    "pi_logit": 7e-3,
    "mu": 7e-4,
    "scale_tril": 7e-3,
    "rotation_vector": 4e-3,
    "translation": 4e-4,
    "log_scale": 4e-3,
}
TURN_STEP, SHIFT_STEP = 1.5e-3, 7e-4  # of the cameras: radians, metres
LAST_STEP = 0.1  # of the first, at the end of each level


@dataclass(frozen=True)
class ViewSettings:
    """How a face is fitted to images; ValueError for a value out of range.

    The weights are those of Eq. 23, in pixels. The paper's edge weight (0.4) dominated everything: chamfer distances
    are squared here, and some contour points have no counterpart. Its prior (1) has no unit; 0.1 goes with `Priors`.
    """

    landmarks: float = 0.001
    edge: float = 0.02
    photometric: float = 100.0
    prior: float = 0.1
    smooth: float = 100.0  # of `strain_energy`, which the paper does not have
    iterations: int = 120  # paper: 500, at a step of 1e-4
    refresh: int = 10  # iterations between two updates of what is seen

    def __post_init__(self) -> None:
        weights = dict.fromkeys(("landmarks", "edge", "photometric", "prior", "smooth"), (0.0, 1e6))
        expect_ranges(self, {**weights, "iterations": (4, MOST_ITERATIONS), "refresh": (1, MOST_ITERATIONS)})


@dataclass(frozen=True)
class Fitted:
    """The result."""

    face: Face
    vertices: F64  # [V, 3] metres; their scale is the template's, images cannot tell
    rotation: F64  # [N, 3, 3] cameras from world
    translation: F64  # [N, 3] metres
    energy: tuple[float, ...]  # of each level's last iteration


def fit(template: Template, binding: Binding, views: Views, settings: ViewSettings | None = None) -> Fitted:
    """The face and the cameras that the images show. Deterministic for one number of threads.

    Raises AvatarError if a view shares fewer than FEWEST_SEEN landmarks with the template, if they lie on a
    line, and if the fit does not stay finite.
    """
    problem = _Problem(template, binding, views, settings or ViewSettings())
    energies = tuple(problem.level(level) for level in LEVELS)
    rotation, translation = problem.poses()
    return Fitted(problem.face, problem.vertices().detach().double().numpy(), rotation, translation, energies)


def as_face(fitted: Fitted, template: Template, name: str) -> AsmFace:
    """The result to be stored: the binding and the neutral pose."""
    return AsmFace(name, template, fitted.face.binding(), (fitted.face.take("neutral"),))


class _Problem:
    """A fit in progress."""

    def __init__(self, template: Template, binding: Binding, views: Views, settings: ViewSettings) -> None:
        self.settings, self.views = settings, views
        self.template = TemplateTensors.of(template)
        self.triangles = template.triangles.astype(np.int64)
        self.face = Face.of(binding)
        self.first = Face.of(binding)
        columns, rows = shared_landmarks(template, views)
        self.landmark_rows = torch.from_numpy(rows)
        self.found = torch.from_numpy(views.landmarks[:, columns]).float()
        self.seen = torch.from_numpy(views.seen[:, columns])
        rotation, translation = first_poses(template, views)
        k = views.intrinsics
        self.cameras = Cameras(
            torch.from_numpy(rotation).float(),
            torch.zeros(len(rotation), 3, requires_grad=True),
            torch.from_numpy(translation).float().requires_grad_(),
            torch.tensor([k[0, 0], k[1, 1]]).float(),
            torch.tensor([k[0, 2], k[1, 2]]).float(),
        )
        for part in fields(Face):
            getattr(self.face, part.name).requires_grad_()
        self.edges = Edges.of(self.template.vertices, self.template.triangles)
        self.contours = contour_points(views.mask)

    def vertices(self) -> Tensor:
        """[V, 3] metres, the present face."""
        face = self.face
        share = mixture_weights_cpu(
            self.template.uv, face.pi_logit, face.mu + face.zeta[:, None], face.scale_tril
        )
        return posed(self.template, face, share)

    def poses(self) -> tuple[F64, F64]:
        """(R [N, 3, 3], t [N, 3]) of the present cameras."""
        cameras = self.cameras
        turned = rotation_matrices(cameras.turn.detach()).double() @ cameras.rotation.double()
        return turned.numpy(), cameras.translation.detach().double().numpy()

    def look(self) -> Sight:
        """What the present cameras see."""
        height, width = self.views.mask.shape[1:]
        vertices = self.vertices().detach().double().numpy()
        return sight(vertices, self.triangles, *self.poses(), self.views.intrinsics, (width, height))

    def level(self, level: Level) -> float:
        """Adam over one level; returns the last energy. Raises AvatarError if it does not stay finite."""
        settings = self.settings
        iterations = max(1, round(level.share * settings.iterations))
        groups: list[dict[str, Any]] = [
            {"params": [getattr(self.face, name)], "lr": step} for name, step in STEPS.items()
        ]
        groups.append({"params": [self.cameras.turn], "lr": TURN_STEP})
        groups.append({"params": [self.cameras.translation], "lr": SHIFT_STEP})
        optimiser = torch.optim.Adam(groups)
        decay = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda i: LAST_STEP ** (i / iterations))
        texels = self.texels(level) if level.texels and settings.photometric else None
        total = torch.zeros(())
        for i in range(iterations):
            if i % settings.refresh == 0:
                found = self.look()
                pairs = contour_pairs(found, self.contours, level.reach) if settings.edge else None
                scene = self.scene(level, texels, found) if texels else None
            total = self.energy(pairs, scene)
            optimiser.zero_grad()
            torch.autograd.backward(total)
            optimiser.step()
            decay.step()
            moved = [tensor for group in groups for tensor in group["params"]]
            if not all(bool(tensor.isfinite().all()) for tensor in (total, *moved)):
                raise AvatarError(
                    "the fit did not stay finite; are the landmarks those of one face?", file=self.views.file
                )
        return float(total.detach())

    def energy(self, pairs: Pairs | None, scene: Scene | None) -> Tensor:
        """Eq. 23."""
        settings, cameras, vertices = self.settings, self.cameras, self.vertices()
        total = settings.prior * prior_energy(self.face, self.first, Priors())
        total = total + settings.smooth * strain_energy(vertices, self.edges)
        marks = cameras.pixels(vertices[self.landmark_rows])
        total = total + settings.landmarks * landmark_energy(marks, self.found, self.seen)
        if pairs is not None:
            total = total + settings.edge * edge_energy(cameras, vertices, pairs)
        if scene is not None:
            alike = consistency(vertices, cameras.turned(), cameras.translation, scene)
            total = total + settings.photometric * alike
        return total

    def texels(self, level: Level) -> Texels:
        """Those of a level's map that FEWEST_VIEWS see at its beginning."""
        texels = texel_map(self.template.uv.double().numpy(), self.triangles, level.texels)
        seen = seen_texels(self.look(), texels).sum(axis=0) >= FEWEST_VIEWS
        rows = torch.from_numpy(np.flatnonzero(seen))
        return Texels(texels.size, texels.row[rows], texels.corner[rows], texels.barycentric[rows])

    def scene(self, level: Level, texels: Texels, found: Sight) -> Scene:
        """The level's images, and which patches of the map are seen now."""
        valid = np.pad(whole_patches(seen_texels(found, texels), texels), ((0, 0), (1, 1), (1, 1)))
        k = self.views.intrinsics / level.shrink
        return Scene(
            shrunk(self.views.intensity, level.shrink),
            np.diag(k)[:2].copy(),
            k[:2, 2].copy(),
            texels.row.numpy(),
            texels.corner.numpy(),
            texels.barycentric.numpy(),
            valid.astype(np.float32),
            FLAT,
        )


def shrunk(images: F32, factor: int) -> F32:
    """Images [N, H, W] whose pixels are means of factor x factor pixels; the remainder at the end is cut off."""
    n, height, width = (size // d for size, d in zip(images.shape, (1, factor, factor), strict=True))
    whole = images[:, : height * factor, : width * factor]
    smaller: F32 = whole.reshape(n, height, factor, width, factor).mean(axis=(2, 4), dtype=np.float32)
    return smaller


def shared_landmarks(template: Template, views: Views) -> tuple[I64, I64]:
    """(columns of the views' landmarks, the template's vertices) of the names that both have."""
    columns = [i for i, name in enumerate(views.landmark_names) if name in template.landmarks]
    rows = [template.landmarks[views.landmark_names[i]] for i in columns]
    return np.array(columns, np.int64), np.array(rows, np.int64)


def first_poses(template: Template, views: Views) -> tuple[F64, F64]:
    """(R [N, 3, 3], t [N, 3]) of cameras that project the template's landmarks to those of the images.

    Raises AvatarError as `fit`.
    """
    columns, rows = shared_landmarks(template, views)
    points = template.vertices[rows].astype(np.float64)
    rotations, translations = [], []
    for n, seen in enumerate(views.seen[:, columns]):
        field = f"views[{n}].landmarks"
        if seen.sum() < FEWEST_SEEN:
            raise AvatarError(
                f"has {seen.sum()} landmarks that the template has too; {FEWEST_SEEN} are the fewest",
                file=views.file,
                field=field,
            )
        try:
            found = pose_from_points(points[seen], views.landmarks[n, columns][seen], views.intrinsics)
        except (ValueError, np.linalg.LinAlgError) as error:
            raise AvatarError(f"give no pose: {error}", file=views.file, field=field) from None
        rotations.append(found[0])
        translations.append(found[1])
    return np.stack(rotations), np.stack(translations)
