"""What the GaussianAvatars reader makes of good and of bad runs."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from avatar_export.options import ReadOptions
from avatar_export.readers import gaussian_avatars
from avatar_export.rigs.rig_file import read_rig_file
from avatar_runtime.avatar import Avatar
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError
from tests.exporter.bodies import body_files
from tests.exporter.readers import lam_files, splatting_files
from tests.exporter.readers.splatting_files import COUNT, FACES, VERTICES, write_gaussian_run
from tests.hostile import MANGLING, mangled, only_avatar_errors
from tests.measured import Measure
from tests.shared_data import shared

A = splatting_files.arrays(degree=3)
GOLDEN = ("small_sh0", "small_sh3", "head_face_sh3")
SMALL = "template"  # the pose of the small cases that is the mesh given
LARGE = "jawOpen_smile"


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mesh") / "mesh.obj"
    path.write_text(splatting_files.obj_text(VERTICES * 2))
    return path


def _read(path: Path, mesh: Path | None, **options: Any) -> Avatar:
    return check_avatar(gaussian_avatars.read(path, ReadOptions(**{"no_rig": True, "mesh": mesh, **options})))


def _size(corners: np.ndarray) -> float:
    """Mean of the first edge and of how far the third corner lies from it."""
    e, f = corners[1] - corners[0], corners[2] - corners[0]
    along = e / np.linalg.norm(e)
    return float((np.linalg.norm(e) + np.linalg.norm(f - (f @ along) * along)) / 2)


def test_the_avatar_to_the_last_field(mesh: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path / "subject", A)
    avatar = _read(tmp_path / "subject", mesh)
    e, g = avatar.embedding, avatar.gaussians
    assert e is not None
    assert np.array_equal(e.canonical_vertices, (VERTICES * 2).astype("f4"))
    assert np.array_equal(e.triangles, FACES) and np.array_equal(e.triangle, A["sample_fidxs"])
    assert (e.barycentric == np.float32(1 / 3)).all() and e.barycentric.shape == (COUNT, 3)
    assert np.array_equal(e.local_offset, A["ply_xyz"])
    assert np.array_equal(e.local_quat_wxyz, A["ply_rot"])
    assert e.displacement.shape == (0,)
    sizes = np.array([_size(2 * VERTICES[FACES[k]]) for k in A["sample_fidxs"]])
    assert np.allclose(g.log_scale, A["log_scale"] + np.log(sizes)[:, None], rtol=0, atol=1e-6)
    assert np.array_equal(g.opacity_logit, A["opacity_logit"]) and np.array_equal(g.sh, A["sh"])
    rules = avatar.rules
    assert (rules.position, rules.rotation, rules.scale) == (
        "triangle_frame",
        "triangle_frame",
        "triangle_linear",
    )
    assert rules.sh_direction == "world"
    assert (avatar.name, avatar.training_per_bundle, avatar.raster.near) == ("subject", 1.0, 0.2)
    assert (avatar.raster.background, avatar.sh_degree) == ((1.0, 1.0, 1.0), 3)
    assert [(x.first, x.count, x.binding) for x in avatar.groups] == [(0, COUNT, "surface")]
    assert avatar.provenance["system"] == "gaussian_avatars"
    assert [note.kind for note in avatar.provenance["notes"]] == ["settings", "no_rig_given", "taken"]
    assert [f["path"] for f in avatar.provenance["source_files"]] == [
        "flame_param.npz", "mesh/mesh.obj", "point_cloud.ply"
    ]  # fmt: skip


@pytest.mark.parametrize("case", GOLDEN)
def test_golden_runs_in_the_pose_of_their_mesh(case: str, tmp_path: Path, measured: Measure) -> None:
    """A mesh given in a pose of the vectors makes the binding pose what the release computed for it."""
    folder = shared(f"golden/splatting_avatar/gaussian_avatars/{case}")
    if case.startswith("small"):
        expected = np.load(folder / "expected" / f"{SMALL}.npz")
        vertices, faces = expected["posed_vertices"], np.load(folder / "static.npz")["faces"]
    else:
        heads = folder.parents[1] / "head_poses"
        part = np.load(heads / "topology.npz")
        expected = np.load(folder / "expected" / f"{LARGE}.npz")
        vertices = np.load(heads / f"{LARGE}.npz")["vertices"][part["face_part_vertices"]]
        faces = part["face_part_faces"]
    np.savez(tmp_path / "mesh.npz", vertices=vertices, faces=faces)
    assert gaussian_avatars.detect(folder / "run")
    avatar = _read(folder / "run", tmp_path / "mesh.npz")
    given = np.load(folder / "static.npz")
    assert np.array_equal(avatar.embedding.triangle, given["binding"])
    assert avatar.sh_degree == given["sh_degree"]
    position = np.abs(avatar.gaussians.mean - expected["xyz"]).max()
    scale = np.abs(np.exp(avatar.gaussians.log_scale.astype("f8")) / expected["scale"] - 1).max()
    q, r = (
        x.astype("f8") / np.linalg.norm(x.astype("f8"), axis=1, keepdims=True)
        for x in (avatar.gaussians.quat_wxyz, expected["rotation"])
    )
    apart = np.minimum(np.linalg.norm(q - r, axis=1), np.linalg.norm(q + r, axis=1)).max()
    angle = np.degrees(4 * np.arcsin(apart / 2))
    measured("GaussianAvatars reader, position in the binding pose, m", float(position))
    measured("GaussianAvatars reader, scale in the binding pose, relative", float(scale))
    measured("GaussianAvatars reader, rotation in the binding pose, degrees", float(angle))
    assert position < 1e-6 and scale < 1e-5 and angle < 5e-4


def test_units_and_degree_are_options(mesh: Path, tmp_path: Path) -> None:
    """The mesh is in training units; offsets and stored scales are multiples of a triangle's size."""
    write_gaussian_run(tmp_path, A)
    one, two = _read(tmp_path, mesh), _read(tmp_path, mesh, units=2.0, sh_degree=1)
    assert (two.training_per_bundle, two.raster.near, two.sh_degree) == (2.0, 0.1, 1)
    assert np.array_equal(two.embedding.canonical_vertices, one.embedding.canonical_vertices / 2)
    assert np.array_equal(two.embedding.local_offset, one.embedding.local_offset)
    assert np.allclose(two.gaussians.log_scale, one.gaussians.log_scale - np.log(2), rtol=0, atol=1e-6)
    assert np.allclose(two.gaussians.mean, one.gaussians.mean / 2, rtol=0, atol=1e-7)
    with pytest.raises(ValueError, match="sh_degree is 4; 0 to 3 is needed"):
        _read(tmp_path, mesh, sh_degree=4)


