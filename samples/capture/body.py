"""The walking man as a capture: seen by a camera that circles him while he walks on the spot."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pygltflib as gltf

from avatar_export.clips.poses import rig_avatar
from avatar_export.clips.sources import clips_from
from avatar_export.rigs.rig_file import read_rig_file
from avatar_runtime.camera import Camera
from avatar_runtime.pose import joint_rotation
from avatar_trainer.captures.mesh_raster import Surface, draw
from avatar_trainer.captures.own import Shot, write
from avatar_trainer.head import Mesh, smoothstep, unit
from samples.capture.shots import Noise, camera_towards, rays_per_pixel, shot, splits
from samples.subjects.body import ATTRIBUTES, Body, load_body, values
from samples.subjects.glb import Builder

Array = npt.NDArray[Any]

FPS = 24.0  # the rate of the walk's keys
RIG = "body/CesiumMan_welded.glb"
TARGET, DISTANCE, FOV_Y = (-0.05, 0.71, 0.0), 2.9, 0.61
TURNS, START = 2.0, 0.4  # rounds of the camera during the capture; its start, radians from the front
PITCH = (0.2, 0.25, 5.0, 0.5)  # radians: mean, swing; beats over the capture, start
LIGHT, DARK, LIT = unit(np.array([0.25, 0.8, 0.55])), 0.68, 0.32
SOURCE = "synthetic: computed pictures of a textured mesh, no footage; parameters exact but for the noise asked for"
LICENSE = "Cesium Man, donated by Cesium for glTF testing; the logo is Cesium's trademark: CC BY 4.0; seams welded, lit"
AUTHOR = "figure: Cesium; pictures: avatar-export samples.capture"
CONSENT = "the figure is no person"


def write_body(out: Path, size: int, frames: int, noise: Noise) -> Path:
    """Write the man's capture into the folder `out`: capture.json, images/, masks/, body/. Returns capture.json's path.

    Raises ValueError for fewer than two frames.
    """
    body = load_body()
    (out / RIG).parent.mkdir(parents=True, exist_ok=True)
    (out / RIG).write_bytes(welded_glb(body))
    return write(
        out,
        name="walking man, synthetic",
        fps=FPS,
        head_pose_in="mesh",
        expressions=(),
        body={"kind": "rig", "rig": RIG},
        frames=shots(body, out / RIG, size, frames, noise),
        source=SOURCE,
        license=LICENSE,
        author=AUTHOR,
        consent=CONSENT,
    )


def welded_glb(body: Body) -> bytes:
    """The man's rig and walk without seams, texture and material; vertices are numbered as in `Body`."""
    b, source = Builder(), body.document
    primitive = source.meshes[0].primitives[0]
    rows = {
        name: values(source, getattr(primitive.attributes, name))[body.file_vertex] for name in ATTRIBUTES
    }
    attributes = gltf.Attributes(
        POSITION=b.accessor(rows["POSITION"], gltf.ARRAY_BUFFER, bounds=True),
        JOINTS_0=b.accessor(rows["JOINTS_0"], gltf.ARRAY_BUFFER),
        WEIGHTS_0=b.accessor(rows["WEIGHTS_0"], gltf.ARRAY_BUFFER),
    )
    indices = b.accessor(body.triangles.astype("<u2").reshape(-1), gltf.ELEMENT_ARRAY_BUFFER)
    b.doc.meshes = [
        gltf.Mesh(name="man", primitives=[gltf.Primitive(attributes=attributes, indices=indices)])
    ]
    b.doc.nodes, b.doc.scenes, b.doc.scene = source.nodes, source.scenes, source.scene
    skin = source.skins[0]
    bind = values(source, skin.inverseBindMatrices).reshape(-1, 4, 4)
    b.doc.skins = [gltf.Skin(name=skin.name, joints=skin.joints, inverseBindMatrices=b.accessor(bind))]
    walk = source.animations[0]
    samplers = [
        gltf.AnimationSampler(
            input=b.accessor(values(source, sampler.input)[:, 0], bounds=True),
            output=b.accessor(values(source, sampler.output)),
            interpolation=sampler.interpolation,
        )
        for sampler in walk.samplers
    ]
    b.doc.animations = [gltf.Animation(name="walk", samplers=samplers, channels=walk.channels)]
    return b.save()


def shots(body: Body, rig_path: Path, size: int, frames: int, noise: Noise) -> Iterator[tuple[str, Shot]]:
    """(name, shot) of every frame: the walk repeats, one key per frame."""
    avatar = rig_avatar(read_rig_file(rig_path).rig, ())
    (walk,) = clips_from(avatar, rig_path)
    assert avatar.rig is not None
    names = avatar.rig.joint_names
    first = walk.frames - len(body.times)  # a clip begins at 0 s, the walk's keys later
    for k, split in enumerate(splits(frames)):
        key = k % len(body.times)
        intrinsics, rotation, translation = camera_at(k, frames, size)
        camera = Camera.from_opencv(rotation, translation, intrinsics, size, size)
        image = draw(surface(body, key), camera, rays_per_pixel(size))
        deltas = walk.joint_delta[first + key].astype(np.float64)
        wrong = noise.tracked(np.zeros((len(names), 3)))
        joints = {name: deltas[j] @ joint_rotation(wrong[j]) for j, name in enumerate(names)}
        stated = noise.calibrated(intrinsics, rotation, translation)
        yield f"{k:05d}", shot(image, stated, np.zeros(0), joints, split)


def surface(body: Body, key: int) -> Surface:
    """The textured man at a key of his walk, lit from above."""
    mesh: Mesh = body.posed(key)
    lit = smoothstep(mesh.vertex_normals @ LIGHT, -1.0, 1.0)
    v = len(mesh.vertices)
    return Surface(
        mesh.vertices,
        mesh.triangles,
        body.uv.astype(np.float32),
        body.texture.astype(np.float32),
        (DARK + LIT * lit).astype(np.float32),
        np.zeros(v, np.float32),
        np.ones(v, np.float32),
    )


def camera_at(frame: int, frames: int, size: int) -> tuple[Array, Array, Array]:
    """(K, R, t) of the camera, OpenCV, on its way around the man."""
    share = frame / frames
    mean, swing, beats, start = PITCH
    yaw = START + 2 * np.pi * TURNS * share
    pitch = mean + swing * np.sin(2 * np.pi * beats * share + start)
    return camera_towards(np.array(TARGET), DISTANCE, yaw, pitch, FOV_Y, size)
