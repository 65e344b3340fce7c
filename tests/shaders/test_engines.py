"""The texts for Unity and Unreal compile against shims and compute what the plain shaders compute.

The shims stand in for engine files: this tests our text, not the engines.
"""

from __future__ import annotations

import json
import re
import struct
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_shaders import ENTRIES, HLSL_ONLY, Entry
from avatar_shaders.generate import HLSL, PACKAGE
from avatar_shaders.reflect import interface
from avatar_shaders.tools import compile_file, cross, spirv
from tests.shaders import gl_process

SHIMS = Path(__file__).parent / "shims"
UNREAL_DRAWS = ("unreal_depth_pixel", "unreal_composite_pixel")  # written by hand, for Unreal alone
UNREAL_OPTIONS = (f"-I{SHIMS / 'unreal'}",)
COMPUTE = [name for name, row in ENTRIES.items() if row.kind == "compute"]
COPY_TO_TEXTURE = "quad_texels"  # written by hand, for Unity alone
UNITY_KERNELS = "Resources/AvatarExport"  # in Made, and in Shaders what is written by hand
MATERIAL = PACKAGE.parent.parent / "players" / "unity" / "Shaders" / UNITY_KERNELS / "AvatarSplat.shader"
PASSES = {"Splat": 0, "Composite": 1}
KEYWORDS = re.findall(r"multi_compile_local _ (\w+)", MATERIAL.read_text("utf-8"))
KINDS = {"vert": "vertex", "frag": "fragment"}
Array = npt.NDArray[Any]


def unity_options(package: Path) -> tuple[str, ...]:
    """Where includes are looked for: from the project, and from Shaders, for passes are compiled in another folder."""
    return f"-I{package.parents[1]}", f"-I{package / 'Shaders'}"


def unity_kernel_file(package: Path, entry: str) -> Path:
    folder = "Shaders" if entry == COPY_TO_TEXTURE else "Made"
    return package / folder / UNITY_KERNELS / f"{entry}.compute"


def unity_kernel(package: Path, entry: str) -> bytes:
    return compile_file(unity_kernel_file(package, entry), entry, "compute", unity_options(package))


def unreal_shader(plugin: Path, entry: str) -> bytes:
    row = (ENTRIES | HLSL_ONLY)[entry]
    return compile_file(plugin / f"Shaders/{Path(row.hlsl).stem}.usf", entry, row.kind, UNREAL_OPTIONS)


def unity_pass_text(name: str) -> str:
    found: list[str] = re.findall(r"HLSLPROGRAM\n(.*?)ENDHLSL", MATERIAL.read_text("utf-8"), re.DOTALL)
    return found[PASSES[name]]


def unity_text(folder: Path, name: str) -> Path:
    path = folder / f"{name}.hlsl"
    path.write_text(unity_pass_text(name).replace('"../../', '"'), "utf-8")
    return path


def unity_pass(package: Path, folder: Path, name: str, entry: str, *options: str) -> bytes:
    return compile_file(unity_text(folder, name), entry, KINDS[entry], (*unity_options(package), *options))


def blocks(module: bytes) -> list[dict[str, Any]]:
    reflected = cross(module, "reflect")
    found: list[dict[str, Any]] = interface("", Entry("", "", ""), reflected, "")["uniform_blocks"]
    return found


def packed(module: bytes, values: dict[str, Any]) -> bytes:
    """The constants of a module by name; what `values` does not hold is 0."""
    (block,) = blocks(module)
    data = bytearray(block["size"])
    assert values.keys() <= {member["name"] for member in block["members"]}
    for member in block["members"]:
        numbers = np.atleast_1d(values.get(member["name"], [])).tolist()
        code = "I" if member["type"].startswith("uint") else "f"
        struct.pack_into(f"<{len(numbers)}{code}", data, member["offset"], *numbers)
    return bytes(data)


@pytest.mark.parametrize("entry", [*COMPUTE, COPY_TO_TEXTURE])
def test_unity_kernel_compiles_and_is_declared(unity_package: Path, entry: str) -> None:
    text = unity_kernel_file(unity_package, entry).read_text("utf-8")
    assert re.findall(r"^#pragma kernel (\w+)$", text, re.MULTILINE) == [entry]
    assert unity_kernel(unity_package, entry)


