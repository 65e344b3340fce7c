"""The eyes that captures show: lids meet evenly, irises have no hard edges, the whites lie in the shade of the lids."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from samples.capture import eyes
from samples.capture.head import close_camera
from samples.subjects.body_model import BodyModel
from samples.subjects.colour import iris_colour
from samples.subjects.head import DATA, Head, Mesh, load_head, unit
from samples.subjects.surface import Samples
from samples.subjects.take import performed, posed_vertices

from avatar_runtime.camera import Camera
from avatar_trainer.captures.mesh_raster import Surface, draw

F64 = npt.NDArray[np.float64]
SIZE = 96


def shut(head: Head, weight: float) -> F64:
    """Vertices [V, 3] with both lids at this weight."""
    lids = head.expression("eyeBlinkLeft") + head.expression("eyeBlinkRight")
    return head.vertices + weight * lids


def white_of(head: Head, vertices: F64, side: int, yaw: float) -> npt.NDArray[np.float32]:
    """[H, W] how much of each pixel shows the eyeball `side`, seen from `yaw` radians aside."""
    own = head.in_part(eyes.EYES[side]).astype(np.float32)
    faces = len(head.triangles)
    white = np.ones((1, 1, 3), np.float32)
    nothing = np.zeros_like(own)
    surface = Surface(
        vertices, head.triangles, np.zeros((faces, 3, 2), np.float32), white, own, nothing, nothing + 1
    )
    camera = Camera.orbit(head.eye_centres[side], 0.4, yaw, 0.0, 0.09, SIZE, SIZE)
    return draw(surface, camera, 3).colour[..., 0]


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("yaw", [-0.6, 0.0, 0.6])
def test_closed_lids_cover_the_eyeball(head: Head, side: int, yaw: float) -> None:
    assert white_of(head, shut(head, 0), side, yaw).sum() > 300
    assert white_of(head, shut(head, 1), side, yaw).max() == 0


@pytest.mark.parametrize("side", [0, 1])
def test_lids_meet_along_their_whole_length_at_once(head: Head, side: int) -> None:
    """A slit that is left at a weight is left at the inner and at the outer corner; ICT's own is not."""

    def lopsided(one: Head) -> float:
        slit = white_of(one, shut(one, 0.85), side, 0.0).sum(axis=0)
        columns = np.flatnonzero(white_of(one, shut(one, 0), side, 0.0).sum(axis=0) > 0)
        inner, _, outer = np.array_split(slit[columns[:: (1, -1)[side]]], 3)
        return float(abs(inner.sum() - outer.sum()) / max(slit.sum(), 1e-6))

    assert lopsided(head) < 0.5
    even = load_head().expressions.copy()
    for name in ("eyeBlinkLeft", "eyeBlinkRight"):
        even[head.expression_names.index(name)] *= 1.2
    assert lopsided(replace(head, expressions=even)) > 0.6


def test_irises_have_no_edge_that_portraits_cannot_show(head: Head) -> None:
    """Within half a millimetre, less than a pixel of a portrait sees, no colour changes by half of white."""
    face = int(np.flatnonzero(head.triangles_in("left_eye"))[0])
    angle = np.radians(np.linspace(0, 30, 301))
    radius = float(np.linalg.norm(head.vertices[head.in_part("left_eye")][0] - head.eye_centres[0]))
    for turn in np.linspace(0, 2 * np.pi, 8):
        way = np.stack([np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)], axis=1)
        place = head.eye_centres[0] + radius * way
        n = len(place)
        at = Samples(np.full(n, face), np.zeros((n, 3)), place, np.zeros((n, 3, 3)), np.zeros(n))
        colour = iris_colour(head, at, np.zeros((n, 3)))
        step = round(0.0005 / radius / (angle[1] - angle[0]))
        assert np.abs(colour[step:] - colour[:-step]).max() < 0.5
        assert np.ptp(colour.mean(axis=1)) > 0.5, "pupil and white are far apart"


def test_the_scan_stays_as_it_is_about_the_painted_eyes(head: Head) -> None:
    image = np.asarray(Image.open(DATA / "head_texture.webp").convert("RGB"), np.float32) / 255
    with np.load(DATA / "head_uv.npz", allow_pickle=False) as file:
        painted = eyes.painted_eyes(head, image, file["uv"])
    assert painted.shape == (2048, 2048, 3) and painted.min() >= 0 and painted.max() <= 1
    small = painted.reshape(1024, 2, 1024, 2, 3).mean(axis=(1, 3))
    far = np.abs(small - image).max(axis=-1)
    assert np.quantile(far[:700, :700], 0.99) < 0.02  # the tile of the face
    assert np.median(far[720:1000, 660:1000]) > 0.005  # those of the eyes


def test_lids_shade_the_eyeballs(head: Head, body: BodyModel) -> None:
    names = ("eyeBlinkLeft", "eyeBlinkRight")
    take = performed(body, np.zeros(body.shapedirs_identity.shape[2]), names, np.array([[0.0, 0], [1, 1]]))
    still, closed = (
        eyes.lid_shade(head, Mesh(posed_vertices(body, take, k), head.triangles)) for k in range(2)
    )
    ball, way = head.in_part("left_eye"), unit(head.vertices - head.eye_centres[0])
    angle = np.degrees(np.arccos(np.clip(way[:, 2], -1, 1)))
    front, edge = ball & (angle < 12), ball & (angle > 20) & (angle < 30)
    assert still[front].mean() > 0.95 > 0.9 > still[edge].mean()
    assert closed[front].mean() < 0.65
    assert still[~head.in_part(*eyes.EYES)].min() > 0.99


def test_free_directions_are_counted() -> None:
    """Over a wall that hides one side of the sky, half of the directions are free; beyond reach, all."""
    wall = np.array([[[0.01, -9, -9], [0.01, 9, -9], [0.01, 0, 9]]], float)
    point, up = np.zeros((1, 3)), np.array([[0.0, 0, 1]])
    around = eyes._directions(400)
    assert eyes._free_share(point, up, wall, around, 100.0)[0] == pytest.approx(0.5, abs=0.03)
    assert eyes._free_share(point, up, wall, around, 0.005)[0] == 1


def test_close_cameras_look_at_what_moves(head: Head) -> None:
    names = sorted(head.expression_names)
    for frame in range(2 * len(names)):
        k, rotation, translation = close_camera(head, frame, 64)
        eye = -rotation.T @ translation
        name = names[frame % len(names)]
        target = head.eye_centres[int(name.endswith("Right"))] if name.startswith("eye") else None
        if target is not None:
            seen = k @ (rotation @ target + translation)
            assert np.abs(seen[:2] / seen[2] - 32).max() < 6
        assert 0.2 < np.linalg.norm(eye - [0, 0, 0.09]) < 0.55
