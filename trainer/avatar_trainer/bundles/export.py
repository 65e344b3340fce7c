"""From a trained system to a bundle: through its released checkpoint and the exporter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch

from avatar_export import GENERATOR, READERS, ReadOptions, provenance, read
from avatar_export.driving import matrix
from avatar_export.ops import active_sh
from avatar_export.writers import bundle as bundles
from avatar_runtime import F32, Avatar, Clip, Image, PoseArrays, check_avatar, resolve
from avatar_runtime.conformance import Case, Maker, images
from avatar_trainer.bundles.definitions import TrainerStages
from avatar_trainer.captures.model import Capture
from avatar_trainer.raster.renderer import render
from avatar_trainer.systems.drawing import raster_settings
from avatar_trainer.systems.protocol import System

DRIVING = "driving.json"  # in a capture's folder: from the ARKit names to the body model's
SPLITS = {"test": "held_out", "train": "training"}  # of a capture -> the clip's name in the bundle
WHOLE = "film"  # the one clip of a capture whose held-out frames stand among the others: a part would jump


def export(
    system: System,
    run: Path,
    bundle: Path,
    *,
    engine_files: bool = True,
    preview: bool = True,
    force: bool = False,
) -> None:
    """Write the bundle of `run`, the checkpoint that `system.save` wrote in the released code's layout.

    The exporter reads the files like any other checkpoint. The tracked poses become clips, held-out ones first.
    The stage vectors of `reference/` are computed by the trainer's torch definitions, its images are drawn from
    `system` itself: `conform` then compares the files with the model in memory. Raises AvatarError
    as the exporter does.
    """
    avatar = exported(system, run)
    bundles.write_bundle(
        avatar, bundle, engine_files=engine_files, preview=preview, maker=maker(system), force=force
    )


def exported(system: System, run: Path) -> Avatar:
    """The exporter's avatar of the checkpoint at `run`, with the capture's poses as clips."""
    capture = system.capture
    avatar = active_sh.with_active_sh(read(run, options_for(capture, system.name), system.name))
    driving = capture.folder / DRIVING
    if driving.is_file():
        avatar = matrix.with_driving(avatar, driving)
    avatar = provenance.with_rights(
        avatar, *(capture.rights.get(name) for name in ("licence", "author", "consent"))
    )
    said = {"trainer": GENERATOR, "capture": capture.rights.get("source")}
    avatar = replace(
        avatar, head_pose_in=capture.head_pose_in, provenance={**avatar.provenance, "trained": said}
    )
    return check_avatar(replace(avatar, clips=(*clips(capture, avatar), *avatar.clips)))


def options_for(capture: Capture, system: str) -> ReadOptions:
    """The inputs of a capture that the exporter's reader of `system` uses."""
    used = next(reader.used_options for reader in READERS if reader.system == system)
    inputs: dict[str, Any] = {name: path for name, path in capture.export_inputs.items() if name in used}
    return ReadOptions(name=capture.name, **inputs)


def clips(capture: Capture, avatar: Avatar) -> tuple[Clip, ...]:
    """The tracked poses of each split, or of the whole, in order of time; arrays in the order of the avatar's names."""
    found, frames = [], capture.frames
    changes = sum(one.split != other.split for one, other in pairwise(frames))
    takes = {name: [one for one in frames if one.split == split] for split, name in SPLITS.items()}
    for name, shown in ({WHOLE: frames} if changes > len(SPLITS) else takes).items():
        all_poses = [frame.pose for frame in shown]
        # Several cameras see one pose, frame after frame: the clip has it once.
        poses = [pose for t, pose in enumerate(all_poses) if t == 0 or pose is not all_poses[t - 1]]
        if poses:
            found.append(
                Clip(
                    name,
                    capture.fps,
                    _reordered(
                        poses, "expression_weights", capture.expression_names, avatar.expression_names
                    ),
                    _reordered(poses, "late_weights", capture.eyelids, avatar.eyelids),
                    np.stack([pose.joint_delta for pose in poses]).astype(np.float32),
                    np.stack([pose.world_from_avatar for pose in poses]).astype(np.float32),
                )
            )
    return tuple(found)


def _reordered(poses: Sequence[PoseArrays], field: str, names: Sequence[str], wanted: Sequence[str]) -> F32:
    """[T, len(wanted)] weights of `field`, which are in the order of `names`; 0 for a missing name."""
    column = {name: k for k, name in enumerate(names)}
    weights = np.stack([getattr(pose, field) for pose in poses])
    padded = np.concatenate([weights, np.zeros((len(weights), 1), np.float32)], axis=1)
    result: F32 = padded[:, [column.get(name, len(names)) for name in wanted]]
    return result


def maker(system: System) -> Maker:
    """Makes the `reference/` of a trained avatar.

    Stage vectors come from the torch definitions (`TrainerStages`), images of profile `trainer` from the live model,
    drawn by rasteriser `cpu`.
    """
    return Maker("trainer", TrainerStages, lambda avatar, case: _images(system, avatar, case))


def _images(system: System, avatar: Avatar, case: Case) -> Mapping[str, Image]:
    """Profile `trainer` by the live model; `engine`, which no trainer draws, by the runtime's NumPy stages."""
    return {**images.draw(avatar, case, ("engine",)), "trainer": image(system, avatar, case)}


@torch.no_grad()
def image(system: System, avatar: Avatar, case: Case, rasteriser: str = "cpu") -> Image:
    """The live model in a case's pose, whose names are those of `avatar`; `rasteriser` is one of RASTERISERS."""
    capture, pose = system.capture, resolve(case.pose, avatar)
    own = replace(
        pose,
        expression_weights=_reordered(
            [pose], "expression_weights", avatar.expression_names, capture.expression_names
        )[0],
        late_weights=_reordered([pose], "late_weights", avatar.eyelids, capture.eyelids)[0],
    )
    background = torch.tensor(case.background, dtype=torch.float32)
    settings = raster_settings(system)
    rendered = render(system.splats(own), case.camera, settings, system.sh_degree, background, rasteriser)
    return Image(rendered.colour.numpy(), 1 - rendered.alpha.numpy())
