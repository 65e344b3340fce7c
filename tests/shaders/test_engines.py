"""The texts for Unity and Unreal compile against shims and compute what the plain shaders compute.

The shims stand in for engine files: this tests our text, not the engines.
"""

from __future__ import annotations

import json
import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_schema.version import __version__
from avatar_shaders import ENTRIES, HLSL_ONLY, Entry
from avatar_shaders.generate import HLSL, PACKAGE
from avatar_shaders.reflect import interface
from avatar_shaders.tools import compile_file, cross, spirv
from tests.shaders import dxc, gl_process

ENGINES = PACKAGE.parent
UNITY, UNREAL = ENGINES / "unity", ENGINES / "unreal"
SHIMS = Path(__file__).parent / "shims"
UNITY_OPTIONS = (f"-I{UNITY / 'Shaders'}", f"-I{SHIMS / 'unity'}")
UNREAL_OPTIONS = (f"-I{SHIMS / 'unreal'}",)
COMPUTE = [name for name, row in ENTRIES.items() if row.kind == "compute"]
MATERIALS = sorted(path.name for path in UNITY.glob("Shaders/*.shader"))
PASSES = {"Splat": 0, "Composite": 1}
KINDS = {"vert": "vertex", "frag": "fragment"}
PROFILES = {"compute": "cs_6_0", "vertex": "vs_6_0", "fragment": "ps_6_0"}

Array = npt.NDArray[Any]


def unity_kernel(entry: str) -> bytes:
    return compile_file(UNITY / f"Shaders/{entry}.compute", entry, "compute", UNITY_OPTIONS)


def unreal_shader(entry: str) -> bytes:
    row = (ENTRIES | HLSL_ONLY)[entry]
    return compile_file(UNREAL / f"Shaders/{Path(row.hlsl).stem}.usf", entry, row.kind, UNREAL_OPTIONS)


def program(material: str, name: str) -> str:
    """HLSL of one pass of a ShaderLab file."""
    text = (UNITY / "Shaders" / material).read_text("utf-8")
    return re.findall(r"HLSLPROGRAM\n(.*?)ENDHLSL", text, re.DOTALL)[PASSES[name]]


def unity_pass(folder: Path, material: str, name: str, entry: str, *options: str) -> bytes:
    """SPIR-V of `vert` or `frag` of a pass."""
    path = folder / f"{material}.{name}.hlsl"
    path.write_text(program(material, name), "utf-8")
    return compile_file(path, entry, KINDS[entry], (*UNITY_OPTIONS, *options))


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


@pytest.mark.parametrize("entry", COMPUTE)
def test_unity_kernel_compiles_and_is_declared(entry: str) -> None:
    text = (UNITY / f"Shaders/{entry}.compute").read_text("utf-8")
    assert re.findall(r"^#pragma kernel (\w+)$", text, re.MULTILINE) == [entry]
    assert unity_kernel(entry)


def test_unity_has_a_kernel_file_an_entry() -> None:
    assert sorted(path.stem for path in UNITY.glob("Shaders/*.compute")) == sorted(COMPUTE)


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("name", PASSES)
@pytest.mark.parametrize("entry", KINDS)
def test_unity_material_compiles(tmp_path: Path, material: str, name: str, entry: str) -> None:
    text = program(material, name)
    assert "#pragma vertex vert\n" in text and "#pragma fragment frag\n" in text
    assert unity_pass(tmp_path, material, name, entry, "-DUNITY_UV_STARTS_AT_TOP=1")


def test_unity_materials_differ_in_their_pipeline_alone() -> None:
    built_in, urp = ((UNITY / "Shaders" / name).read_text("utf-8") for name in MATERIALS)
    for old, new in (
        ("Built-in", "Universal"),
        ('"Avatar/Splat"', '"Avatar/SplatURP"'),
        ('"IgnoreProjector" = "True"', '"IgnoreProjector" = "True" "RenderPipeline" = "UniversalPipeline"'),
        ("UnityCG.cginc", "Packages/com.unity.render-pipelines.universal/ShaderLibrary/Core.hlsl"),
    ):
        built_in = built_in.replace(old, new)
    assert built_in == urp


@pytest.mark.parametrize("entry", ENTRIES | HLSL_ONLY)
def test_unreal_shader_compiles_with_loose_parameters(entry: str) -> None:
    module = unreal_shader(entry)
    plain = blocks(spirv(HLSL, entry))
    loose = blocks(module)
    assert [b["members"] for b in loose] == [b["members"] for b in plain]
    assert {b["name"] for b in loose} <= {"_Global", "$Global"}


