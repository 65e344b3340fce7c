"""The reference of a pack keeps all anchor vertices, which players pose themselves."""

from __future__ import annotations

import numpy as np

from avatar_export.packing.write import pack
from avatar_export.writers.reference_cases import reference_cases
from avatar_runtime.conformance import make_reference
from avatar_runtime.packs import decode_pack
from tests.avatars import full_avatar
from tests.exporter.packing.cases import COARSE


def test_all_anchors_are_kept() -> None:
    avatar = decode_pack(pack([full_avatar(5)], COARSE).file, "full").avatar
    assert avatar.rig is not None
    reference = make_reference(avatar, reference_cases(avatar)[:1], rows=2, pixels=8)
    assert np.isin(avatar.rig.anchor_vertices, reference.vertices).all()