@pytest.mark.parametrize("keyword", [*KEYWORDS, "NONE"])
def test_unity_material_compiles_with_every_keyword(
    unity_package: Path, tmp_path: Path, keyword: str
) -> None:
    """The vertex stage knows one of them, the fragment stage the other."""
    vertex, pixel = (
        json.loads(cross(unity_pass(unity_package, tmp_path, "Splat", entry, f"-D{keyword}=1"), "reflect"))
        for entry in KINDS
    )
    assert len(KEYWORDS) == 2
    assert len(vertex.get("ssbos", [])) == (keyword != "AVATAR_QUAD_TEXTURE")
    assert len(vertex.get("separate_images", [])) == (keyword == "AVATAR_QUAD_TEXTURE")
    (depth,) = pixel["separate_images"]
    assert (depth["type"] == "texture2DArray") == (keyword == "AVATAR_DEPTH_ARRAY")


@pytest.mark.parametrize("entry", ENTRIES | HLSL_ONLY)
def test_unreal_shader_compiles_with_loose_parameters(unreal_plugin: Path, entry: str) -> None:
    module = unreal_shader(unreal_plugin, entry)
    plain = blocks(spirv(HLSL, entry))
    loose = blocks(module)
    assert [b["members"] for b in loose] == [b["members"] for b in plain]
    assert {b["name"] for b in loose} <= {"_Global", "$Global"}


@pytest.mark.parametrize("entry", UNREAL_DRAWS)
def test_what_draws_in_unreal_compiles(unreal_plugin: Path, entry: str) -> None:
    module = compile_file(unreal_plugin / "Shaders/unreal_draw.usf", entry, "fragment", UNREAL_OPTIONS)
    told = json.loads(cross(module, "reflect"))["separate_images"]
    assert "scene_" + ("depth" if "depth" in entry else "colour") in {image["name"] for image in told}


def activate_case() -> tuple[dict[str, Any], list[Array], int]:
    """Constants, buffers and groups of one run of `activate`."""
    rng = np.random.default_rng(5)
    return {"count": 200}, [rng.normal(0, 2, (5, 200, 4)).astype(np.float32)], 4


def project_case() -> tuple[dict[str, Any], list[Array], int]:
    """Constants, buffers and groups of one run of `project`, degree 3, all splats before the camera."""
    rng = np.random.default_rng(6)
    splats = np.zeros((5, 200, 4), np.float32)
    splats[0] = rng.uniform(-0.5, 0.5, (200, 4))
    splats[0, :, 3] = rng.uniform(0.1, 1, 200)
    splats[1] = rng.normal(size=(200, 4))
    splats[1] /= np.linalg.norm(splats[1], axis=1, keepdims=True)
    splats[2:, :, :3] = np.eye(3, dtype=np.float32)[:, None]
    splats[2:, :, 3] = rng.uniform(0.01, 0.1, (3, 200))
    sh = rng.normal(0, 0.3, (48, 200)).astype(np.float32)
    view = np.eye(4, dtype=np.float32)
    view[2, 3] = 3
    clip = view.copy()
    clip[:2] *= 2.0
    clip[3] = view[2]
    constants: dict[str, Any] = {f"camera_row{i}": view[i] for i in range(3)}
    constants |= {f"clip_row{i}": clip[i] for i in range(4)}
    constants |= {"count": 200, "sh_degree": 3, "near_z": 0.2, "low_pass": 0.3, "eye": [0, 0, -3, 0]}
    constants |= {"tan_half_fov": [0.5, 0.5], "image_size": [256, 256]}
    return constants, [splats, sh, np.zeros((3, 200, 4), np.float32)], 4


CASES = {"activate": activate_case, "project": project_case}


def run(module: bytes, entry: str) -> list[Array]:
    values, storage, groups = CASES[entry]()
    return gl_process.compute(cross(module, "glsl430"), storage, packed(module, values), groups)


@pytest.mark.parametrize("entry", CASES)
def test_engine_kernels_compute_what_the_plain_ones_do(
    unity_package: Path, unreal_plugin: Path, entry: str
) -> None:
    plain = run(spirv(HLSL, entry), entry)
    changed = CASES[entry]()[1][-1]
    assert np.count_nonzero(plain[-1] != changed) > 400 and np.isfinite(plain[-1]).all()
    for engine in (partial(unity_kernel, unity_package), partial(unreal_shader, unreal_plugin)):
        for got, wanted in zip(run(engine(entry), entry), plain, strict=True):
            np.testing.assert_array_equal(got, wanted)


