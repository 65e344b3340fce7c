"""PSAvatar (arXiv 2401.12900) as a trainable system: points on and off a morphable mesh, then Gaussians in their place.

Shape acquisition draws points (Eq. 3) and removes those that no image shows; then every remaining point becomes a
Gaussian (Eqs. 10, 11). Trained throughout: offsets r, opacities, colours, and the learned bases P', E' of the mesh
(Eq. 6). A point keeps the triangle and the barycentrics with which it was sampled. Lengths are metres.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Generator, Tensor

from avatar_runtime import AvatarError, Gaussians, PoseArrays
from avatar_schema import constants
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import read
from avatar_trainer.enhancer.network import WEIGHTS, enhanced, initial_weights
from avatar_trainer.kernels.mesh import kernel_mesh
from avatar_trainer.kernels.mesh_points import Placed, mesh_points_cpu, placed, turns_cpu
from avatar_trainer.kernels.smooth import edges_of
from avatar_trainer.parameters import stored
from avatar_trainer.parameters.table import Table
from avatar_trainer.stages.activate import SHORTEST
from avatar_trainer.stages.rotation import quat_multiply
from avatar_trainer.stages.skin import transform
from avatar_trainer.stages.surface import surface_mesh
from avatar_trainer.systems.common.detail import BY_AREA, busy, detail
from avatar_trainer.systems.common.first_points import View, colours
from avatar_trainer.systems.common.needles import shorten
from avatar_trainer.systems.common.rigid import moved
from avatar_trainer.systems.psavatar.enhancer import measured_enhancer
from avatar_trainer.systems.psavatar.files import Checkpoint, coefficient_names, save
from avatar_trainer.systems.psavatar.hull import seen
from avatar_trainer.systems.psavatar.initial import mean_spacing, sample_points
from avatar_trainer.systems.psavatar.losses import image_terms, read_vgg
from avatar_trainer.systems.psavatar.mesh import Bodies, posed, used_coefficients
from avatar_trainer.systems.psavatar.settings import RULES, UNITS, Settings, played_rules
from avatar_trainer.systems.psavatar.steady import motion, settle, stretch
from avatar_trainer.tensors import Points, Rendered, Splats

__all__ = ["RULES", "PSAvatar", "Settings", "create"]

SH_C0 = float(constants()["sh_c0"][0])
ROWS = "gaussians"  # the row set of the table that has a row for each point
FIRST_OPACITY = 0.5
FIRST_OFF_OPACITY = 0.1  # of points off the mesh, most of which lie in free air
RADIUS_PER_SPACING = 1.2  # so that discs on the mesh close
SCALE_PER_RADIUS = 1 / math.sqrt(6)  # a Gaussian of the variance that 1 - r^2 / R^2 has on a disc
COLOUR_FRAMES = 8
OBSERVED = 100  # images, or all if there are fewer, after which points that none of them showed are removed
IN_METRES = ("displacement", "bases")
AS_POINTS = ("opacity_logit", "sh_dc", "log_radius")  # that `_appearance` puts into the table
AS_GAUSSIANS = ("opacity_logit", "sh_dc", "sh_rest", "log_scale", "rotation")


def create(capture: Capture, settings: Settings, seed: int) -> PSAvatar:
    """An untrained avatar: random points on and off the body model's mesh.

    Raises AvatarError for a capture without training frames, with eyelids (this system's body model has none), and
    for a region that the body model does not define.
    """
    if capture.eyelids and any(frame.pose.late_weights.any() for frame in capture.frames):
        raise AvatarError(
            "has eyelid weights that are not 0; this system has no eyelids", file=capture.folder
        )
    if not capture.train:
        raise AvatarError("has no training frame", file=capture.folder)
    system = PSAvatar(capture, settings, seed)
    system.initialise()
    return system


class PSAvatar:
    """The system (see `avatar_trainer.systems.protocol.System`)."""

    name: ClassVar[str] = "psavatar"
    training_per_bundle = UNITS

    def __init__(self, capture: Capture, settings: Settings, seed: int) -> None:
        """The table is empty until `initialise`."""
        self.capture, self.settings, self.seed = capture, settings, seed
        rig = capture.rig
        self.mesh = kernel_mesh(surface_mesh(rig.vertices, rig.triangles, UNITS))
        self.bodies = Bodies(rig)
        self.edges = edges_of(rig.triangles, len(rig.vertices))
        self.motion = motion(rig, [frame.pose for frame in capture.train]) if settings.swing else None
        self.used = used_coefficients(rig, [frame.pose for frame in capture.train])
        self.rules = played_rules()
        self.table = Table()
        self.vgg = read_vgg(Path(settings.vgg_weights)) if settings.vgg else None
        self.sh_degree = 0
        self.enhancing = False  # whether the enhancer has been trained
        self.acquiring = settings.acquired_after > 0

    def initialise(self) -> None:
        """The points as they begin (Eqs. 7 and 8)."""
        settings, rig = self.settings, self.capture.rig
        n, rng = settings.gaussians, np.random.default_rng(self.seed)
        how = settings.region, n, settings.off_mesh, settings.r_max
        density = detail(self.capture, BY_AREA) * busy(self.capture)
        stretched = stretch(rig, [frame.pose for frame in self.capture.train])
        steady = self.motion, settings.swing, partial(seen, self.capture, UNITS)
        found = sample_points(rig, *how, density, stretched, rng, *steady)
        self._place(*map(torch.from_numpy, (found.triangle, found.barycentric, found.off_mesh, found.limit)))
        rates = settings.learning_rates
        bases = torch.zeros(len(self.used), len(rig.vertices), 3)
        self.table.add("bases", bases, rates.bases, "bases")
        if settings.enhancer:
            generator = torch.Generator().manual_seed(self.seed)
            for name, tensor in initial_weights(generator).items():
                self.table.add(name, tensor, rates.enhancer, rows=name)
        self.table.add("displacement", torch.from_numpy(found.displacement), rates.displacement, ROWS)
        on_mesh = n - int(found.off_mesh.sum())
        radius = RADIUS_PER_SPACING * mean_spacing(rig, settings.region, on_mesh or n)
        logit = torch.where(self.off_mesh, FIRST_OFF_OPACITY, FIRST_OPACITY).float().logit()
        dc = (self._first_colours() - 0.5) / SH_C0
        log_radius = math.log(radius) - 0.5 * np.log(density[found.triangle])
        self._appearance(torch.from_numpy(log_radius.astype(np.float32)), logit, dc[:, None])

    def splats(self, pose: PoseArrays) -> Splats | Points:
        """The avatar in one pose, metres, differentiable with respect to the table."""
        body, table = self.bodies[pose], self.table
        vertices = posed(body, table["bases"], self.used)
        mean = mesh_points_cpu(vertices, self._displacement(), self.placed)
        opacity = table["opacity_logit"].sigmoid()
        world = torch.from_numpy(pose.world_from_avatar.astype(np.float32))
        still = np.array_equal(pose.world_from_avatar, np.eye(4))
        if self.draws_points:
            rgb = (0.5 + SH_C0 * table["sh_dc"][:, 0]).clamp_min(0)
            return Points(
                mean if still else transform(world[:3], mean), table["log_radius"].exp(), opacity, rgb
            )
        frame, turn = turns_cpu(body.matrix, self.placed)
        local = table["rotation"]
        own_first = self.settings.rules["order"] == "mesh_first"
        quat = quat_multiply(turn, local) if own_first else quat_multiply(local, turn)
        sh: Tensor = table["sh_dc"]
        if "sh_rest" in table:
            sh = torch.cat([sh, table["sh_rest"]], dim=1)
        seen = frame if self.settings.sh_degree else None  # one colour needs no frame
        splats = Splats(mean, table["log_scale"].exp(), normalised(quat), opacity, sh, seen)
        return splats if still else moved(splats, world)

    def enhanced(self, colour: Tensor) -> Tensor | None:
        """The enhanced image [H, W, 3]; None if no enhancer has been trained."""
        return enhanced(self.table_of(WEIGHTS), colour) if self.enhancing else None

    def table_of(self, names: Iterable[str]) -> dict[str, Tensor]:
        """These tensors of the table."""
        return {name: self.table[name] for name in names}

    def background(self, generator: Generator) -> Tensor:
        """[3] random, which shows the silhouette."""
        return torch.rand(3, generator=generator)

    def losses(self, rendered: Rendered, target: Tensor, mask: Tensor, iteration: int) -> dict[str, Tensor]:
        """Paper Eqs. 12 to 15; D-SSIM replaces VGG if its weights are not available."""
        settings = self.settings
        judged = settings.dssim, settings.vgg, self.vgg
        terms = image_terms(rendered.colour, target, *judged)
        if settings.enhances(iteration):
            better = image_terms(enhanced(self.table_of(WEIGHTS), rendered.colour), target, *judged)
            terms |= {f"{name}_enhanced": term for name, term in better.items()}
        if settings.scale:
            terms["scale"] = settings.scale * self._mean_scale()
        if settings.thin:
            terms["thin"] = settings.thin * (self.table["opacity_logit"].sigmoid() * self.off_mesh).mean()
        return terms

    def observe(self, rendered: Rendered, screen_gradient: Tensor) -> None:
        """The best visibility of each point; for Gaussians its upper bound, the opacity."""
        if not self.acquiring:
            return
        seen = rendered.visibility
        if seen is None:
            seen = torch.where(rendered.radius > 0, self.table["opacity_logit"].detach().sigmoid(), 0.0)
        torch.maximum(self.visibility, seen, out=self.visibility)
        self.observed += 1

    def before_step(self, iteration: int) -> None:
        """Learning rates in metres, and the enhancer's, fall exponentially."""
        settings, rates = self.settings, self.settings.learning_rates
        share = min(iteration / settings.iterations, 1.0)
        for name in IN_METRES:
            self.table.learning_rate(name, getattr(rates, name) * rates.falls_to**share)
        if settings.enhances(iteration):
            share = 1 - (1 - share) / settings.enhancing
            for name in WEIGHTS:
                self.table.learning_rate(name, rates.enhancer * rates.falls_to**share)

    def after_step(self, iteration: int, generator: Generator) -> None:
        """Removal of points that are hardly seen; the change to Gaussians; SH degree."""
        settings = self.settings
        self._hold_together(iteration)
        enough = self.observed >= min(len(self.capture.train), OBSERVED)
        if self.acquiring and settings.removal_due(iteration) and enough:
            self.remove(self.visibility < settings.least_visibility)
        if self.acquiring and iteration >= settings.acquired_after:
            self._become_gaussians()
        if iteration == settings.cleared_at:
            self.remove(self.table["opacity_logit"].sigmoid() < settings.least_visibility)
        self.enhancing = settings.enhances(iteration)
        if not self.acquiring:
            after = iteration - settings.acquired_after
            self.sh_degree = min(after // settings.sh_degree_every, settings.sh_degree)

    @torch.no_grad()
    def remove(self, these: Tensor) -> None:
        """Remove points, bool [N]. Raises AvatarError if none is left."""
        kept = torch.nonzero(~these)[:, 0]
        if not len(kept):
            raise AvatarError(
                "no point is left: no image shows one; lower least_visibility or set removals=0"
            )
        self.table.take(ROWS, kept, torch.zeros(len(kept), dtype=torch.bool))
        self._place(self.triangle[kept], self.barycentric[kept], self.off_mesh[kept], self.limit[kept])

    @property
    def draws_points(self) -> bool:
        """Whether the avatar consists of points at present."""
        return self.acquiring and self.settings.rules["acquisition"] == "points"

    def state(self) -> dict[str, Any]:
        """Everything that `load_state` needs to continue with the same bits."""
        return {
            "table": self.table.state(),
            "triangle": self.triangle,
            "barycentric": self.barycentric,
            "off_mesh": self.off_mesh,
            "acquiring": self.acquiring,
            "enhancing": self.enhancing,
            "visibility": self.visibility,
            "observed": self.observed,
            "limit": self.limit,
            "sh_degree": self.sh_degree,
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Continue from `state`. ValueError, KeyError or TypeError for one of another mesh or of other settings."""
        if not all(type(state[name]) is bool for name in ("acquiring", "enhancing")):
            raise ValueError("acquiring and enhancing are not true or false")
        if state["enhancing"] and not self.settings.enhancer:
            raise ValueError("it has an enhancer, which these settings never train")
        if state["acquiring"] != self.acquiring:
            if state["acquiring"]:
                raise ValueError("it acquires a shape, which these settings never do")
            self._become_gaussians()
        self.table.load_state(state["table"])
        self.enhancing = state["enhancing"]
        n = self.table.count(ROWS)
        triangle = stored.indices(state["triangle"], "triangle", n, len(self.capture.rig.triangles))
        barycentric = stored.tensor(state["barycentric"], "barycentric", (n, 3))
        off_mesh = stored.tensor(state["off_mesh"], "off_mesh", (n,), torch.bool)
        limit = stored.tensor(state["limit"], "limit", (n,))
        self._place(triangle.clone(), barycentric.clone(), off_mesh.clone(), limit.clone())
        self.visibility = stored.tensor(state["visibility"], "visibility", (n,)).clone()
        self.observed = stored.whole(state["observed"], "observed")
        self.sh_degree = stored.whole(state["sh_degree"], "sh_degree", self.settings.sh_degree)

    @torch.no_grad()
    def save(self, folder: Path, iteration: int) -> None:
        """Write the layout of PSAVATAR.md into `folder`. AvatarError without Gaussians, and for order as_printed."""
        if self.settings.rules["order"] == "as_printed":
            raise AvatarError(
                "cannot be written: rule order as_printed turns Gaussians as no mesh does; it is for comparison in "
                "the trainer alone",
                file=folder,
            )
        if self.acquiring:
            raise AvatarError(
                f"has no Gaussians yet: the shape is being acquired until iteration {self.settings.acquired_after}",
                file=folder,
            )
        rig, table = self.capture.rig, {name: self.table[name].detach() for name in self.table}
        mean = mesh_points_cpu(torch.from_numpy(rig.vertices), self._displacement(), self.placed)
        names = coefficient_names(rig, self.capture.expression_names)
        gaussians = Gaussians(
            mean.numpy(),
            table["log_scale"].numpy(),
            normalised(table["rotation"]).numpy(),
            table["opacity_logit"].numpy(),
            torch.cat([table[name] for name in ("sh_dc", "sh_rest") if name in table], dim=1).numpy(),
        )
        save(
            Checkpoint(
                gaussians=gaussians,
                vertices=rig.vertices,
                triangles=rig.triangles.astype(np.int64),
                triangle=self.triangle.numpy(),
                barycentric=self.barycentric.numpy(),
                displacement=self._displacement().numpy(),
                quat_wxyz=table["rotation"].numpy(),
                bases=table["bases"].numpy(),
                basis_names=[names[k] for k in self.used.tolist()],
                training_per_metre=UNITS,
                rules=self.settings.rules,
                system=self.name,
                enhancer=measured_enhancer(self, self.table_of(WEIGHTS)) if self.enhancing else None,
            ),
            folder,
            iteration,
        )

    def _place(self, triangle: Tensor, barycentric: Tensor, off_mesh: Tensor, limit: Tensor) -> None:
        """Points in these triangles [N], at these weights [N, 3], within limits [N]; their visibility is unknown."""
        self.triangle, self.barycentric, self.off_mesh = triangle, barycentric, off_mesh
        self.placed: Placed = placed(self.mesh, triangle, barycentric)
        self.visibility, self.observed = torch.zeros(len(triangle)), 0
        self.limit = limit  # metres off the mesh

    @torch.no_grad()
    def _hold_together(self, iteration: int) -> None:
        """Points stay within their limits, Gaussians no needles; the bases settle."""
        settings, displacement = self.settings, self.table["displacement"]
        torch.clamp(displacement, -self.limit, self.limit, out=displacement)
        if not self.acquiring:
            shorten(self.table["log_scale"], settings.longest)
        if share := settings.settles(iteration):
            settle(self.table["bases"], self.edges, share * settings.smoothing, share * settings.decay)

    def _appearance(self, log_radius: Tensor, opacity_logit: Tensor, dc: Tensor) -> None:
        """Puts the tensors of points, or of Gaussians in their place, into the table."""
        rates, points = self.settings.learning_rates, self.draws_points
        self.table.add("opacity_logit", opacity_logit, rates.opacity_logit, ROWS)
        self.table.add("sh_dc", dc, rates.rgb if self.acquiring else rates.sh, ROWS)
        if points:
            self.table.add("log_radius", log_radius, rates.log_radius, ROWS)
            return
        n = len(log_radius)
        still = torch.tensor([1.0, 0.0, 0.0, 0.0])
        log_scale = (log_radius + math.log(SCALE_PER_RADIUS))[:, None].repeat(1, 3)
        self.table.add("log_scale", log_scale, rates.log_scale, ROWS)
        self.table.add("rotation", still.repeat(n, 1), rates.rotation, ROWS)
        if rest := (self.settings.sh_degree + 1) ** 2 - 1:
            self.table.add("sh_rest", torch.zeros(n, rest, 3), rates.sh / 20, ROWS)

    def _become_gaussians(self) -> None:
        """The shape is acquired: Gaussians replace points, and keep the values that both have."""
        was, points = self.table, self.draws_points
        self.acquiring = False
        if not points:
            self.table.learning_rate("sh_dc", self.settings.learning_rates.sh)
            return
        self.table = Table()
        for name in was:
            if name not in (*AS_POINTS, *AS_GAUSSIANS):
                self.table.add(name, was[name], was.learning_rates()[name], was.rows(name))
        self._appearance(was["log_radius"].detach(), was["opacity_logit"], was["sh_dc"])
        kept, state = was.state(), self.table.state()
        for name in state.keys() & kept.keys():
            state[name] = {**kept[name], "learning_rate": state[name]["learning_rate"]}
        self.table.load_state(state)

    def _displacement(self) -> Tensor:
        """[N] metres; points on the mesh stay there, unless rule displacement says otherwise."""
        displacement: Tensor = self.table["displacement"]
        if self.settings.rules["displacement"] == "all":
            return displacement
        return displacement * self.off_mesh

    def _mean_scale(self) -> Tensor:
        """Mean length of the scaling vector (Eq. 14), training units; of points that of the Gaussian in their place."""
        if self.draws_points:
            return UNITS * SCALE_PER_RADIUS * math.sqrt(3) * self.table["log_radius"].exp().mean()
        length: Tensor = torch.linalg.vector_norm(self.table["log_scale"].exp(), dim=1)
        return UNITS * length.mean()

    def _first_colours(self) -> Tensor:
        """[N, 3] 0..1, the colours of the points in some training frames."""
        frames = self.capture.train
        used = frames[:: math.ceil(len(frames) / COLOUR_FRAMES)]
        return colours([self._view(frame) for frame in used], len(self.triangle))

    @torch.no_grad()
    def _view(self, frame: Frame) -> View:
        target, body = read(frame), self.bodies[frame.pose]
        vertices = posed(body, self.table["bases"], self.used)
        world = torch.from_numpy(frame.pose.world_from_avatar.astype(np.float32))
        foot = mesh_points_cpu(vertices, torch.zeros(len(self.triangle)), self.placed)
        above = mesh_points_cpu(vertices, torch.ones(len(self.triangle)), self.placed)
        point = mesh_points_cpu(vertices, self.table["displacement"], self.placed)
        normal = (above - foot) @ world[:3, :3].T
        return View(target.image, target.mask, frame.camera, transform(world[:3], point), normal)


def normalised(quat_wxyz: Tensor) -> Tensor:
    """Quaternions [N, 4] of length 1."""
    length: Tensor = torch.linalg.vector_norm(quat_wxyz, dim=1, keepdim=True)
    return quat_wxyz / length.clamp_min(SHORTEST)
