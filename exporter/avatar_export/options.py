"""What a user may say beside the checkpoint; every reader takes the same options."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields
from pathlib import Path

from avatar_runtime.io.errors import AvatarError


@dataclass(frozen=True)
class ReadOptions:
    """Inputs that a checkpoint does not hold. A field that a system does not use is refused by its reader."""

    body_model: Path | None = None  # FLAME- or SMPL-layout .npz or .pkl
    body_scale: float = 1.0  # training units in one unit of the body model
    shape: Path | None = None  # identity coefficients: .frame, .npy, .npz or .json
    eyelids: Path | None = None  # folder with l_eyelid.npy and r_eyelid.npy
    anchor_faces: Path | None = None  # text file of face indices that carry the upper teeth
    dataset: Path | None = None  # folder searched for whatever of the above is not given
    no_rig: bool = False  # expressions only, nothing is skinned
    rotation: str | None = None  # rotation rule, where the system leaves a choice
    exact: bool = False  # keep every delta that is not exactly zero
    name: str | None = None  # of the avatar; default: from the source's name
    rig: Path | None = None  # .glb or .fbx: skin and morphs of the mesh that the Gaussians are embedded in
    mesh: Path | None = None  # .obj or .npz, training units: that mesh itself, where the checkpoint lacks it
    poses: Path | None = None  # flame_params.json, poses.npz or flame_param.npz: identity and tracked poses
    units: float | None = None  # training units in a metre
    mesh_scaling: bool | None = None  # SplattingAvatar's with_mesh_scaling; None: as its config says
    sh_direction: str | None = None  # rules.SH_DIRECTIONS; None: as the config says
    sh_degree: int | None = None  # active degree; None: as the config or the file says
    quaternion_sign: str | None = None  # rules.QUATERNION_SIGNS; None: that of the trainer's newest pytorch3d

    def refuse_others(self, used: Collection[str], owner: str, why: str) -> None:
        """Raise AvatarError for an option that is given and that the reader `owner` does not use."""
        for option in fields(self):
            if option.name not in used and getattr(self, option.name) != option.default:
                flag = f"--{option.name.replace('_', '-')}"
                raise AvatarError(f"{flag} is no option here: {why}", owner=owner)