@pytest.mark.parametrize(
    ("text", "colour"),
    [
        ("Namespace(sh_degree=3, white_background=True)", 1.0),
        ("Namespace(white_background=False)", 0.0),
        ("", 1.0),
    ],
)
def test_the_background_is_the_trainers(text: str, colour: float, mesh: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path, A)
    (tmp_path / "cfg_args").write_text(text)
    assert _read(tmp_path, mesh).raster.background == (colour,) * 3


def test_flame_params_are_not_needed(mesh: Path, tmp_path: Path) -> None:
    folder = write_gaussian_run(tmp_path, A, vertices=None)
    assert _read(folder / "point_cloud.ply", mesh).gaussians.count == COUNT


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run on the mesh of a small body model, with the subject's own offsets of its vertices."""
    folder = tmp_path_factory.mktemp("subject")
    model = body_files.body(body_files.FLAME_PARENTS)
    body_files.write_body(folder / "body.npz", model)
    iteration = write_gaussian_run(folder / "run", A, vertices=None)
    offset = np.random.default_rng(2).normal(0, 0.01, model["v_template"].shape)
    poses = body_files.poses(5)
    body_files.flame_param(iteration / "flame_param.npz", poses, offset)
    np.save(folder / "shaped.npy", model["v_template"] + model["identity"] @ poses["shape"] + offset)
    return folder


def test_a_body_model_gives_the_mesh_of_the_subject(subject: Path) -> None:
    """Identity and offsets are those of flame_param.npz, whose frames become a clip."""
    avatar = _read(subject / "run", None, no_rig=False, body_model=subject / "body.npz")
    e, rig = avatar.embedding, avatar.rig
    assert e is not None and rig is not None
    assert np.allclose(e.canonical_vertices, np.load(subject / "shaped.npy"), rtol=0, atol=1e-6)
    assert np.array_equal(rig.vertices, e.canonical_vertices) and np.array_equal(rig.triangles, e.triangles)
    assert [(clip.name, clip.frames) for clip in avatar.clips] == [("flame_param", body_files.FRAMES)]
    assert not {"rig_off", "rig_unproved"} & {note.kind for note in avatar.provenance["notes"]}
    assert [f["path"] for f in avatar.provenance["source_files"]] == [
        "body_model/body.npz", "point_cloud.ply", "poses/flame_param.npz"
    ]  # fmt: skip