SIZE = (48, 32)


def quads() -> Array:
    """[instances, 12] as raster_gather writes them, back to front; the image is not its own mirror image."""
    rng = np.random.default_rng(7)
    q = np.zeros((20, 12), np.float32)
    q[:, 0], q[:, 1] = rng.uniform(0, 48, 20), rng.uniform(0, 16, 20)
    q[:, 2], q[:, 3] = np.linspace(0.9, 0.1, 20), rng.uniform(0.2, 1, 20)
    q[:, [4, 6]] = rng.uniform(0.02, 0.3, (20, 2))
    q[:, 5] = 0.3 * np.sqrt(q[:, 4] * q[:, 6])
    q[:, 8:11] = rng.uniform(0, 1, (20, 3))
    return q


@cache
def plain_image(first: int = 0, count: int = 20) -> Array:
    """Some of the quads, drawn with instance attributes; the first row is the top one."""
    vertex, pixel = (spirv(HLSL, f"raster_{kind}") for kind in ("vertex", "pixel"))
    constants = packed(vertex, {"image_size": SIZE, "flip_y": -1})
    texts = cross(vertex, "glsl430", vertex=True), cross(pixel, "glsl430")
    return gl_process.draw(*texts, constants, SIZE, count, attributes=quads()[first : first + count])


BATCH, ROW = (
    int(re.findall(rf"#define AVATAR_QUAD_{name} (\d+)", (HLSL / "raster.hlsli").read_text("utf-8"))[0])
    for name in ("BATCH", "ROW")
)
INDICES = (4 * np.arange(BATCH)[:, None] + [0, 1, 2, 2, 1, 3]).ravel()  # as the player draws a batch


def texts_of(vertex: bytes, pixel: bytes, direct3d: bool) -> tuple[str, str]:
    """GLSL of a pass. spirv-cross turns clip y and scales clip z where Direct3D is meant."""
    flip = ("--flip-vert-y",) if direct3d else ()
    return cross(vertex, "glsl430", vertex=direct3d, options=flip), cross(pixel, "glsl430")


def sampler(text: str, name: str) -> str:
    found = re.search(rf"sampler2D (\w*{name}\w*);", text)
    assert found, name
    return found[1]


def unity_image(
    package: Path,
    folder: Path,
    *,
    direct3d: bool,
    texture: bool,
    count: int = 20,
    scene: float = 1.0,
    reversed_z: bool = False,
) -> Array:
    """Rows as they lie in memory, bottom row first: [H, W, 4]. The scene is flat, at depth `scene`."""
    defines = ("-DAVATAR_QUAD_TEXTURE=1",) if texture else ()
    vertex, pixel = (unity_pass(package, folder, "Splat", entry, *defines) for entry in KINDS)
    texts = texts_of(vertex, pixel, direct3d)
    textures = {sampler(texts[1], "_CameraDepthTexture"): np.full((SIZE[1], SIZE[0], 1), scene, np.float32)}
    # What lies behind the last splat is of no splat.
    held = np.concatenate([quads(), quads()])
    if texture:
        texels = np.zeros((1, 3 * ROW, 4), np.float32)
        texels[0, : 3 * len(held)] = held.reshape(-1, 4)
        textures[sampler(texts[0], "QuadTexels")] = texels
    values = {"image_size": SIZE, "quad_count": count, "depth_sign": -1 if reversed_z else 1}
    values["flip_y"] = -1 if direct3d else 1
    storage = [] if texture else [held]
    drawn = gl_process.draw(
        *texts, packed(vertex, values), SIZE, 1, storage=storage, indices=INDICES, textures=textures
    )
    return drawn[..., :4]


@pytest.mark.parametrize(("direct3d", "texture"), [(True, False), (False, True)])
def test_unity_material_draws_the_plain_image(
    unity_package: Path, tmp_path: Path, direct3d: bool, texture: bool
) -> None:
    """On each kind of API the rows lie in memory as in Unity's render textures."""
    plain = plain_image()[..., :4]
    assert plain[..., 3].max() > 0.5 and np.abs(plain - plain[::-1]).max() > 0.5
    image = unity_image(unity_package, tmp_path, direct3d=direct3d, texture=texture)
    # Pixel centres are counted from the other side: the same numbers, except for the rounding of rows - y.
    np.testing.assert_allclose(image[::-1], plain, atol=1e-6)


