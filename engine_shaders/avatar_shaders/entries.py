"""The entry points of hlsl/: which file, kind and stage each has, and where the text made of it lies."""

from __future__ import annotations

from dataclasses import dataclass

LANGUAGES = ("glsl430", "glsl310es", "msl", "wgsl")
MADE = ("glsl310es", "msl", "wgsl")  # the languages of which there are files
FOLDERS = {"glsl430": "glsl", "glsl310es": "glsl", "msl": "msl", "wgsl": "wgsl"}
# The files of glsl/ begin with the first of these. Nothing else differs: GLSL 4.30 ignores the precisions of ES.
GLSL_VERSIONS = {"glsl310es": "#version 310 es\n", "glsl430": "#version 430\n"}


@dataclass(frozen=True)
class Entry:
    """One entry point: what is compiled on its own."""

    hlsl: str  # file in hlsl/
    kind: str  # compute, vertex or fragment
    stage: str  # of the pipeline: the name it has everywhere


ENTRIES: dict[str, Entry] = {
    "morph": Entry("morph.hlsl", "compute", "morph"),
    "skin": Entry("skin.hlsl", "compute", "skin"),
    "blend": Entry("blend.hlsl", "compute", "blend"),
    "bind_skin": Entry("bind_skin.hlsl", "compute", "bind"),
    "bind_triangles": Entry("bind_triangles.hlsl", "compute", "bind"),
    "bind_vertices": Entry("bind_vertices.hlsl", "compute", "bind"),
    "bind_surface": Entry("bind_surface.hlsl", "compute", "bind"),
    "activate": Entry("activate.hlsl", "compute", "activate"),
    "project": Entry("project.hlsl", "compute", "project"),
    "shadow_clear": Entry("shadow_clear.hlsl", "compute", "shadow"),
    "shadow_mesh": Entry("shadow_mesh.hlsl", "compute", "shadow"),
    "shadow": Entry("shadow.hlsl", "compute", "shadow"),
    "light_normals": Entry("light_normals.hlsl", "compute", "light"),
    "light": Entry("light.hlsl", "compute", "light"),
    "sort_keys": Entry("sort_keys.hlsl", "compute", "sort"),
    "sort_count": Entry("sort_count.hlsl", "compute", "sort"),
    "sort_scan": Entry("sort_scan.hlsl", "compute", "sort"),
    "sort_scatter": Entry("sort_scatter.hlsl", "compute", "sort"),
    "raster_gather": Entry("raster_gather.hlsl", "compute", "raster"),
    "raster_vertex": Entry("raster.hlsl", "vertex", "raster"),
    "raster_pixel": Entry("raster.hlsl", "fragment", "raster"),
    "raster_depth_pixel": Entry("raster_depth.hlsl", "fragment", "raster"),
    "composite_vertex": Entry("composite.hlsl", "vertex", "raster"),
    "composite_pixel": Entry("composite.hlsl", "fragment", "raster"),
}
HLSL_ONLY: dict[str, Entry] = {  # of which LANGUAGES have no text
    # For engines; GLES 3.1 need not have storage buffers in vertex shaders.
    "raster_vertex_fetch": Entry("raster.hlsl", "vertex", "raster"),
    # For the web player, which has it as GLSL ES 3.00.
    "raster_vertex_batch": Entry("raster.hlsl", "vertex", "raster"),
    # For engines whose depth of the scene cannot be attached where the splats are drawn.
    "depth_pixel": Entry("composite.hlsl", "fragment", "raster"),
    "depth_samples_pixel": Entry("composite.hlsl", "fragment", "raster"),
}
SUFFIXES = {  # by folder
    "glsl": {"compute": "comp", "vertex": "vert", "fragment": "frag"},
    "msl": {"compute": "metal", "vertex": "metal", "fragment": "metal"},
    "wgsl": {"compute": "wgsl", "vertex": "wgsl", "fragment": "wgsl"},
}


def path_of(entry: str, language: str) -> str:
    """Where the generated text of an entry lies below this package, e.g. "glsl/blend.comp".

    Raises ValueError for an unknown entry or language.
    """
    if entry not in ENTRIES:
        raise ValueError(f"{entry!r} is not one of {', '.join(ENTRIES)}")
    if language not in LANGUAGES:
        raise ValueError(f"{language!r} is not one of {', '.join(LANGUAGES)}")
    folder = FOLDERS[language]
    return f"{folder}/{entry}.{SUFFIXES[folder][ENTRIES[entry].kind]}"