def test_a_body_model_without_a_rig_is_its_template(subject: Path) -> None:
    avatar = _read(subject / "run", None, body_model=subject / "body.npz")
    template = body_files.body(body_files.FLAME_PARENTS)["v_template"]
    assert avatar.rig is None
    assert np.array_equal(avatar.embedding.canonical_vertices, template)


@pytest.mark.parametrize(
    ("given", "unused"),
    [
        (("body_model", "shape"), "--shape"),
        (("body_model", "poses"), "--poses"),
        (("mesh", "body_model"), "--body-model"),
        (("mesh", "rig"), "--rig"),
        (("rig", "body_model"), "--body-model"),
    ],
)
def test_no_rig_refuses_what_gives_no_mesh(given: tuple[str, ...], unused: str, subject: Path) -> None:
    """`body_model` and `rig` are allowed where they give the mesh."""
    options = {"mesh": None, **dict.fromkeys(given, subject / "body.npz")}
    with pytest.raises(
        AvatarError, match=f"gaussian_avatars: {unused} would have no .*; leave out {unused}, or"
    ):
        _read(subject / "run", **options)


def test_a_mesh_given_is_taken_before_the_body_model(subject: Path, tmp_path: Path) -> None:
    model = body_files.body(body_files.FLAME_PARENTS)
    np.savez(tmp_path / "mesh.npz", vertices=model["v_template"] * 1.5, faces=model["triangles"])
    avatar = _read(subject / "run", tmp_path / "mesh.npz", no_rig=False, body_model=subject / "body.npz")
    assert np.array_equal(avatar.embedding.canonical_vertices, model["v_template"] * np.float32(1.5))
    assert not np.array_equal(avatar.rig.vertices, avatar.embedding.canonical_vertices)


def test_a_body_model_of_another_size_is_refused(subject: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path, A, vertices=5143)
    with pytest.raises(AvatarError, match=r"static_offset: has .*5143.* 120 "):
        _read(tmp_path, None, body_model=subject / "body.npz")


def test_a_rig_file_gives_its_mesh_in_its_order(tmp_path: Path) -> None:
    """binding_0 counts triangles, so those of the .glb are taken as they lie in it."""
    write_gaussian_run(tmp_path / "run", A, vertices=None)
    (tmp_path / "rig.glb").write_bytes(lam_files.skin_glb())
    avatar = _read(tmp_path / "run", None, no_rig=False, rig=tmp_path / "rig.glb")
    rig = read_rig_file(tmp_path / "rig.glb").rig
    assert np.array_equal(avatar.embedding.canonical_vertices, rig.vertices)
    assert np.array_equal(avatar.embedding.triangles, rig.triangles)
    assert avatar.rig.joint_count == rig.joint_count and avatar.expression_names == lam_files.MORPHS
    assert avatar.blendshapes.geometry.columns == len(lam_files.MORPHS)


def test_the_mesh_must_be_given(tmp_path: Path) -> None:
    write_gaussian_run(tmp_path, A)
    with pytest.raises(
        AvatarError, match=r"does not contain its mesh; pass it with --mesh .* 120 vertices and 168"
    ):
        _read(tmp_path, None)


def _with(binding: Any, value: Any, row: int = 5) -> Any:
    result = binding.copy()
    result[row] = value
    return result


IDS = A["sample_fidxs"].astype("f4")


@pytest.mark.parametrize(
    ("binding", "message"),
    [
        (
            _with(IDS, 8),
            r"binding_0\[5\]: is 8, but the mesh has 8 triangles \(0..7\) of mesh.obj; its mesh is FLAME",
        ),
        (_with(IDS, -1), r"binding_0\[5\]: is -1, but"),
        (_with(IDS, 1.5), r"binding_0\[5\]: is 1.5, but"),
        (_with(IDS, np.nan), r"binding_0\[5\]: is nan, but"),
        (_with(IDS, np.inf), r"binding_0\[5\]: is inf, but"),
        (_with(IDS.astype("i4"), 2**31 - 1), r"binding_0\[5\]: is 2.14748365e\+09, but"),
        (False, "property binding_0: is missing; it holds the triangle of each Gaussian"),
    ],
)
def test_bad_bindings_are_refused(binding: Any, message: str, mesh: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path, A, binding=binding)
    with pytest.raises(AvatarError, match=message) as caught:
        _read(tmp_path, mesh)
    assert caught.value.owner == "gaussian_avatars"


