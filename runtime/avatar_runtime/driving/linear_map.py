"""The linear map from ARKit names to an avatar's own weights and joint axes, for either mode of `Driving`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.driving.arkit import ARKIT_NAMES, first_canonical
from avatar_runtime.io.errors import AvatarError

NO_DRIVING = (
    "ARKit weights cannot drive this avatar: its expressions are a basis of their own (such as FLAME's) and "
    "no matrix from the 52 ARKit names to it is known; fit one to faces that have both, write it as JSON "
    '{"inputs": [ARKit names], "outputs": ["expression/NAME", "eyelid/NAME", "joint/NAME/x|y|z"], "matrix": '
    "[[one number per input] per output]} and pass it with --driving FILE"
)


NOTHING_TO_DRIVE = (
    "has no expression, eyelid or jaw that ARKit weights could drive; an avatar that is embedded in a mesh gets "
    "them with its rig: convert it again with --rig or --body-model"
)


@dataclass(frozen=True)
class LinearMap:
    """outputs = matrix @ inputs, for either mode."""

    inputs: tuple[str, ...]  # [I] ARKit names
    outputs: tuple[str, ...]  # [O]
    matrix: F64  # [O, I]


def linear_map(avatar: Avatar) -> LinearMap:
    """The linear map from ARKit names to the outputs of `avatar`. Raises AvatarError for driving mode "none"."""
    maps: dict[str, Callable[[Avatar], LinearMap]] = {"names": _map_by_name, "matrix": _map_by_matrix}
    if avatar.driving.mode not in maps:
        message = NO_DRIVING if avatar.expressions or avatar.eyelids else NOTHING_TO_DRIVE
        raise AvatarError(message, owner=avatar.name, field="driving")
    return maps[avatar.driving.mode](avatar)


def _map_by_name(avatar: Avatar) -> LinearMap:
    targets = [(f"expression/{e.name}", (e.name, *e.aliases)) for e in avatar.expressions]
    targets += [(f"eyelid/{name}", (name,)) for name in avatar.eyelids]
    rows = [(output, first_canonical(names)) for output, names in targets]
    reached = [(output, name) for output, name in rows if name is not None]
    matrix = np.array([[float(name == column) for column in ARKIT_NAMES] for _, name in reached])
    return LinearMap(
        ARKIT_NAMES, tuple(output for output, _ in reached), matrix.reshape(-1, len(ARKIT_NAMES))
    )


def _map_by_matrix(avatar: Avatar) -> LinearMap:
    driving = avatar.driving
    if driving.matrix is None:
        raise AvatarError("mode 'matrix' without a matrix", owner=avatar.name, field="driving")
    return LinearMap(driving.inputs, driving.outputs, driving.matrix.astype(np.float64))
