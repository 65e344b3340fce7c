"""A LAM avatar driven by the recorded take: lids and lips go where the recorded weights say.

The rows of a lid or lip are chosen on the mesh at rest, from the morphs that the rig ships; the gap is then
measured on the played Gaussians of all 300 frames, with all their weights and the head's rotation at work.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from samples.make import make_lam

from avatar_export.driving.drive import poses
from avatar_export.driving.takes import read_take
from avatar_export.readers.lam import read_lam
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from tests.measured import Measure
from tests.runtime.driving.recordings import CSV, recording
from tests.shared_data import shared

MOVED, STILL = 0.8, 0.1  # of the largest delta of a morph
LIPS_MEET = 0.006  # metres; a trained neutral mouth stands open by up to 5 mm
LIP_OPENS, LIP_STAYS = 0.4, 0.1  # of jawOpen's largest delta, which is the chin's

Array = npt.NDArray[np.float64]
Rows = npt.NDArray[np.int64]


def _delta(avatar: Avatar, name: str) -> Array:
    """[N, 3] what one expression adds to every Gaussian's position."""
    geometry = avatar.blendshapes.geometry
    row = np.repeat(np.arange(geometry.rows), np.diff(geometry.row_ptr.astype(np.int64)))
    chosen = geometry.column == avatar.expression_names.index(name)
    delta = np.zeros((geometry.rows, 3))
    delta[row[chosen]] = geometry.values["mean"][chosen]
    return delta


def _skin(avatar: Avatar, row: int) -> npt.NDArray[np.bool_]:
    """[V] the vertices connected to `row` (eyeballs and teeth are pieces of their own)."""
    assert avatar.rig is not None
    triangles = avatar.rig.triangles.astype(np.int64)
    inside = np.zeros(len(avatar.rig.vertices), bool)
    inside[row] = True
    while True:
        grown = inside.copy()
        grown[triangles[inside[triangles].any(axis=1)]] = True
        if np.array_equal(grown, inside):
            return inside
        inside = grown


def lid_rows(avatar: Avatar, side: str) -> tuple[Rows, Rows]:
    """(upper, lower): what eyeBlink moves most, and the still skin nearest to where that comes to rest."""
    assert avatar.rig is not None
    vertices = avatar.rig.vertices.astype(np.float64)
    delta = _delta(avatar, f"eyeBlink{side}")
    size = np.linalg.norm(delta, axis=1)
    upper = np.flatnonzero(size >= MOVED * size.max())
    still = np.flatnonzero((size <= STILL * size.max()) & _skin(avatar, int(np.argmax(size))))
    away = np.linalg.norm((vertices + delta)[upper][:, None] - vertices[still], axis=2)
    return upper, np.unique(still[np.argmin(away, axis=1)])


def lip_rows(avatar: Avatar) -> tuple[Rows, Rows]:
    """(upper, lower): skin closer than LIPS_MEET at rest of which jawOpen moves one and leaves the other.

    Only where the mouth opens do such rows lie side by side; on a cheek the motion fades over centimetres.
    """
    assert avatar.rig is not None
    vertices = avatar.rig.vertices.astype(np.float64)
    size = np.linalg.norm(_delta(avatar, "jawOpen"), axis=1)
    skin = _skin(avatar, int(np.argmax(size)))
    stays = np.flatnonzero((size <= LIP_STAYS * size.max()) & skin)
    opens = np.flatnonzero((size >= LIP_OPENS * size.max()) & skin)
    box = (vertices[opens].min(axis=0) - LIPS_MEET, vertices[opens].max(axis=0) + LIPS_MEET)
    stays = stays[((vertices[stays] >= box[0]) & (vertices[stays] <= box[1])).all(axis=1)]
    touch = np.linalg.norm(vertices[stays][:, None] - vertices[opens], axis=2) < LIPS_MEET
    return stays[touch.any(axis=1)], opens[touch.any(axis=0)]


class Driven:
    """The take played: weights [300] by name, and the gap [300] in metres between two sets of rows."""

    def __init__(self, name: str, path: Path) -> None:
        self.name = name
        self.avatar = read_lam(path)
        self.poses = poses(self.avatar, read_take(recording(CSV)))
        player = Player(self.avatar)
        self.means = np.array([player.animate(pose).mean for pose in self.poses])

    def weight(self, name: str) -> Array:
        return np.array([pose.expressions[name] for pose in self.poses])

    def gap(self, upper: Rows, lower: Rows) -> Array:
        """Signed: how high the upper rows' centre lies above the lower's."""
        assert len(upper) >= 3 and len(lower) >= 3
        height = self.means[:, :, 1].astype(np.float64)
        result: Array = height[:, upper].mean(axis=1) - height[:, lower].mean(axis=1)
        return result


def correlation(a: Array, b: Array) -> float:
    return float(np.corrcoef(a, b)[0, 1])


@pytest.fixture(scope="module", params=["sample", "real"])
def driven(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Driven:
    if request.param == "real":
        return Driven("trained avatar", shared("lam/p2-1.zip"))
    return Driven("sample", make_lam(tmp_path_factory.mktemp("lam")))


@pytest.mark.parametrize("side", ["Left", "Right"])
def test_lids_close_with_the_recorded_blink(driven: Driven, side: str, measured: Measure) -> None:
    gap = driven.gap(*lid_rows(driven.avatar, side))
    blink = driven.weight(f"eyeBlink{side}")
    measured(f"LAM {driven.name}, lid gap against eyeBlink, correlation", correlation(-gap, blink))
    assert correlation(-gap, blink) >= 0.9
    assert gap[np.argmax(blink)] < 0.3 * gap[np.argmin(blink)]


def test_lips_part_with_the_recorded_jaw(driven: Driven, measured: Measure) -> None:
    """mouthClose shuts the lips of an open jaw, and this take holds it up to 0.65 while the jaw is open.

    So the gap is that of jawOpen where mouthClose is small; in all 300 frames it is that of jawOpen and
    mouthClose together, in the proportion in which this avatar's two morphs part and shut its lips.
    """
    upper, lower = lip_rows(driven.avatar)
    gap = driven.gap(upper, lower)
    jaw, close = driven.weight("jawOpen"), driven.weight("mouthClose")
    alone = close < 0.1
    assert np.count_nonzero(alone) > 100 and jaw[alone].max() > 0.8
    label = f"LAM {driven.name}, lip gap against jawOpen"
    measured(f"{label}, all frames, correlation", correlation(gap, jaw))
    measured(f"{label} where mouthClose < 0.1, correlation", correlation(gap[alone], jaw[alone]))
    assert correlation(gap[alone], jaw[alone]) >= 0.9
    parts, shuts = (
        delta[upper, 1].mean() - delta[lower, 1].mean()
        for delta in (_delta(driven.avatar, name) for name in ("jawOpen", "mouthClose"))
    )
    assert parts > 0.01 and shuts < 0
    assert correlation(gap, jaw * parts + close * shuts) >= 0.9