def test_dxc_takes_the_engines_texts(tmp_path: Path) -> None:
    if dxc.library() is None:
        pytest.skip("libdxcompiler is not here (AVATAR_DXC names it; the compushady package holds one)")
    jobs: list[dxc.Job] = [
        (str(UNITY / f"Shaders/{entry}.compute"), entry, "cs_6_0", UNITY_OPTIONS) for entry in COMPUTE
    ]
    for material in MATERIALS:
        for name in PASSES:
            path = tmp_path / f"{material}.{name}.hlsl"
            path.write_text(program(material, name), "utf-8")
            jobs += [(str(path), entry, PROFILES[kind], UNITY_OPTIONS) for entry, kind in KINDS.items()]
    for entry, row in (ENTRIES | HLSL_ONLY).items():
        # The engine serves paths that begin with /Engine; this compiler looks on the disk.
        text = (UNREAL / f"Shaders/{Path(row.hlsl).stem}.usf").read_text("utf-8")
        path = tmp_path / f"{entry}.usf"
        path.write_text(text.replace('"/Engine/', f'"{SHIMS}/unreal/Engine/'), "utf-8")
        jobs.append((str(path), entry, PROFILES[row.kind], (f"-I{UNREAL / 'Shaders'}", "-HV", "2021")))
    refused = {job[0]: said for job, said in zip(jobs, dxc.messages(jobs), strict=True) if said}
    assert not refused


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
def test_engine_kernels_compute_what_the_plain_ones_do(entry: str) -> None:
    plain = run(spirv(HLSL, entry), entry)
    changed = CASES[entry]()[1][-1]
    assert np.count_nonzero(plain[-1] != changed) > 400 and np.isfinite(plain[-1]).all()
    for engine in (unity_kernel, unreal_shader):
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


def plain_image() -> Array:
    """Drawn with instance attributes; the first row is the top one."""
    vertex, pixel = (spirv(HLSL, f"raster_{kind}") for kind in ("vertex", "pixel"))
    constants = packed(vertex, {"image_size": SIZE, "flip_y": -1})
    texts = cross(vertex, "glsl430", vertex=True), cross(pixel, "glsl430")
    return gl_process.draw(*texts, constants, SIZE, 20, attributes=quads())


def unity_image(folder: Path, material: str, *, direct3d: bool, turned: bool) -> Array:
    """Rows as they lie in memory. spirv-cross turns clip y and scales clip z where Direct3D is meant."""
    defines = ("-DUNITY_UV_STARTS_AT_TOP=1",) if direct3d else ("-DSHADER_API_GLCORE=1",)
    vertex, pixel = (unity_pass(folder, material, "Splat", entry, *defines) for entry in KINDS)
    values = {"image_size": SIZE, "flip_y": 1, "_ProjectionParams": [-1 if turned else 1, 0, 0, 0]}
    flip = ("--flip-vert-y",) if direct3d else ()
    texts = cross(vertex, "glsl430", vertex=direct3d, options=flip), cross(pixel, "glsl430")
    return gl_process.draw(*texts, packed(vertex, values), SIZE, 20, storage=[quads()])


@pytest.mark.parametrize("material", MATERIALS)
def test_unity_material_draws_the_plain_image(tmp_path: Path, material: str) -> None:
    """Whichever row a target begins with: the top one (Direct3D), or the bottom one (turned there, or OpenGL)."""
    plain = plain_image()
    assert plain[..., 3].max() > 0.5 and plain[..., 4].min() < 0.2 and np.abs(plain - plain[::-1]).max() > 0.5
    upright = unity_image(tmp_path, material, direct3d=True, turned=False)
    np.testing.assert_array_equal(upright, plain)
    turned = unity_image(tmp_path, material, direct3d=True, turned=True)
    # Pixel centres are counted from the other side: the same numbers, except for the rounding of rows - y.
    np.testing.assert_allclose(turned[::-1], plain, atol=1e-6)
    opengl = unity_image(tmp_path, material, direct3d=False, turned=False)
    np.testing.assert_allclose(opengl[::-1], plain, atol=1e-6)


def test_unreal_material_draws_the_plain_image() -> None:
    vertex, pixel = unreal_shader("raster_vertex_fetch"), unreal_shader("raster_pixel")
    texts = cross(vertex, "glsl430", vertex=True, options=("--flip-vert-y",)), cross(pixel, "glsl430")
    constants = packed(vertex, {"image_size": SIZE, "flip_y": 1})
    got = gl_process.draw(*texts, constants, SIZE, 20, storage=[quads()])
    np.testing.assert_array_equal(got, plain_image())


def test_unity_package_has_the_projects_version_and_a_meta_an_asset() -> None:
    package = json.loads((UNITY / "package.json").read_text("utf-8"))
    assert package["version"] == __version__
    assets = [path for path in UNITY.rglob("*") if path.suffix != ".meta"]
    guids = [Path(f"{path}.meta").read_text("utf-8").split("guid: ")[1].strip() for path in assets]
    assert len(set(guids)) == len(assets) > 30
    assert all(re.fullmatch(r"[0-9a-f]{32}", guid) for guid in guids)
