"""A still head's face and cameras from uncalibrated pictures of many sides: ASM appendix D.

Left open by the paper or otherwise here: the first shape is the template's, not a network's (D.1); the first poses
are found from its landmarks; texels of the uv map are looked up themselves, coarse ones in small pictures first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from avatar_export.asm.model import AsmFace, Binding, Template
from avatar_runtime.avatar import F64
from avatar_runtime.errors import AvatarError
from avatar_trainer.kernels.mixture import mixture_weights_cpu
from avatar_trainer.systems.asm_model import Face, TemplateTensors, posed, rotation_matrices
from avatar_trainer.systems.asm_views_energy import (
    Cameras,
    Priors,
    Texels,
    edge_energy,
    landmark_energy,
    photometric_energy,
    prior_energy,
    unwrapped,
)
from avatar_trainer.systems.asm_views_files import FEWEST_SEEN, Views
from avatar_trainer.systems.asm_views_pose import pose_from_points
from avatar_trainer.systems.asm_views_sight import (
    FEWEST_VIEWS,
    Sight,
    contour_pairs,
    contour_points,
    seen_texels,
    sight,
    texel_map,
    whole_patches,
)


class Level(NamedTuple):
    """One part of a fit."""

    iterations: int
    texels: int  # along an edge of the uv map; 0: no photometric consistency yet
    shrink: int  # pixels of the pictures that are made one
    reach: float  # pixels between contours, at most


@dataclass(frozen=True)
class ViewSettings:
    """What may be changed about a fit."""

    landmarks: float = 0.001  # weights of Eq. 23
    edge: float = 0.4
    photometric: float = 100.0
    prior: float = 1.0
    priors: Priors = field(default_factory=Priors)
    levels: tuple[Level, ...] = (Level(80, 0, 1, 24.0), Level(80, 64, 4, 12.0), Level(80, 128, 2, 8.0), Level(80, 192, 1, 6.0))
    refresh: int = 10  # iterations between two looks at what is seen


# Steps of Adam, in the unit of each parameter: radians, metres, uv, and logarithms.
STEPS = {
    "zeta": 5e-4,
    "pi_logit": 5e-3,
    "mu": 5e-4,
    "scale_tril": 5e-3,
    "rotation_vector": 3e-3,
    "translation": 3e-4,
    "log_scale": 3e-3,
}
TURN_STEP, SHIFT_STEP = 1e-3, 5e-4  # of the cameras: radians, metres
LAST_STEP = 0.1  # of the first, at the end of each level


@dataclass(frozen=True)
class Fitted:
    """What was found."""

    face: Face
    vertices: F64  # [V, 3] metres; their scale is the template's, pictures cannot tell
    rotation: F64  # [N, 3, 3] cameras from world
    translation: F64  # [N, 3] metres
    energy: tuple[float, ...]  # of each level's last iteration


def fit(template: Template, binding: Binding, views: Views, settings: ViewSettings | None = None) -> Fitted:
    """The face and the cameras that the pictures show."""
    chosen = settings or ViewSettings()
    problem = _Problem(template, binding, views, chosen)
    energies = tuple(problem.level(level) for level in chosen.levels)
    rotation, translation = problem.poses()
    return Fitted(problem.face, problem.vertices().detach().double().numpy(), rotation, translation, energies)


class _Problem:
    """A fit under way."""

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
        self.contours = contour_points(views.mask)

    def vertices(self) -> Tensor:
        """[V, 3] metres, as the face is now."""
        face = self.face
        share = mixture_weights_cpu(
            self.template.uv, face.pi_logit, face.mu + face.zeta[:, None], face.scale_tril
        )
        return posed(self.template, face, share)

    def poses(self) -> tuple[F64, F64]:
        """(R [N, 3, 3], t [N, 3]) of the cameras, as they are now."""
        cameras = self.cameras
        turned = rotation_matrices(cameras.turn.detach()).double() @ cameras.rotation.double()
        return turned.numpy(), cameras.translation.detach().double().numpy()

    def look(self) -> Sight:
        """What is seen now."""
        height, width = self.views.mask.shape[1:]
        vertices = self.vertices().detach().double().numpy()
        return sight(vertices, self.triangles, *self.poses(), self.views.intrinsics, (width, height))

    def level(self, level: Level) -> float:
        """Adam over one level; the last energy."""
        settings = self.settings
        groups = [{"params": [getattr(self.face, name)], "lr": step} for name, step in STEPS.items()]
        groups += [{"params": [self.cameras.turn], "lr": TURN_STEP}, {"params": [self.cameras.translation], "lr": SHIFT_STEP}]
        optimiser = torch.optim.Adam(groups)
        decay = torch.optim.lr_scheduler.LambdaLR(
            optimiser, lambda i: LAST_STEP ** (i / level.iterations)
        )
        pictures = shrunk(torch.from_numpy(self.views.intensity), level.shrink)
        texels = None
        if level.texels and settings.photometric:
            texels = texel_map(self.template.uv.double().numpy(), self.triangles, level.texels)
            texels = only(texels, seen_texels(self.look(), texels).sum(axis=0) >= FEWEST_VIEWS)
        energy = 0.0
        for i in range(level.iterations):
            if i % settings.refresh == 0:
                found = self.look()
                pairs = contour_pairs(found, self.contours, level.reach) if settings.edge else None
                if texels:
                    valid = torch.from_numpy(whole_patches(seen_texels(found, texels), texels)).float()
            vertices = self.vertices()
            pixels = self.cameras.pixels(vertices)
            total = settings.prior * prior_energy(self.face, self.first, settings.priors)
            total = total + settings.landmarks * landmark_energy(pixels[:, self.landmark_rows], self.found, self.seen)
            if pairs is not None:
                total = total + settings.edge * edge_energy(pixels, pairs)
            if texels:
                at = self.cameras.pixels(texels.points(vertices)) / level.shrink
                maps = unwrapped(pictures, at, texels)
                total = total + settings.photometric * photometric_energy(maps, valid, len(texels.row))
            optimiser.zero_grad()
            total.backward()
            optimiser.step()
            decay.step()
            energy = float(total.detach())
        return energy


def only(texels: Texels, kept: np.ndarray) -> Texels:
    """The texels of the mask `kept` [X]."""
    rows = torch.from_numpy(np.flatnonzero(kept))
    return Texels(texels.size, texels.row[rows], texels.corner[rows], texels.barycentric[rows])


def shrunk(pictures: Tensor, factor: int) -> Tensor:
    """Pictures [N, H, W] whose pixels are means of factor x factor pixels; what is left over at the end is cut off."""
    if factor == 1:
        return pictures
    return torch.nn.functional.avg_pool2d(pictures[:, None], factor)[:, 0]


def shared_landmarks(template: Template, views: Views):
    """(columns of the views' landmarks, the template's vertices) of the names that both have."""
    columns = [i for i, name in enumerate(views.landmark_names) if name in template.landmarks]
    rows = [template.landmarks[views.landmark_names[i]] for i in columns]
    return np.array(columns, np.int64), np.array(rows, np.int64)


def first_poses(template: Template, views: Views) -> tuple[F64, F64]:
    """(R [N, 3, 3], t [N, 3]) of cameras that see the template's landmarks where those of the pictures are."""
    columns, rows = shared_landmarks(template, views)
    points = template.vertices[rows].astype(np.float64)
    found = []
    for n, seen in enumerate(views.seen[:, columns]):
        found.append(pose_from_points(points[seen], views.landmarks[n, columns][seen], views.intrinsics))
    return np.stack([r for r, _ in found]), np.stack([t for _, t in found])