def test_unity_copies_quads_to_the_texture_that_vertices_read(unity_package: Path) -> None:
    module = unity_kernel(unity_package, COPY_TO_TEXTURE)
    count = ROW + 5  # a second row
    held = np.random.default_rng(9).normal(0, 1, (count + 3, 12)).astype(np.float32)  # three are of no splat
    groups = -(-3 * count // 64)
    constants = packed(module, {"quad_count": count})
    found = gl_process.image(cross(module, "glsl430"), [held], constants, groups, (3 * ROW, 2))
    wanted = np.zeros((2 * ROW, 12), np.float32)
    wanted[:count] = held[:count]
    np.testing.assert_array_equal(found.reshape(-1, 12), wanted)


def test_unity_texts_for_phones_compile_in_opengl_es(unity_package: Path, tmp_path: Path) -> None:
    """Where the vertex stage has no storage buffers. Unity's type for textures of 32 bits stands for a plain one."""
    phone = ("-DSHADER_API_GLES3=1", "-DTexture2D_float=Texture2D<float4>")
    programs = [{"compute": cross(unity_kernel(unity_package, COPY_TO_TEXTURE), "glsl310es")}]
    for name, options in (("Splat", ("-DAVATAR_QUAD_TEXTURE=1",)), ("Composite", ())):
        vertex, pixel = (
            unity_pass(unity_package, tmp_path, name, entry, *phone, *options) for entry in KINDS
        )
        texts = cross(vertex, "glsl310es", vertex=True), cross(pixel, "glsl310es")
        programs.append(dict(zip(("vertex", "fragment"), texts, strict=True)))
    assert not any(gl_process.refusals("glsl310es", programs))


@pytest.mark.parametrize("reversed_z", [False, True])
def test_unity_material_hides_what_the_scene_hides(
    unity_package: Path, tmp_path: Path, reversed_z: bool
) -> None:
    """Depths fall from 0.9 to 0.1 along the quads: those of 10 are nearer than 0.5."""
    alone = plain_image(0, 10) if reversed_z else plain_image(10, 10)
    image = unity_image(
        unity_package, tmp_path, direct3d=True, texture=False, scene=0.5, reversed_z=reversed_z
    )
    assert np.abs(alone[..., :4] - plain_image()[..., :4]).max() > 0.3
    np.testing.assert_allclose(image[::-1], alone[..., :4], atol=1e-6)


@pytest.mark.parametrize("top_row_first", [1, 0])
def test_unity_composite_finds_its_rows_and_its_part_of_the_target(
    unity_package: Path, tmp_path: Path, top_row_first: int
) -> None:
    """The image is a part of the target: from column 8 and from row 4 counted from the bottom."""
    vertex, pixel = (unity_pass(unity_package, tmp_path, "Composite", entry) for entry in KINDS)
    texts = texts_of(vertex, pixel, True)
    width, height, left, bottom = 24, 16, 8, 4
    accumulated = np.random.default_rng(8).uniform(0, 1, (height, width, 4)).astype(np.float32)
    values = {"image_size": [width, height], "target_first": [left, bottom], "target_rows": SIZE[1]}
    values["top_row_first"] = top_row_first
    textures = {sampler(texts[1], "Accumulated"): accumulated}
    drawn = gl_process.draw(*texts, packed(pixel, values), SIZE, 1, indices=np.arange(3), textures=textures)
    upward = drawn[::-1] if top_row_first else drawn
    part = upward[bottom : bottom + height, left : left + width, :4]
    np.testing.assert_array_equal(part, accumulated)


def test_unreal_material_draws_the_plain_image(unreal_plugin: Path) -> None:
    vertex, pixel = (unreal_shader(unreal_plugin, name) for name in ("raster_vertex_fetch", "raster_pixel"))
    texts = cross(vertex, "glsl430", vertex=True, options=("--flip-vert-y",)), cross(pixel, "glsl430")
    constants = packed(vertex, {"image_size": SIZE, "flip_y": 1})
    got = gl_process.draw(*texts, constants, SIZE, 20, storage=[quads()])
    np.testing.assert_array_equal(got, plain_image())
