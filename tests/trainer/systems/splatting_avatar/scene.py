"""A small capture for SplattingAvatar: a bumpy sheet with a FLAME-like skeleton, painted with Gaussians of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.own import Shot, write
from avatar_trainer.systems.drawing import draw
from avatar_trainer.systems.splatting_avatar.system import Settings, SplattingAvatar, create
from tests.exporter.bodies import body_files

Array = npt.NDArray[Any]
SIZE, FRAMES = 48, 4
SIDE = 9  # vertices along the sheet
WIDTH = 0.24  # metres
AWAY = 0.9
K = np.array([[150.0, 0, SIZE / 2], [0, 150.0, SIZE / 2], [0, 0, 1]])
FACING = np.diag([1.0, -1.0, -1.0])  # a camera before the sheet: +y down, +z into it


def sheet(side: int = SIDE) -> Array:
    """Triangles [F, 3] of a square sheet of side x side vertices, wound so that normals point to +z."""
    at = np.arange(side * side).reshape(side, side)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    return np.concatenate([np.stack([a, b, c], 1), np.stack([c, d, a], 1)])


def body() -> dict[str, Array]:
    """Arrays of a body model in FLAME's layout; expression 0 raises a bump, the jaw turns the lower half."""
    line = np.linspace(-WIDTH / 2, WIDTH / 2, SIDE)
    y, x = np.meshgrid(line, line, indexing="ij")
    vertices = np.stack([x, y, 0.03 * np.cos(9 * x) * np.cos(11 * y)], axis=-1).reshape(-1, 3)
    joints, count = len(body_files.FLAME_PARENTS), SIDE * SIDE
    jaw = np.clip(0.5 - vertices[:, 1] / WIDTH, 0, 1)
    weights = np.zeros((count, joints))
    weights[:, 1], weights[:, 2] = 1 - jaw, jaw
    expression = np.zeros((count, 3, 1))
    expression[:, 2, 0] = 0.02 * np.exp(-400 * (vertices[:, 0] ** 2 + vertices[:, 1] ** 2))
    rng = np.random.default_rng(4)
    return {
        "v_template": vertices.astype("f4"),
        "triangles": sheet(),
        "identity": np.zeros((count, 3, 1), "f4"),
        "expression": expression.astype("f4"),
        "posedirs": rng.normal(0, 1e-3, (count, 3, 9 * (joints - 1))).astype("f4"),
        "regressor": np.full((joints, count), 1 / count, "f4"),
        "weights": weights.astype("f4"),
        "parents": np.array(body_files.FLAME_PARENTS),
    }


def shot(frame: int, image: Array, mask: Array, **changed: Any) -> Shot:
    """Frame 0 is at rest, the others bend."""
    rng = np.random.default_rng(frame)
    bend = np.array([0.3, 0.2, -0.1]) * min(frame, 1) * rng.uniform(-1, 1)
    fields: dict[str, Any] = {
        "image": image,
        "mask": mask,
        "intrinsics": K,
        "rotation": FACING,
        "translation": np.array([0, 0, AWAY]),
        "expression": np.array([min(frame, 1) * rng.uniform(0, 1)], np.float32),
        "joints": {"jaw": bend},
        "world_from_avatar": np.eye(4),
        "split": "train" if frame < FRAMES - 1 else "test",
    }
    return Shot(**(fields | changed))


def folder(path: Path, images: list[tuple[Array, Array]], **changed: Any) -> Path:
    """A capture with these (image, mask)."""
    (path / "body").mkdir(parents=True)
    body_files.write_body(path / "body" / "body_model.npz", body())
    write(
        path,
        name="sheet",
        fps=25,
        head_pose_in="camera",
        expressions=("exp_000",),
        body={"kind": "body_model", "model": "body/body_model.npz"},
        frames=((f"{t:03d}", shot(t, *image, **changed)) for t, image in enumerate(images)),
        source="synthetic", license="CC0", author="nobody", consent="none is needed",
    )  # fmt: skip
    return path


def blank(path: Path, frames: int = FRAMES, **changed: Any) -> Capture:
    """A capture of grey images."""
    image = (np.full((SIZE, SIZE, 3), 128, np.uint8), np.full((SIZE, SIZE), 255, np.uint8))
    return load(folder(path, [image] * frames, **changed))


def teacher(capture: Capture, count: int = 150, seed: int = 7) -> SplattingAvatar:
    """An avatar with many colours and none of its values at their start."""
    system = create(capture, Settings(iterations=100, gaussians=count, init_colour="grey"), seed)
    scatter(system, seed)
    return system


def scatter(system: SplattingAvatar, seed: int) -> None:
    """Random values for everything that is trained, (u, v) too."""
    generator = torch.Generator().manual_seed(seed)

    def noise(name: str, size: float) -> torch.Tensor:
        return size * torch.randn(system.table[name].shape, generator=generator)

    with torch.no_grad():
        for name, size in (("log_scale", 0.3), ("rotation", 1.0), ("sh_dc", 1.0), ("sh_rest", 0.2)):
            system.table[name].add_(noise(name, size))
        system.table["opacity_logit"].copy_(2 + noise("opacity_logit", 1.0))
        for name, size in (("displacement", 0.01), ("shift_uv", 0.05), ("shift_xyz", 0.01)):
            if name in system.embedding.trained:
                system.table[name].copy_(noise(name, size))
        system.embedding.after_step(system.table)


def images(system: SplattingAvatar, capture: Capture) -> list[tuple[Array, Array]]:
    """(straight colour, mask), 8 bit, of every frame as `system` has it."""
    made = []
    for frame in capture.frames:
        drawn = draw(system, frame)
        alpha = drawn.alpha[..., None]
        straight = (drawn.colour / alpha.clamp_min(1e-3)).clamp(0, 1)
        made.append(tuple((255 * part + 0.5).to(torch.uint8).numpy() for part in (straight, drawn.alpha)))
    return made


def taught(path: Path) -> Capture:
    """A capture of images of the teacher."""
    plain = blank(path / "blank")
    return load(folder(path / "taught", images(teacher(plain), plain)))


def settings(**values: Any) -> Settings:
    """Settings with rules given beside them."""
    plain = Settings(iterations=100, gaussians=150)
    rules = {name: values.pop(name) for name in plain.rules if name in values}
    return replace(plain, rules={**plain.rules, **rules}, **values)


def system_of(capture: Capture, **values: Any) -> SplattingAvatar:
    return create(capture, settings(**values), 0)
