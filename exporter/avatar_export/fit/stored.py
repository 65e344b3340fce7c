"""Positions and rotations that a .ply holds beside the embedding that they follow from: do the two say the same?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from avatar_export.fit.orientation import FORMS
from avatar_export.fit.sampled import Bools, unit_rows
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.player import ABSURD
from avatar_runtime.stages.surface import binding_pose

FEWEST, SHARE = 16, 0.01  # rows, and of all rows, that must differ
EQUAL = 1e-5  # metres; a mesh of six decimals and float32 give 2e-6
SAME_TURN = 1 - 1e-3  # cosine of half the angle between two rotations: 5 degrees
NEAR = 0.01  # of the avatar's size; what is farther is said by places.stored_positions
EXPLAINED = 0.9  # of the rows that differ


@ABSURD
def stored_doubts(mean: F32, quat_wxyz: F32, avatar: Avatar, cloud: str) -> list[Note]:
    """Doubts about embedded Gaussians whose places `mean` [N, 3] (metres) or rotations in the file `cloud` differ.

    Of the same frame they are equal; in another frame they may all differ, which is no doubt unless a known mistake
    explains it.
    """
    with np.errstate(all="ignore"):
        turned = ~(_cosine(unit_rows(quat_wxyz), unit_rows(avatar.gaussians.quat_wxyz)) > SAME_TURN)
        return [*_moved(mean, turned, avatar, cloud), *_turned(mean, quat_wxyz, turned, avatar, cloud)]


def _moved(mean: F32, turned: Bools, avatar: Avatar, cloud: str) -> Iterator[Note]:
    embedding = avatar.embedding
    assert embedding is not None
    differs = _apart(mean, avatar.gaussians.mean) > EQUAL
    if not _many(differs) or not len(embedding.displacement):
        return
    other, size = replace(embedding, displacement=-embedding.displacement), np.ptp(mean, axis=0).max()
    there = binding_pose(other, avatar.rules, avatar.training_per_bundle)[0]
    if (_apart(mean, there)[differs] <= EQUAL).mean() > EXPLAINED:
        yield doubt("displacement_mirrored", cloud=cloud, share=differs.mean())
    elif not _many(turned) and np.median(_apart(mean, avatar.gaussians.mean)[differs]) < NEAR * size:
        yield doubt("stored_elsewhere", cloud=cloud, share=differs.mean())


def _turned(mean: F32, quat_wxyz: F32, differs: Bools, avatar: Avatar, cloud: str) -> Iterator[Note]:
    given, own = unit_rows(quat_wxyz), unit_rows(avatar.gaussians.quat_wxyz)
    if not _many(differs):
        return
    for form, other in FORMS.items():
        alike = np.maximum(_cosine(other(given), own), _cosine(given, other(own)))[differs] > SAME_TURN
        if alike.mean() > EXPLAINED:
            yield doubt("stored_quaternions", cloud=cloud, form=form, share=differs.mean())
            return
    if (_apart(mean, avatar.gaussians.mean) <= EQUAL)[differs].mean() > EXPLAINED:
        yield doubt("stored_quaternions", cloud=cloud, form=None, share=differs.mean())


def _many(differs: Bools) -> bool:
    return int(np.count_nonzero(differs)) >= max(FEWEST, SHARE * len(differs))


def _apart(a: F32, b: F32) -> F64:
    apart: F64 = np.linalg.norm(a.astype(np.float64) - b, axis=1)
    return apart


def _cosine(a: F64, b: F64) -> F64:
    """[N] of half the angle between rotations `a` and `b` [N, 4]."""
    cosine: F64 = np.abs(np.einsum("ij,ij->i", a, b))
    return cosine
