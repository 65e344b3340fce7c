"""The two forms of the Gaussian Blendshapes sample agree."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from samples.systems.gaussian_blendshapes import NAN_ROWS

from avatar_export.formats.pth import read_checkpoint
from tests.hostile import read_all


def dump(base: Path, name: str) -> np.ndarray:
    return np.load(base / "model" / "fix_chkpnt40000" / f"{name}.npy", allow_pickle=False)


def test_folded_raw_form_is_the_dump_to_the_bit(conformance: Path) -> None:
    state, iteration = read_all(read_checkpoint(conformance / "model" / "fix_chkpnt40000.pth"))
    acc = np.load(conformance / "model" / "acc40000.npy", allow_pickle=True).item()
    assert iteration == 40000 and len(state) == 19
    shs = np.concatenate([state[2], state[3]], axis=1)
    bad = np.isnan(state[1]).any(axis=1) | np.isnan(shs).any(axis=(1, 2))
    assert np.flatnonzero(bad).tolist() == sorted(NAN_ROWS)
    mask = acc["expr_mask_tensor"]
    expected = dict(zip(("pos", "scale", "rot", "opacity"), (state[1], *state[4:7]), strict=True))
    expected |= {"shs": shs, "W": acc["W"], "eyelid": acc["eye_blendshape"]}
    for k, (name, start) in enumerate(
        {"xyz": "init_xyz", "shs": "init_sh", "scale": "", "rot": "init_rot", "opacity": ""}.items(), 10
    ):
        by = mask[:, None, None] if name == "shs" else mask[:, None]
        expected[f"{name}_t"] = acc.get(start, np.float32(0)) + by * state[k]
    for name, array in expected.items():
        np.testing.assert_array_equal(array[~bad], dump(conformance, name), err_msg=name)
    np.testing.assert_array_equal(acc["pose_blendshape"][:, ~bad], dump(conformance, "pos_t"))
