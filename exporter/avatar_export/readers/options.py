"""What a user may say beside the checkpoint; every reader takes the same options."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ReadOptions:
    """Inputs that a checkpoint does not hold. A field that a system does not use is refused by its reader."""

    body_model: Path | None = None  # FLAME- or SMPL-layout .npz or .pkl
    body_scale: float = 1.0  # training units in one unit of the body model
    shape: Path | None = None  # identity coefficients: .frame, .npy, .npz or .json
    eyelids: Path | None = None  # folder with l_eyelid.npy and r_eyelid.npy
    anchor_faces: Path | None = None  # text file of face indices that carry the upper teeth
    dataset: Path | None = None  # folder searched for whatever of the above is not given
    rig: bool = True  # False: expressions only, nothing is skinned
    rotation: str | None = None  # rotation rule, where the system leaves a choice
    exact: bool = False  # keep every delta that is not exactly zero
    name: str | None = None  # of the avatar; default: from the source's name
