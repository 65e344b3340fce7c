"""The tensors of embedding.safetensors, both directions."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import Embedding
from avatar_runtime.codec.tensors import tensor
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.topology import vertex_triangles

Tensors = dict[str, npt.NDArray[Any]]

OWN = (
    *("canonical_vertices", "triangles", "triangle", "barycentric"),
    *("displacement", "local_offset", "local_quat_wxyz"),
)


def embedding_tensors(embedding: Embedding) -> Tensors:
    """What embedding.safetensors holds: the embedding, and values that a GPU would otherwise have to look up."""
    own: Tensors = {name: getattr(embedding, name) for name in OWN}
    return own | _looked_up(embedding)


def read_embedding_tensors(tensors: Tensors, file: str) -> Embedding:
    """Inverse of `embedding_tensors`. Raises AvatarError for a missing tensor or a lookup that contradicts."""
    embedding = Embedding(**{name: tensor(tensors, name, file) for name in OWN})
    _check_index(embedding.triangles, 2, len(embedding.canonical_vertices), "triangles", file)
    _check_index(embedding.triangle, 1, len(embedding.triangles), "triangle", file)
    for name, want in _looked_up(embedding).items():
        if not np.array_equal(tensor(tensors, name, file), want):
            raise AvatarError("is not what triangles and triangle give", file=file, field=name)
    return embedding


def _looked_up(embedding: Embedding) -> Tensors:
    ptr, triangle = vertex_triangles(embedding.triangles, len(embedding.canonical_vertices))
    return {
        "vertex_ids": embedding.vertex_ids,
        "vertex_triangle_ptr": ptr,
        "vertex_triangle": triangle,
    }


def _check_index(index: npt.NDArray[Any], axes: int, limit: int, name: str, file: str) -> None:
    """Checks the indices that the lookup uses; `check_avatar` checks the rest."""
    if index.dtype != np.uint32 or index.ndim != axes or index.shape[1:] not in ((), (3,)):
        raise AvatarError(f"is {index.dtype}{list(index.shape)}, expected u32", file=file, field=name)
    if index.size and int(index.max()) >= limit:
        raise AvatarError(f"holds {int(index.max())}, but there are {limit}", file=file, field=name)
