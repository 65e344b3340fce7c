"""The avatar zip that LAM exports (aigc3d/LAM 3395736): offset.ply on the vertices of skin.glb.

Splat i belongs to vertex i of the glb (measured: the colours of a real avatar are smooth along the edges in
this order, and only in this one); the zip's vertex_order.json is loaded by LAM's web page and not used, and
not used here. The PLY looks like a 3DGS file and is none: x, y, z is the offset from the vertex, f_dc is
plain RGB.
"""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np

from avatar_export.driving.arkit import canonical
from avatar_export.formats.archive import ZIP_FAULTS, Archive
from avatar_export.options import ReadOptions
from avatar_export.provenance import source_files
from avatar_export.rigs.gltf_rig import GltfRig, read_rig
from avatar_runtime.avatar import (
    Avatar,
    Blendshapes,
    Driving,
    Expression,
    Gaussians,
    Group,
    RasterSettings,
    Rules,
    SparseRows,
)
from avatar_runtime.codec import glb, ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.ownership import owned
from avatar_runtime.rules import SKIN_ROTATIONS
from avatar_schema import constants

SYSTEM = "lam"
OFFSETS, SKIN, CLIPS = "offset.ply", "skin.glb", "animation.glb"
FILES = (
    f"NAME.zip, or the folder it unpacks to, with {OFFSETS} (the Gaussians, offsets from the vertices)",
    f"{SKIN} (mesh, ARKit morph targets, joints and skin weights)",
    f"{CLIPS} (optional: animation clips)",
)
NEEDED = (OFFSETS, SKIN)
USED_OPTIONS = ("rotation", "exact", "name")  # exact: every delta that is not zero is kept anyway
WITHOUT_RIG = ReadOptions()  # the zip holds its rig
MAX_FILE_BYTES = 512 << 20
HEAD_JOINT = "head"


def detect(path: Path) -> bool:
    """Whether `path` is a zip, or a folder, with offset.ply and skin.glb in one folder; never raises."""
    try:
        if path.is_dir():
            return bool(_folders(str(p.relative_to(path)) for p in _files_of(path)))
        if not path.is_file():
            return False
        with zipfile.ZipFile(path) as archive:
            return bool(_folders(archive.namelist()))
    except ZIP_FAULTS:
        return False


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar, in metres. Raises AvatarError for an option of no use here, and as `read_lam`."""
    options.refuse_others(USED_OPTIONS, SYSTEM, "the zip holds all there is")
    avatar = read_lam(path, rotation=options.rotation or "none")
    return replace(avatar, name=options.name or avatar.name)


def read_lam(path: Path, *, rotation: str = "none") -> Avatar:
    """The avatar in a LAM zip or folder; y up, face +Z, metres.

    `rotation` says how joints turn a Gaussian: `none` as trained (animate_gs_model moves positions only),
    `head_bone` as its web page draws it, `polar3` as skinning would.
    Raises AvatarError for missing, damaged or inconsistent files and for an unknown rule.
    """
    with owned(SYSTEM):
        if rotation not in SKIN_ROTATIONS:
            raise AvatarError(f"{rotation!r} is none of {', '.join(SKIN_ROTATIONS)}", field="rotation")
        source = _Source(path)
        splats = _gaussians(source.read(OFFSETS))
        found = read_rig(glb.decode(source.read(SKIN), SKIN))
        avatar = _avatar(source.name, splats, found, rotation)
        files = source_files(source.files())
        return replace(avatar, provenance={**avatar.provenance, "source_files": files}).check()


def clip_source(path: Path) -> bytes | None:
    """The bytes of animation.glb, None where there is none. Raises AvatarError as `read_lam`."""
    with owned(SYSTEM):
        source = _Source(path)
        return source.read(CLIPS) if source.has(CLIPS) else None


class _Source:
    """The files of one avatar by their bare names, from a zip or a folder."""

    def __init__(self, path: Path):
        self._path = path
        if path.is_dir():
            names = [str(p.relative_to(path).as_posix()) for p in _files_of(path)]
        elif path.is_file():
            with Archive(path) as archive:
                names = list(archive.names)
        else:
            raise AvatarError("no such file or folder", file=path)
        found = _folders(names)
        if len(found) != 1:
            number = "no" if not found else f"{len(found)}"
            raise AvatarError(f"holds {number} folder with {' and '.join(NEEDED)}, expected one", file=path)
        self._names = names
        self._folder = found[0]
        self.name = self._folder.name or path.resolve().stem

    def has(self, name: str) -> bool:
        return str(self._folder / name) in self._names

    def files(self) -> dict[str, Path]:
        """The zip itself, or the files of a folder that are read."""
        if self._path.is_file():
            return {self._path.name: self._path}
        return {name: self._path / self._folder / name for name in NEEDED}

    def read(self, name: str) -> bytes:
        inner = str(self._folder / name)
        if self._path.is_dir():
            return _limited(name, (self._path / inner).stat().st_size, (self._path / inner).read_bytes)
        with Archive(self._path) as archive:
            return _limited(name, archive.size(inner), lambda: archive.read(inner))


def _limited(name: str, size: int, read: Callable[[], bytes]) -> bytes:
    if size > MAX_FILE_BYTES:
        raise AvatarError(f"is {size} bytes long; up to {MAX_FILE_BYTES} are read", file=name)
    try:
        return read()
    except OSError as error:
        raise AvatarError(f"cannot be read: {error.strerror or error}", file=name) from None


def _files_of(folder: Path) -> list[Path]:
    """The files in a folder and in the folders right in it."""
    return [p for pattern in ("*", "*/*") for p in sorted(folder.glob(pattern)) if p.is_file()]


def _folders(names: Iterable[str]) -> list[PurePosixPath]:
    """The folders that hold every needed file."""
    paths = {PurePosixPath(name) for name in names}
    homes = sorted({p.parent for p in paths if p.name == OFFSETS and p.parts[0] != "__MACOSX"})
    return [home for home in homes if all(home / name in paths for name in NEEDED)]


def _gaussians(data: bytes) -> Gaussians:
    """The file's Gaussians with `mean` still the offset, colours as SH."""
    raw = ply.gaussians(ply.decode(data, OFFSETS), OFFSETS)
    if raw.sh_degree:
        raise AvatarError(
            "are there, but LAM has none: this is no file of its", file=OFFSETS, field="f_rest_*"
        )
    outside = (raw.sh < 0) | (raw.sh > 1)
    if outside.any():
        row, _, channel = np.unravel_index(int(np.argmax(outside)), raw.sh.shape)
        raise AvatarError(
            f"is {raw.sh[row, 0, channel]:.6g}; LAM stores plain RGB, 0..1",
            file=OFFSETS,
            field=f"f_dc_{channel}[{row}]",
        )
    sh = (raw.sh.astype(np.float64) - 0.5) / constants()["sh_c0"][0]
    return replace(raw, sh=sh.astype(np.float32))