def test_whole_numbers_of_any_type_are_bindings(mesh: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path, A, binding=A["sample_fidxs"].astype("u2"))
    assert np.array_equal(_read(tmp_path, mesh).embedding.triangle, A["sample_fidxs"])


def test_offsets_of_another_mesh_are_refused(mesh: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path, A, vertices=5143)
    with pytest.raises(
        AvatarError, match=r"static_offset: has shape \[1, 5143, 3\], but mesh.obj has 6 vertices; its"
    ):
        _read(tmp_path, mesh)


def test_a_flat_triangle_with_a_gaussian_is_refused(tmp_path: Path) -> None:
    write_gaussian_run(tmp_path / "run", A)
    (tmp_path / "flat.obj").write_text(
        splatting_files.obj_text(faces=np.concatenate([FACES[:7], [[0, 3, 3]]]))
    )
    with pytest.raises(
        AvatarError, match=r"flat.obj: triangle 7 \(vertices 0, 3, 3\) has no area, but carries"
    ):
        _read(tmp_path / "run", tmp_path / "flat.obj")


@pytest.mark.parametrize("size", [3e39, 1e30, 1e-30, 1e-44])
def test_absurd_sizes_raise_nothing_else(size: float, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path / "run", A)
    np.savez(tmp_path / "mesh.npz", vertices=VERTICES * size, faces=FACES)
    only_avatar_errors(lambda: _read(tmp_path / "run", tmp_path / "mesh.npz"))


def test_options_without_a_use_are_refused(mesh: Path, tmp_path: Path) -> None:
    write_gaussian_run(tmp_path, A)
    for options in ({"sh_direction": "world"}, {"mesh_scaling": True}, {"quaternion_sign": "w_positive"}):
        with pytest.raises(
            AvatarError, match=f"--{next(iter(options)).replace('_', '-')} cannot be used here"
        ):
            _read(tmp_path, mesh, **options)


def test_where_nothing_is(mesh: Path, tmp_path: Path) -> None:
    assert not gaussian_avatars.detect(tmp_path)
    with pytest.raises(AvatarError, match=r"has no point_cloud.ply"):
        _read(tmp_path, mesh)


def test_detection_reads_the_header(tmp_path: Path) -> None:
    path = tmp_path / "point_cloud.ply"
    for text, found in (
        (b"ply\nelement vertex 1\nproperty float binding_0\nend_header\n", True),
        (b"ply\r\nelement vertex 1\r\nproperty int binding_0\r\nproperty float x\r\nend_header\r\n", True),
        (b"ply\ncomment binding_0\nend_header\nproperty float binding_0\n", False),
        (b"ply\nproperty float binding_01\nend_header\n", False),
        (b"ply\nproperty float binding_0\n", False),
        (b"", False),
    ):
        path.write_bytes(text)
        assert gaussian_avatars.detect(tmp_path) is found, text


@pytest.fixture(scope="module")
def one_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """For fuzzing: its files are overwritten by each example."""
    return write_gaussian_run(tmp_path_factory.mktemp("fuzz"), A)


def _ply() -> bytes:
    stream = io.BytesIO()
    splatting_files.write_ply_to(stream, A, {"binding_0": IDS})
    return stream.getvalue()


@MANGLING
@given(mangled(_ply()))
def test_mangled_gaussians(one_run: Path, mesh: Path, data: bytes) -> None:
    (one_run / "point_cloud.ply").write_bytes(data)
    assert gaussian_avatars.detect(one_run) in (True, False)
    only_avatar_errors(lambda: _read(one_run, mesh))


def _npz() -> bytes:
    stream = io.BytesIO()
    np.savez(stream, static_offset=np.zeros((1, 6, 3), "f4"))
    return stream.getvalue()


@pytest.fixture(scope="module")
def other_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_gaussian_run(tmp_path_factory.mktemp("fuzz"), A)


@MANGLING
@given(mangled(_npz()))
def test_mangled_flame_params(other_run: Path, mesh: Path, data: bytes) -> None:
    (other_run / "flame_param.npz").write_bytes(data)
    only_avatar_errors(lambda: _read(other_run, mesh))
