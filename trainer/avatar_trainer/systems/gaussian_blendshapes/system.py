"""3D Gaussian Blendshapes (Ma et al. 2024): a neutral head, each expression's differences, and the mouth's inside."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Generator, Tensor

from avatar_export.bodies import subject_files
from avatar_export.readers.gaussian_blendshapes import layout, reader
from avatar_runtime import F32, I64, AvatarError, PoseArrays, Rig
from avatar_trainer import losses
from avatar_trainer.captures.model import Capture
from avatar_trainer.kernels import skinned_cpu
from avatar_trainer.parameters import stored
from avatar_trainer.parameters.densify import Density
from avatar_trainer.stages.rotation import matrix_from_quat
from avatar_trainer.systems.common.detail import BY_AREA, detail
from avatar_trainer.systems.common.needles import shorten
from avatar_trainer.systems.gaussian_blendshapes.blend import (
    turned_by_entry,
    turned_sum,
    with_init,
    with_learned,
)
from avatar_trainer.systems.gaussian_blendshapes.density import grow
from avatar_trainer.systems.gaussian_blendshapes.files import STORED_DEGREE, Model, save_model
from avatar_trainer.systems.gaussian_blendshapes.frames import frame_colours, seen_triangles
from avatar_trainer.systems.gaussian_blendshapes.initial import Start, dense, start
from avatar_trainer.systems.gaussian_blendshapes.motion import Motion, placed
from avatar_trainer.systems.gaussian_blendshapes.mouth import Cylinder
from avatar_trainer.systems.gaussian_blendshapes.rows import FACE, Rows
from avatar_trainer.systems.gaussian_blendshapes.settings import (
    BACKGROUNDS,
    PAPER,
    RULES,
    SETTLED_EVERY,
    Settings,
)
from avatar_trainer.systems.gaussian_blendshapes.sh import turn_matrices
from avatar_trainer.systems.gaussian_blendshapes.table import DELTA, DELTAS, GAUSSIAN, RATE_OF, make_table
from avatar_trainer.tensors import Gaussians, Rendered, Splats

__all__ = ["PAPER", "RULES", "GaussianBlendshapes", "Settings", "create"]

SH_C0 = 0.28209479177387814
RESET_OPACITY = 0.01


def create(capture: Capture, settings: Settings, seed: int) -> GaussianBlendshapes:
    """The avatar before training. Raises AvatarError for a body model that this system cannot be trained on."""
    rig = capture.rig
    if tuple(rig.joint_names) != layout.JOINTS or len(capture.eyelids) not in (0, 2):
        raise AvatarError(
            f"has joints {', '.join(rig.joint_names)[:80]} and {len(capture.eyelids)} eyelids; this system "
            f"is trained on FLAME's layout: {', '.join(layout.JOINTS)}, and two eyelids or none",
            file=capture.folder,
            field="body",
        )
    if settings.rules["mouth"] == "on" and not len(rig.anchor_vertices):
        raise AvatarError(
            "has no anchor faces (back_of_head.txt), which carry the upper teeth; give them or use --rule mouth=off",
            file=capture.folder,
            field="body",
        )
    density = detail(capture, BY_AREA)
    if settings.unseen < 1:
        density[~seen_triangles(capture)] = settings.unseen
    x, y, z, radius, half = settings.mouth_cylinder
    first = start(
        rig,
        min(settings.expressions, len(capture.expression_names)),
        settings.gaussians,
        settings.mouth_gaussians if settings.rules["mouth"] == "on" else 0,
        settings.rules,
        np.random.default_rng(seed),
        sh_degree=settings.sh_degree,
        least_mask=settings.least_mask,
        neck=_neck(rig, settings.neck_vertices),
        density=density,
        cylinder=Cylinder((x, y, z), radius, half) if radius else None,
    )
    first = supported(first, capture, settings.supported)
    system = GaussianBlendshapes(capture, settings, first)
    if settings.colours == "frames":
        system.paint(frame_colours(capture, system.splats))
    return system


def supported(first: Start, capture: Capture, enough: float) -> Start:
    """`first` with masks scaled by what the training frames show of each expression.

    The factor is min(1, root mean square of the expression's weights / enough); 0: none.
    """
    if not enough or not capture.train:
        return first
    weights = np.stack([frame.pose.expression_weights for frame in capture.train])
    share = np.minimum(1, np.sqrt(np.mean(np.square(weights, dtype=np.float64), axis=0)) / enough)
    rows = first.rows
    mask = rows.mask * torch.from_numpy(share.astype(np.float32))[rows.learned.column]
    return replace(first, rows=replace(rows, mask=mask))


class GaussianBlendshapes:
    """B_0, its differences and B_m, trained together."""

    name: ClassVar[str] = layout.SYSTEM
    training_per_bundle = 1.0

    def __init__(self, capture: Capture, settings: Settings, first: Start) -> None:
        self.capture, self.settings, self.first = capture, settings, first
        self.sh_degree = 0
        self.expressions = min(settings.expressions, len(capture.expression_names))
        self.density = Density(first.rows.count)
        self.density_settings = settings.density.within(settings.iterations)
        self.table = make_table(settings, first)
        self._motion = Motion(capture, settings.rules)
        self._volume = None if first.cylinder is None else _volume(first.cylinder)
        self._learns = settings.rules["deltas"] == "trained"
        self._iteration = 0
        self._lay_out(first.rows)

    def paint(self, colour: F32) -> None:
        """Give every Gaussian a colour [N, 3], display-referred."""
        self.table.set("sh_dc", torch.from_numpy((colour[:, None] - 0.5) / SH_C0).to(torch.float32))

    def splats(self, pose: PoseArrays) -> Splats:
        """The avatar in one pose, metres, differentiable with respect to the table."""
        weights = torch.from_numpy(pose.expression_weights[: self.expressions].copy())
        carry = self._motion.carry(self.rows, pose)
        splats = skinned_cpu(self.blended(weights), carry.matrix, None, carry.corrective, carry.late)
        return placed(splats, pose.world_from_avatar)

    def base(self) -> Gaussians:
        """B_0 and B_m as they are now."""
        t = self.table
        sh = torch.cat([t["sh_dc"], t["sh_rest"]], dim=1) if "sh_rest" in t else t["sh_dc"]
        return Gaussians(t["mean"], t["log_scale"], t["quat_wxyz"], t["opacity_logit"], sh)

    def blended(self, weights: Tensor) -> Gaussians:
        """Eq. 1 with `weights` [K], and B_m."""
        base = self.base()
        now = with_init(base, self.rows, weights)
        if self._turns is not None:
            now = replace(now, sh=now.sh + turned_sum(base.sh, self.rows.init, self._turns, weights))
        if not self._learns:
            return now
        few, sh = (self.settings.delta_sh_degree + 1) ** 2, now.sh
        now = with_learned(replace(now, sh=sh[:, :few]), self.rows.learned, *self.learned(), weights)
        return now if few == sh.shape[1] else replace(now, sh=torch.cat([now.sh, sh[:, few:]], dim=1))

    def learned(self) -> tuple[dict[str, Tensor], Tensor]:
        """(Delta G^ of Eq. 2 by attribute [E', ...], the mask [E'] that scales all of it).

        Where the rule consistency has a mask for positions alone, it is multiplied into them.
        """
        rule, mask = self.settings.rules["consistency"], self.rows.mask
        values: dict[str, Tensor] = {name: self.table[f"delta_{name}"] for name in DELTAS}
        if rule == "all":
            return values, mask
        if rule == "position":
            values["mean"] = values["mean"] * mask[:, None]
        return values, torch.ones_like(mask)

    def background(self, generator: Generator) -> Tensor:
        """[3] as the settings say, the same in every iteration."""
        return torch.full((3,), BACKGROUNDS[self.settings.background])

    def losses(self, rendered: Rendered, target: Tensor, mask: Tensor, iteration: int) -> dict[str, Tensor]:
        """Eq. 3 to 6, weighted; no term of the mouth if none of its Gaussians is left."""
        w = self.settings.weights
        terms = {
            "l1": (1 - w.dssim) * losses.l1(rendered.colour, target),
            "dssim": w.dssim * losses.dssim_loss(rendered.colour, target),
            "alpha": w.alpha * losses.alpha_loss(rendered.alpha, mask),
        }
        mouth = self.table["mean"][self.rows.of(FACE).stop :]
        if self._volume is not None and len(mouth):
            terms["mouth"] = w.mouth * losses.mouth_volume_loss(mouth, self._volume)
        if w.lpips:
            terms["lpips"] = w.lpips * losses.lpips_loss(rendered.colour, target)
        return terms

    def observe(self, rendered: Rendered, screen_gradient: Tensor) -> None:
        """Statistics for density control; what the frame hardly shows learns nothing of it."""
        if self.settings.hidden:
            self._hold_hidden()
        if self.density_settings.observing(self._iteration):
            self.density.observe(rendered.radius, screen_gradient)

    def before_step(self, iteration: int) -> None:
        """The rate of the positions falls exponentially (3DGS); the others stay."""
        self._iteration = iteration
        r = self.settings.rates
        share = min(iteration / self.settings.iterations, 1.0)
        rate = math.exp((1 - share) * math.log(r.mean) + share * math.log(r.mean_final))
        self.table.learning_rate("mean", rate * self.settings.extent)

    def after_step(self, iteration: int, generator: Generator) -> None:
        """Density control, opacity resets, and one SH degree more every so often."""
        s, density = self.settings, self.density_settings
        if density.due(iteration):
            self._densify(iteration, generator)
        if s.opacity_resets and density.opacity_reset_due(iteration):
            limit = math.log(RESET_OPACITY / (1 - RESET_OPACITY))
            self.table.set("opacity_logit", self.table["opacity_logit"].detach().clamp(max=limit))
        shorten(self.table["log_scale"], s.longest)
        if s.decay and self._learns and iteration % SETTLED_EVERY == 0:
            self._settle()
        if iteration % s.sh_every == 0:
            self.sh_degree = min(self.sh_degree + 1, s.sh_degree)

    def state(self) -> dict[str, Any]:
        """Everything that `load_state` needs."""
        return {
            "table": self.table.state(),
            "rows": self.rows.state(),
            "density": self.density.state(),
            "sh_degree": self.sh_degree,
            "iteration": self._iteration,
            "triangle": self.first.triangle,
            "barycentric": self.first.barycentric,
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Continue from `state`. ValueError, KeyError or TypeError for one of another subject or of other settings."""
        self.table.load_state(state["table"])
        rows = self.rows.from_state(state["rows"], self.expressions)
        counts = {GAUSSIAN: rows.count, DELTA: rows.learned.count}
        for name in self.table:
            if len(self.table[name]) != counts[self.table.rows(name)]:
                raise ValueError(
                    f"{name} has {len(self.table[name])} rows, not {counts[self.table.rows(name)]}"
                )
        self._lay_out(rows)
        self.density.load_state(state["density"], rows.count)
        self.sh_degree = stored.whole(state["sh_degree"], "sh_degree", self.settings.sh_degree)
        self._iteration = stored.whole(state["iteration"], "iteration")
        points = len(self.first.triangle)
        self.first = replace(
            self.first,
            triangle=stored.indices(state["triangle"], "triangle", points, len(self.capture.rig.triangles)),
            barycentric=stored.tensor(state["barycentric"], "barycentric", (points, 3)),
        )

    def save(self, folder: Path, iteration: int) -> None:
        """Write the released code's layout, and rules.json, into `folder`."""
        base, rates, density = self.base(), self.table.learning_rates(), self.density
        learned, mask = self.learned() if self._learns else ({}, self.rows.mask)
        init_sh = None
        if self._turns is not None:
            init_sh = turned_by_entry(base.sh.detach(), self.rows.init.row(), self._turns)
        model = Model(
            gaussians=base,
            rows=self.rows,
            learned=learned,
            mask=mask,
            init_sh=init_sh,
            parts=tuple(self.rows.of(group) for group in range(int(self.rows.group[-1]) + 1)),
            statistics=(density.largest_radius, density.gradient_sum, density.seen),
            sh_degree=self.sh_degree,
            expressions=self.expressions,
            first_points=(self.first.triangle, self.first.barycentric),
            extent=self.settings.extent,
            rates={group: rates.get(name, 0.0) for group, name in RATE_OF.items()},
            config=self._config(folder, iteration),
            rules={
                name: self.settings.rules[name] for name in (*reader.PLAYED_RULES, *reader.RECORDED_RULES)
            },
        )
        save_model(model, layout.SYSTEM, folder, iteration)

    def _config(self, folder: Path, iteration: int) -> dict[str, Any]:
        """The cfg_args of the released code, as far as they apply here."""
        s, c = self.settings, self.first.cylinder
        return {
            "sh_degree": STORED_DEGREE,
            "source_path": self.capture.name,
            "model_path": folder.name,
            "white_bkgd": s.background == "white",
            "iterations": iteration,
            "lambda_dssim": s.weights.dssim,
            "camera_extent": s.extent,
            "alpha_loss": s.weights.alpha,
            "mouth_loss_weight": s.weights.mouth,
            "cylinder_params": [] if c is None else [*c.centre, c.radius, c.half_height],
            "update_consistency": False,
            "init_face_point_number": len(self.first.triangle),
            "num_exp_params": len(self.capture.expression_names),
        }

    def _densify(self, iteration: int, generator: Generator) -> None:
        s, t = self.settings, self.table
        plan = self.density.plan(
            s.density,
            t["log_scale"],
            t["opacity_logit"],
            s.extent,
            judge_size=s.opacity_resets and s.density.judges_size(iteration),
        )
        self._lay_out(grow(plan, self.rows, t, generator))
        self.density.reset(self.rows.count)

    @torch.no_grad()
    def _hold_hidden(self) -> None:
        """Gradients become 0 of Gaussians that a frame hardly shows: Adam would move them as far as the others."""
        gradient = self.table["sh_dc"].grad
        if gradient is None:
            return
        shown = gradient.abs().sum(dim=(1, 2))
        stays = shown < self.settings.hidden * shown.sum() / max(int((shown > 0).sum()), 1)
        of = {GAUSSIAN: stays, DELTA: stays[self._learned_row]}
        for name in self.table:
            gradient = self.table[name].grad
            if gradient is not None:
                gradient[of[self.table.rows(name)]] = 0

    @torch.no_grad()
    def _settle(self) -> None:
        """Differences decay: those stay that many frames ask for. Adam moves rare ones as far as frequent ones."""
        for name in DELTAS:
            self.table[f"delta_{name}"].mul_(1 - SETTLED_EVERY * self.settings.decay)

    def _lay_out(self, rows: Rows) -> None:
        """Take over `rows`, and compute the arrays that depend on them."""
        self.rows = rows
        self._learned_row = rows.learned.row()
        self._turns = None
        if self.settings.rules["init_sh"] == "rotated" and self.settings.sh_degree:
            turn = matrix_from_quat(rows.init_values[:, 3:] + torch.tensor([1.0, 0, 0, 0]))
            self._turns = turn_matrices(turn, self.settings.sh_degree)


def _volume(cylinder: Cylinder) -> losses.Cylinder:
    return losses.Cylinder(
        torch.tensor(cylinder.centre), torch.tensor([0.0, 1.0, 0.0]), cylinder.radius, cylinder.half_height
    )


def _neck(rig: Rig, file: str) -> I64:
    """Vertices whose motion no mask counts: those in `file`, else those that the root joint holds most."""
    if file:
        return subject_files.read_faces(Path(file), len(rig.vertices)).astype(np.int64)
    return np.flatnonzero(dense(rig.skin, "weight").argmax(axis=1) == layout.JOINTS.index("root"))
