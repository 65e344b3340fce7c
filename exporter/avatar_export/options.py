"""Inputs that a checkpoint does not hold; every reader takes the same options."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from avatar_runtime.checks import arguments
from avatar_runtime.io.errors import AvatarError

CONVERT: Mapping[str, Callable[[str, Any], Any]] = {  # by annotation, without "| None"
    "Path": arguments.path,
    "float": arguments.finite,
    "int": arguments.whole,
    "bool": lambda name, value: arguments.instance(name, value, bool, "True or False"),
    "str": lambda name, value: arguments.instance(name, value, str, "a text"),
}

LEAST_UNITS, MOST_UNITS = 1e-6, 1e6  # training units per metre
IN_UNITS = ("body_scale",)  # readers check `units`


@dataclass(frozen=True)
class ReadOptions:
    """Inputs that a checkpoint does not hold. A reader refuses a field that its system does not use.

    Paths may be texts. Raises TypeError and ValueError for a field of another type, and ValueError for
    units that are not LEAST_UNITS to MOST_UNITS.
    """

    body_model: Path | None = None  # FLAME or SMPL file, .npz or .pkl
    body_scale: float | None = (
        None  # training units per unit of the body model; None: as the checkpoint says, else 1
    )
    shape: Path | None = None  # identity coefficients: .frame, .npy, .npz or .json
    eyelids: Path | None = None  # folder with l_eyelid.npy and r_eyelid.npy
    anchor_faces: Path | None = None  # text file of face indices that carry the upper teeth
    dataset: Path | None = None  # folder that is searched for inputs that are not given
    no_rig: bool = False  # only expressions, no joints and no skinning
    rotation: str | None = None  # rotation rule, where the system leaves a choice
    exact: bool = False  # keep every delta that is not exactly zero
    name: str | None = None  # of the avatar; None: that of the source
    rig: Path | None = None  # .glb or .fbx: skin and morphs of the mesh that the Gaussians are embedded in
    mesh: Path | None = None  # .obj or .npz, training units: that mesh, if the checkpoint does not store it
    poses: Path | None = None  # flame_params.json, poses.npz or flame_param.npz: identity and tracked poses
    units: float | None = None  # training units per metre
    mesh_scaling: bool | None = None  # SplattingAvatar's with_mesh_scaling; None: as its config says
    sh_direction: str | None = None  # rules.SH_DIRECTIONS; None: as the config says
    sh_degree: int | None = None  # active degree; None: as the config or the file says
    quaternion_sign: str | None = None  # rules.QUATERNION_SIGNS; None: that of pytorch3d 0.7.6 and newer
    accept_misfit: bool = False  # read inputs that lie far apart, with a warning

    def __post_init__(self) -> None:
        """Brings every field to its type."""
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None or "None" not in str(field.type):
                value = CONVERT[str(field.type).split(" ")[0]](field.name, value)
                if field.name in IN_UNITS and not LEAST_UNITS <= value <= MOST_UNITS:
                    raise ValueError(
                        f"{field.name} is {value:g}; {LEAST_UNITS:g} to {MOST_UNITS:g} is needed"
                    )
                object.__setattr__(self, field.name, value)

    def refuse_beside_no_rig(self, unused: Collection[str], owner: str) -> None:
        """Raise AvatarError, for the reader `owner`, if `no_rig` is set and one of the options `unused` is given:
        they would have no effect."""
        given = [name for name in unused if getattr(self, name) is not None]
        if self.no_rig and given:
            flags = " and ".join(f"--{name.replace('_', '-')}" for name in given)
            raise AvatarError(
                f"{flags} would have no effect beside --no-rig; leave out {flags}, or --no-rig to get a rig",
                owner=owner,
            )

    def refuse_others(self, used: Collection[str], owner: str, why: str) -> None:
        """Raise AvatarError for an option that is given and that the reader `owner` does not use."""
        for option in fields(self):
            if option.name not in used and getattr(self, option.name) != option.default:
                flag = f"--{option.name.replace('_', '-')}"
                raise AvatarError(f"{flag} cannot be used here: {why}", owner=owner)
