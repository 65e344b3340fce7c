"""Draws a rig with bpy: `python docs/tools/draw_in_blender.py FILE OUT.png FRAME`.

Made rigs_in_blender.png with bpy 4.5.15 from the head's and the body's files of `make demo`.
"""

from __future__ import annotations

import math
import sys

import bpy
from mathutils import Vector

PIXELS, SAMPLES = 320, 8


def load(file: str) -> bpy.types.Object:
    """The rigged mesh of `file`, in an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if file.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=file, disable_bone_shape=True)
    else:
        bpy.ops.wm.usd_import(filepath=file, import_proxy=True)
    return next(o for o in bpy.data.objects if o.type == "MESH" and o.find_armature())


def show_colours(mesh: bpy.types.Object) -> None:
    """A material that shows the file's vertex colours."""
    material = bpy.data.materials.new("colours")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    colour = nodes.new("ShaderNodeVertexColor")
    colour.layer_name = mesh.data.color_attributes[0].name
    material.node_tree.links.new(colour.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    mesh.data.materials.clear()
    mesh.data.materials.append(material)


def draw(mesh: bpy.types.Object, out: str, frame: int) -> None:
    """The mesh at a frame of its first clip, from the front and a little to its left."""
    scene = bpy.context.scene
    scene.frame_set(frame)
    shown = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = [shown.matrix_world @ vertex.co for vertex in shown.data.vertices]
    low, high = (Vector([pick(p[i] for p in points) for i in range(3)]) for pick in (min, max))
    away = Vector((0.5, -2.2, 0.15)) * max(high - low)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (low + high) / 2 + away
    camera.rotation_euler = (-away).to_track_quat("-Z", "Y").to_euler()
    camera.data.angle = math.radians(32)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3, (math.radians(50), 0, math.radians(20))
    for thing in (camera, sun):
        scene.collection.objects.link(thing)
    scene.camera, scene.world = camera, bpy.data.worlds.new("grey")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.5, 0.5, 0.5, 1)
    scene.render.engine, scene.cycles.samples = "CYCLES", SAMPLES
    scene.render.resolution_x = scene.render.resolution_y = PIXELS
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = out
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    found = load(sys.argv[1])
    show_colours(found)
    draw(found, sys.argv[2], int(sys.argv[3]))
