"""rig.glb: the rig as far as glTF 2.0 can represent it, for engines and modelling tools.

    avatar_mesh   the skinned mesh, in the scene's root, as glTF wants it
    avatar_root   world_from_avatar; the joints are below it under their own names, at rest

Plain float, no extension, no compression, since importers reorder or refuse packed data. Morph targets are named in
mesh.extras.targetNames as engine_pose.target_names has them. There is no texture, so the first UV set can
carry the vertex's row in rig.safetensors through importers that drop attributes with other names:
u = row % 256, v = 2 + row // 256, exact in half floats; an importer that flips v makes it negative. `_VERTEX_ID`
is the same as one float. COLOR_0 is the colour of the Gaussians around each vertex in the binding pose.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pygltflib as gltf

from avatar_export.ops.vertex_colour import linear_from_display, vertex_colours
from avatar_export.writers.engine_mesh import EngineMesh, engine_mesh, vertex_id_uv
from avatar_export.writers.glb_builder import Array, GlbBuilder
from avatar_runtime.avatar import Avatar, Clip, Rig
from avatar_runtime.engine_pose import EnginePose, bind_nodes, engine_clip, engine_rest, node_names
from avatar_runtime.io.errors import AvatarError

FILE = "rig.glb"
MOST_JOINTS = 65_535  # JOINTS_n are u16
MOST_VERTICES = 1 << 24  # _VERTEX_ID is a float
MESH_NODE, ROOT_NODE, FIRST_JOINT = 0, 1, 2
STILL = 1e-6  # metres, or parts of 1; smaller motion is rounding and gets no channel


def rig_glb(avatar: Avatar, influences: int = 4) -> Iterator[bytes | memoryview] | None:
    """The bytes of rig.glb in pieces; None for an avatar without a rig, or whose rig has no joint or no triangle.

    `influences` joints a vertex, 4 or 8: with 8 the second four are JOINTS_1 and WEIGHTS_1, which some importers
    ignore. Same avatar, same bytes. Raises AvatarError for a rig with too many joints or vertices for glTF, and for a
    clip that engine_pose refuses; ValueError for another number of influences.
    """
    if avatar.rig is None or not avatar.rig.joint_count:
        return None
    _check_limits(avatar.rig)
    mesh = engine_mesh(avatar)
    if not len(mesh.triangles):
        return None
    builder = GlbBuilder(FILE)
    _add_mesh(builder, mesh, influences, linear_from_display(vertex_colours(avatar, avatar.rig)))
    rest = engine_rest(avatar)
    _add_skeleton(builder, avatar.rig, rest)
    for clip in avatar.clips:
        _add_clip(builder, clip, engine_clip(avatar, clip), rest)
    return builder.pieces()


def _check_limits(rig: Rig) -> None:
    for field, count, most in (
        ("joints", rig.joint_count, MOST_JOINTS),
        ("vertices", len(rig.vertices), MOST_VERTICES),
    ):
        if count > most:
            message = f"has {count} {field}, but glTF holds {most}; reduce the rig, or write no engine files"
            raise AvatarError(message, file=FILE, field=field)


def _add_mesh(builder: GlbBuilder, mesh: EngineMesh, influences: int, colour: Array) -> None:
    """`colour`: [V, 3] linear light, of every row of the rig."""
    document = builder.document
    attributes = {"POSITION": builder.accessor(mesh.vertices, gltf.ARRAY_BUFFER, bounds=True)}
    opaque = np.ones((len(mesh.vertex_id), 1))
    coloured = {"COLOR_0": np.concatenate([colour[mesh.vertex_id], opaque], axis=1).astype(np.float32)}
    for name, array in (_attributes(mesh, influences) | coloured).items():
        attributes[name] = builder.accessor(array, gltf.ARRAY_BUFFER)
    wide = len(mesh.vertices) > 65_535  # the largest index of a type is reserved to restart a strip
    corners = mesh.triangles.reshape(-1).astype(np.uint32 if wide else np.uint16)
    primitive = gltf.Primitive(
        attributes=gltf.Attributes(**attributes),
        indices=builder.accessor(corners, gltf.ELEMENT_ARRAY_BUFFER),
        material=0,
        targets=[{"POSITION": builder.sparse(len(mesh.vertices), t.rows, t.offsets)} for t in mesh.targets],
    )
    document.materials = [
        gltf.Material(
            name="avatar",
            pbrMetallicRoughness=gltf.PbrMetallicRoughness(
                baseColorFactor=[1.0, 1.0, 1.0, 1.0], metallicFactor=0.0, roughnessFactor=0.9
            ),
        )
    ]
    document.meshes = [
        gltf.Mesh(
            name="avatar",
            primitives=[primitive],
            weights=[0.0] * len(mesh.targets),
            extras={"targetNames": [t.name for t in mesh.targets]} if mesh.targets else {},
        )
    ]


def _attributes(mesh: EngineMesh, influences: int) -> dict[str, Array]:
    """Vertex attributes besides POSITION, each [v, ...]."""
    found = mesh.influences(influences)
    joints = found.joints.astype(np.uint8) if mesh.skin.columns <= 256 else found.joints
    attributes: dict[str, Array] = {
        "NORMAL": mesh.normals,
        "TEXCOORD_0": vertex_id_uv(mesh.vertex_id),
        "_VERTEX_ID": mesh.vertex_id.astype(np.float32),
    }
    for number in range(influences // 4):
        four = slice(4 * number, 4 * number + 4)
        attributes[f"JOINTS_{number}"] = joints[:, four]
        attributes[f"WEIGHTS_{number}"] = found.weights[:, four]
    return attributes


def _add_skeleton(builder: GlbBuilder, rig: Rig, rest: EnginePose) -> None:
    document = builder.document
    root_name, mesh_name = node_names(rig)
    document.nodes = [gltf.Node(name=mesh_name, mesh=0, skin=0), gltf.Node(name=root_name)]
    for name, translation, rotation, scale in zip(
        rig.joint_names, rest.translation, rest.rotation_xyzw, rest.scale, strict=True
    ):
        node = gltf.Node(name=name, translation=translation.tolist(), rotation=rotation.tolist())
        if (np.abs(scale - 1) > STILL).any():
            node.scale = scale.tolist()
        document.nodes.append(node)
    for j, parent in enumerate(rig.parents.tolist()):
        above = document.nodes[ROOT_NODE if parent < 0 else FIRST_JOINT + parent]
        above.children.append(FIRST_JOINT + j)
    inverse_bind = np.linalg.inv(bind_nodes(rig)).astype(np.float32)
    document.skins = [
        gltf.Skin(
            inverseBindMatrices=builder.accessor(inverse_bind),
            joints=list(range(FIRST_JOINT, FIRST_JOINT + rig.joint_count)),
            skeleton=ROOT_NODE,
        )
    ]
    document.scenes = [gltf.Scene(nodes=[MESH_NODE, ROOT_NODE])]


def _add_clip(builder: GlbBuilder, clip: Clip, moved: EnginePose, rest: EnginePose) -> None:
    """Adds an animation with a channel for all that the clip moves away from `rest`; frame k is at k / fps seconds."""
    time = builder.accessor((np.arange(clip.frames) / clip.fps).astype(np.float32), bounds=True)
    animation = gltf.Animation(name=clip.name)
    channels = [
        channel
        for channel, (_, _, still) in zip(_channels(moved), _channels(rest), strict=True)
        if (np.abs(channel[2] - still) > STILL).any()
    ]
    for node, path, values in channels or [next(_channels(moved))]:  # glTF has no empty animation
        output = builder.accessor(
            values.astype(np.float32).reshape(-1 if path == "weights" else values.shape)
        )
        animation.samplers.append(gltf.AnimationSampler(input=time, output=output, interpolation="LINEAR"))
        target = gltf.AnimationChannelTarget(node=node, path=path)
        animation.channels.append(gltf.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))
    builder.document.animations.append(animation)


def _channels(pose: EnginePose) -> Iterator[tuple[int, str, Array]]:
    """(node, path, values) of everything that an engine can animate; the values of a clip have a first axis [T]."""
    yield ROOT_NODE, "translation", pose.root_translation
    yield ROOT_NODE, "rotation", pose.root_rotation_xyzw
    for j in range(pose.translation.shape[-2]):
        yield FIRST_JOINT + j, "translation", pose.translation[..., j, :]
        yield FIRST_JOINT + j, "rotation", pose.rotation_xyzw[..., j, :]
        yield FIRST_JOINT + j, "scale", pose.scale[..., j, :]
    yield MESH_NODE, "weights", pose.weights