def _avatar(name: str, splats: Gaussians, found: GltfRig, rotation: str) -> Avatar:
    rig, n = found.rig, splats.count
    if n != len(rig.vertices):
        raise AvatarError(f"has {n} rows, but {SKIN} has {len(rig.vertices)} vertices", file=OFFSETS)
    if rotation == "head_bone" and HEAD_JOINT not in rig.joint_names:
        raise AvatarError(f"rotation head_bone needs a joint {HEAD_JOINT!r}", file=SKIN)
    columns = len(found.morph_names)
    with np.errstate(over="ignore"):  # becomes infinite, which check() refuses
        mean = rig.vertices + splats.mean
    return Avatar(
        name=name,
        gaussians=replace(splats, mean=mean),
        groups=(Group("body", 0, n, "skin"),),
        rules=Rules(
            rotation=rotation,
            rotation_joint=HEAD_JOINT if rotation == "head_bone" else None,
            sh_direction="world",
        ),
        expressions=tuple(Expression(morph) for morph in found.morph_names),
        late_morph_names=(),
        blendshapes=Blendshapes(
            geometry=_geometry(rig.morphs),
            appearance=SparseRows.empty(n, columns, {"log_scale": (3,), "opacity_logit": (), "sh": (1, 3)}),
            correctives=SparseRows.empty(n, 0, {"mean": (3,)}),
            late_morphs=SparseRows.empty(n, 0, {"mean": (3,)}),
        ),
        skin=rig.skin,
        rig=rig,
        sh_degree=0,
        driving=Driving(
            mode="names" if any(canonical(morph) for morph in found.morph_names) else "none",
            head_joint=HEAD_JOINT if HEAD_JOINT in rig.joint_names else None,
        ),
        raster=RasterSettings(background="per_view"),
        head_pose_in="mesh",
        provenance={"system": SYSTEM, "source_commit": "aigc3d/LAM 3395736", "notes": _notes(found)},
    )


def _geometry(morphs: SparseRows) -> SparseRows:
    """A vertex's morphs as its Gaussian's: positions move, rotations never do."""
    still = np.zeros((morphs.entries, 4), np.float32)
    return replace(morphs, values={"mean": morphs.values["position"], "quat_wxyz": still})


def _notes(found: GltfRig) -> list[str]:
    notes = []
    if found.node_pose:
        notes.append(
            f"the nodes of {SKIN} do not stand in binding pose (largest entry {found.rest_deviation:.3g}); "
            "rest transforms are those of the inverse bind matrices"
        )
    if found.renormalised:
        notes.append(
            f"skin weights of {found.renormalised} vertices did not add up to 1; divided by their sum"
        )
    return notes
