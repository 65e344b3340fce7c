"""Checks a whole program before anything is uploaded: no pass that is accepted leaves its buffers.

Every pass is held to the access contract of its entry (`avatar_shaders.contracts`). What concerns several passes is
here: buffers, the layout of Pose, the order of passes, chunks, and the work of a frame.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.access import U32_END, Access, Packed, is_u32
from avatar_runtime.program.chunks import MOST_ROWS
from avatar_runtime.program.model import FRAME_SOURCES, POSE_SECTIONS, WORD, Buffer, Level, Pass, Program

MOST_BYTES = (1 << 31) - 1  # of one buffer: sizes in OpenGL's interface are signed
MOST_BYTES_IN_ALL = 1 << 32
MOST_PASSES = 1 << 14  # of one list
MOST_WORK = 1 << 28  # rows and entries of one frame of a level
MOST_COLUMNS = 1 << 16  # of a section of Pose
JOINT_FLOATS = 12
HOST_BUFFERS = ("Pose", "Mesh")  # players write them, so they are bound by these names
CHUNK_BUFFERS = ("Splats", "Sh", "Projected")
STAGES = {"mesh": ("morph", "skin"), "deform": ("blend", "bind", "activate"), "view": ("project",)}
STAGES |= {"shadow": ("shadow",), "light": ("light",)}
SOURCES = {  # list of passes -> beginnings of names of the frame that it may ask for
    "mesh": (),
    "deform": ("world_", "group_"),
    "view": ("camera_", "clip_", "eye", "tan_half_fov", "image_size"),
    "shadow": ("shadow_row", "world_row"),
    "light": ("light_", "shadow_", "world_quat"),
}
_TABLE = "group_"  # names that begin so have a row a group
_SOURCE = re.compile(r"([a-z0-9_]+)(?:\[([0-9]{1,9})\])?")


def check_program(program: Program, groups: int, most_work: int = MOST_WORK) -> None:
    """Raises AvatarError for a program that would read or write outside its buffers, or work without bound.

    `groups` is how many groups of Gaussians the avatar has: rows of group_matrix and group_rotation in a frame.
    `most_work`: how many rows and entries a frame of a level may have.
    The field of the error says which pass and which constant, section or buffer.
    """
    _Checker(program, groups, most_work).check()


class _Checker:
    def __init__(self, program: Program, groups: int, most_work: int) -> None:
        self.program, self.groups, self.most_work = program, groups, most_work
        self.packed: dict[str, Packed] = {}
        self.pose: dict[str, tuple[int, int]] = {}  # section -> (first float, items)
        self.roles: dict[str, str] = {}  # buffer without sections -> the one name that shaders give it
        self.touched: Counter[str] = Counter()  # its elements, in bytes
        self.agreed: dict[tuple[str, str], object] = {}  # (buffer or entry, constant) -> value

    def check(self) -> None:
        self._check_buffers()
        self._check_pose()
        written: set[str] = set()
        work = self._check_list("mesh", "mesh", self.program.mesh, written, None)
        self._check_mesh()
        if not self.program.levels:
            raise AvatarError("there is none", field="levels")
        for index, level in enumerate(self.program.levels):
            self._check_level(f"level {index}", level, written, work)
        prefixes = [level.prefix for level in self.program.levels]
        if len(set(prefixes)) < len(prefixes):
            raise AvatarError("two levels have the same prefix", field="levels")
        self._check_sizes()

    def _check_buffers(self) -> None:
        total = 0
        for name, buffer in self.program.buffers.items():
            if not isinstance(name, str) or buffer.name != name:
                raise AvatarError(f"its name is {str(buffer.name)[:80]!r}", field=_buffer(name))
            if not is_u32(buffer.size) or buffer.size > MOST_BYTES:
                raise AvatarError(
                    f"has {str(buffer.size)[:40]} bytes; {MOST_BYTES} are the most", field=_buffer(name)
                )
            total += buffer.size
            if buffer.sections:
                self._check_packed(buffer)
                self.packed[name] = Packed(buffer)
        if total > MOST_BYTES_IN_ALL:
            raise AvatarError(f"have {total} bytes; {MOST_BYTES_IN_ALL} are the most", field="buffers")

    def _check_packed(self, buffer: Buffer) -> None:
        for section in buffer.sections:
            elements = section.elements
            if elements.ndim != 1 or elements.dtype not in (np.uint8, np.uint16, np.uint32):
                kind = f"{elements.dtype} {elements.shape}"
                raise AvatarError(
                    f"is {kind}; a run of uint8, uint16 or uint32 is needed",
                    field=_buffer(buffer.name, section.name),
                )
        names = Counter(section.name for section in buffer.sections)
        twice = [name for name, times in names.items() if times > 1]
        if twice:
            raise AvatarError("is a duplicate", field=_buffer(buffer.name, twice[0]))
        size = WORD * sum(section.words for section in buffer.sections)
        if buffer.size != size:
            raise AvatarError(
                f"has {buffer.size} bytes; its sections take {size}", field=_buffer(buffer.name)
            )

    def _check_pose(self) -> None:
        """Sections of Pose follow each other without a gap."""
        begins = [self.program.pose.get(name) for name in POSE_SECTIONS]
        ends = [*begins[1:], self.program.pose_floats]
        if len(self.program.pose) != len(POSE_SECTIONS) or not all(map(is_u32, [*begins, *ends])):
            raise AvatarError(f"needs the first floats of {', '.join(POSE_SECTIONS)} alone", field="pose")
        if begins[0] != 0:
            raise AvatarError(f"{POSE_SECTIONS[0]} begins at {begins[0]}, not at 0", field="pose")
        for name, begin, end in zip(POSE_SECTIONS, begins, ends, strict=True):
            floats = JOINT_FLOATS if name == "joints" else 1
            assert begin is not None and end is not None
            if not 0 <= end - begin <= floats * MOST_COLUMNS or (end - begin) % floats:
                raise AvatarError(f"{name} takes {end - begin} floats", field="pose")
            self.pose[name] = (begin, (end - begin) // floats)

    def _check_mesh(self) -> None:
        """Stage morph moves every vertex once, run after run, and then stage skin where there are joints."""
        mesh, stages, sound = self.program.mesh, list[str](), True
        vertices = at = mesh[0].count("vertices") if mesh else 0
        for one in mesh:
            if at == vertices:
                stages.append(one.entry)
                at = 0
            sound &= one.entry == stages[-1] and one.count("first") == at
            at += one.count("count")
        expected = ["morph", "skin"][: 1 + (self.pose["joints"][1] > 0)] if mesh else []
        if not sound or at != vertices or stages != expected:
            raise AvatarError("passes do not move every vertex once a stage", field="mesh")

    def _check_level(self, place: str, level: Level, written: set[str], work: int) -> None:
        _check_chunks(place, level)
        known = set(written)
        work += self._check_list(f"{place}, deform", "deform", level.deform, known, level)
        work += self._check_list(f"{place}, view", "view", level.view, known, level)
        if level.light:
            work += self._check_list(f"{place}, shadow", "shadow", level.shadow, known, level)
            work += self._check_list(f"{place}, light", "light", level.light, known, level)
        elif level.shadow:
            raise AvatarError("casts shadows that no pass reads", field=f"{place}, shadow")
        if work > self.most_work:
            raise AvatarError(
                f"has {work} rows and entries a frame; {self.most_work} are the most", field=place
            )
        projected = Counter(one.buffers.get("Projected") for one in level.view)
        lit = Counter(one.buffers.get("Projected") for one in level.light)
        for name in level.names("Projected"):
            if projected[name] != 1 or (level.light and lit[name] != 1):
                where = "view" if projected[name] != 1 else "light"
                found = projected[name] if where == "view" else lit[name]
                raise AvatarError(f"{found} passes write {name}; one is needed", field=f"{place}, {where}")
        if self.program.reads_mesh != any("Mesh" in one.buffers for one in level.deform):
            raise AvatarError(
                f"is {self.program.reads_mesh}; the passes of {place} differ", field="reads_mesh"
            )
        self._check_placed(place, level)

    def _check_placed(self, place: str, level: Level) -> None:
        """Every chunk is blended once, and placed: by one pass over the mesh, or by passes that share one buffer."""
        for name in level.names("Splats"):
            own = [one.buffers for one in level.deform if one.buffers.get("Splats") == name]
            blended = [bound for bound in own if "BlendStatic" in bound]
            embedded = [bound for bound in own if "EmbedStatic" in bound]
            skinned = {bound["BindStatic"] for bound in own if "BindStatic" in bound}
            placed = (1, 0) if self.program.reads_mesh else (0, 1)
            if len(blended) != 1 or (len(embedded), len(skinned)) != placed:
                raise AvatarError(f"{name} is not blended once and placed", field=f"{place}, deform")

    def _check_list(
        self, place: str, which: str, passes: Sequence[Pass], written: set[str], level: Level | None
    ) -> int:
        """The rows and entries of all passes; buffers that they write join `written`."""
        if len(passes) > MOST_PASSES:
            raise AvatarError(f"has {len(passes)} passes; {MOST_PASSES} are the most", field=place)
        if level is not None and not passes:
            raise AvatarError("has no passes", field=place)
        work, reached = 0, 0
        for index, one in enumerate(passes):
            access = Access(f"{place} pass {index}", one, self.program.buffers, self.packed, self.pose)
            stages = STAGES[which]
            if access.stage not in stages[reached : reached + 1 if index == 0 else None]:
                raise access.error(
                    "entry", f"stage {access.stage} is out of place; the order is {', '.join(stages)}"
                )
            reached = stages.index(access.stage)
            access.check_constants()
            self._check_sources(access, which)
            self._check_bound(access, written)
            if level is not None:
                self._check_chunk(access, level, place.split(",")[0])
            work += one.rows + access.check_sections()
        return work

    def _check_sources(self, access: Access, which: str) -> None:
        for name, value in access.one.constants.items():
            if not isinstance(value, str):
                continue
            found = _SOURCE.fullmatch(value)
            source, row = (found[1], found[2]) if found else ("", None)
            if source not in FRAME_SOURCES or not source.startswith(SOURCES[which]):
                raise access.error(name, f"{value[:80]!r} is no value of the frame for these passes")
            if access.types[name] != f"float{FRAME_SOURCES[source]}":
                raise access.error(
                    name, f"{value!r} has {FRAME_SOURCES[source]} floats; a {access.types[name]} is needed"
                )
            if (row is not None) != source.startswith(_TABLE):
                raise access.error(name, f"{value!r} needs {'no row' if row else 'a row, NAME[i]'}")
            if row is not None and int(row) >= self.groups:
                raise access.error(name, f"{value!r} is beyond the {self.groups} groups")

    def _check_bound(self, access: Access, written: set[str]) -> None:
        """Buffers without sections: one name each, written before they are read, large enough, agreed upon."""
        one, touched = access.one, access.touched()
        for name, bound in one.buffers.items():
            if name in access.static:
                continue
            if self.roles.setdefault(bound, name) != name:
                raise access.error(name, f"{bound!r} is bound as {self.roles[bound]} elsewhere")
            if name in HOST_BUFFERS and bound != name:
                raise access.error(name, f"is bound to {bound!r}; players write buffer {name!r}")
            if access.storage[name]["readonly"] and bound not in written and name != "Pose":
                raise access.error(name, f"no earlier pass writes {bound!r}")
            size = access.storage[name]["stride"] * touched.get(name, 0)
            self.touched[bound] = max(self.touched[bound], size)
            if size > self.program.buffers[bound].size:
                raise access.error(
                    name, f"takes {size} bytes; {bound!r} has {self.program.buffers[bound].size}"
                )
        for name, constants in access.contract.get("same", {}).items():
            self._agree(access, one.buffers[name], constants)
        written |= {one.buffers[name] for name, item in access.storage.items() if not item["readonly"]}

    def _agree(self, access: Access, what: str, constants: Sequence[str]) -> None:
        for constant in constants:
            value = access.count(constant)
            first = self.agreed.setdefault((what, constant), value)
            if first != value:
                raise access.error(constant, f"is {value}; an earlier pass over {what} has {first}")

    def _check_chunk(self, access: Access, level: Level, place: str) -> None:
        self._agree(access, f"{place} ({access.one.entry})", access.contract.get("level", ()))
        if "chunk" not in access.contract:
            return
        index: int | None = None
        for kind in CHUNK_BUFFERS:
            if kind not in access.one.buffers:
                continue
            bound, names = access.one.buffers[kind], level.names(kind)
            if bound not in names or index not in (None, names.index(bound)):
                raise access.error(kind, f"{bound!r} is no buffer of this chunk")
            index = names.index(bound)
        constant = access.contract["chunk"]
        if index is not None and access.count(constant) != level.chunks[index].count:
            rows = level.chunks[index].count
            raise access.error(constant, f"is {access.count(constant)}; chunk {index} has {rows} rows")

    def _check_sizes(self) -> None:
        """Buffers without sections are as large as what is touched, so that a small file takes little memory."""
        pose = self.program.buffers.get("Pose")
        if pose is not None and not pose.sections:
            self.touched["Pose"] = WORD * self.program.pose_floats
        for name, buffer in self.program.buffers.items():
            if not buffer.sections and buffer.size != self.touched[name]:
                raise AvatarError(
                    f"has {buffer.size} bytes; passes touch {self.touched[name]}", field=_buffer(name)
                )


def _check_chunks(place: str, level: Level) -> None:
    first = 0
    for index, run in enumerate(level.chunks):
        if not is_u32(run.first) or not is_u32(run.count) or run.first != first:
            raise AvatarError(
                f"begins at row {str(run.first)[:40]}, not {first}", field=f"{place}, chunk {index}"
            )
        if not 1 <= run.count <= MOST_ROWS:
            raise AvatarError(
                f"has {run.count} rows; 1 to {MOST_ROWS} are taken", field=f"{place}, chunk {index}"
            )
        first += run.count
    if not 0 < first < U32_END:
        raise AvatarError(f"has {first} rows", field=place)


def _buffer(name: object, section: str = "") -> str:
    return f"buffer {str(name)[:80]}" + (f", {section[:80]}" if section else "")
