"""Packs that cost a reader the most for their bytes, from the golden pack `joints`; each is taken, or refused late.

A file of `size` bytes may have a header of 65,536 + 16 * size bytes, tensors of 400 * size, and may decode to as much.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from tests.players.hostile.packs import Parts, with_entries

RATIO, HEADER_FREE, HEADER_RATIO = 400, 1 << 16, 16
SPARE = 2000  # bytes of a header that a builder leaves
NAMES = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+~!$"
Builder = Callable[["Grown"], None]


class Grown:
    """The golden pack, to which tensors and text are added up to what a file of `size` bytes may have."""

    def __init__(self, whole: bytes, size: int, share: float) -> None:
        self.parts, self.size, self.share = Parts(whole), size, share
        self.document: Any = self.parts.document
        self.texts: dict[str, str] = {}

    def room(self) -> int:
        """Bytes that the header may still grow by: a share of what is left."""
        most = min(HEADER_FREE + HEADER_RATIO * self.size, 16 << 20)
        return int(self.share * (most - len(self._header()) - SPARE))

    def text(self, before: str, items: Iterable[str], after: str, cost: float = 1) -> str:
        """A placeholder for JSON of as many items as there is room for; a letter costs `cost` bytes."""
        left, kept = self.room(), []
        for item in items:
            left -= int(cost * (len(item) + 1 + item.count('"') + item.count("\\")))
            if left < 0:
                break
            kept.append(item)
        name = f"@{len(self.texts)}"
        self.texts[f'"{name}"'] = before + ",".join(kept) + after
        return name

    def tensor(self, name: str, data: bytes) -> str:
        """Adds a tensor."""
        return self.parts.tensor(name, data)

    def array(self, name: str, values: Any, kind: str) -> None:
        """Sets an array."""
        stored = {"tensor": self.tensor(f"new {name}", values.tobytes()), "type": kind, "codec": "raw"}
        self.document["arrays"][name] = {**stored, "shape": list(values.shape)}

    def section(self, buffer: str, name: str, **to: Any) -> None:
        """Changes a section."""
        next(one for one in _buffer(self.document, buffer)["sections"] if one["name"] == name).update(to)

    def _header(self) -> bytes:
        text = json.dumps(self.document, separators=(",", ":"))
        for placeholder, wanted in self.texts.items():
            text = text.replace(placeholder, wanted)
        header = {**self.parts.header, "__metadata__": {"pack": text}}
        return json.dumps(header, separators=(",", ":")).encode()

    def file(self) -> bytes:
        """The file, filled up with noise to `size` bytes where it has less."""
        for missing in (0, self.size):
            missing -= len(self._zipped()) if missing else 0
            self.tensor(f"noise {missing}", np.random.default_rng(7).bytes(max(missing - 100, 0)))
        return self._zipped()

    def _zipped(self) -> bytes:
        header = self._header()
        data = len(header).to_bytes(8, "little") + header + bytes(self.parts.body)
        return gzip.compress(data, 9, mtime=0)


def names() -> Iterable[str]:
    """Short names, without end."""
    length = 1
    while True:
        for number in range(len(NAMES) ** length):
            digits = (number // len(NAMES) ** place % len(NAMES) for place in range(length))
            yield "".join(NAMES[digit] for digit in digits)
        length += 1


def worst(kind: str, whole: bytes, size: int) -> bytes:
    """The pack of that kind in at most about `size` bytes."""
    share = 1.0
    while share > 0.01:
        grown = Grown(whole, size, share)
        WORST[kind](grown)
        file = grown.file()
        if len(file) <= 1.03 * size:
            return file
        share *= max(0.5, min(0.95, size / len(file)))
    raise ValueError(f"the golden pack alone is larger than {size} bytes")


def _extras(item: Callable[[str], str], brackets: str = "[]") -> Builder:
    """Values that no reader knows; `item` makes one of a name."""

    def build(grown: Grown) -> None:
        made = (item(name) for name in names())
        grown.document["avatar"]["extras"] = {"x": grown.text(brackets[0], made, brackets[1])}

    return build


def tensors(grown: Grown) -> None:
    """As many tensors as the header has room for."""
    for name, _ in zip(names(), range(grown.room() // 60), strict=False):
        grown.parts.header[name] = {"dtype": "U8", "shape": [0], "data_offsets": [0, 0]}


def expressions(grown: Grown) -> None:
    """Names that stand at the end of long lists, and one wrong value after all of them."""
    made = (f'{{"name":"{name}","range":[0,1]}}' for name in names())
    last = '{"name":"x","range":[0,""]}'
    grown.document["avatar"]["expressions"] = grown.text("[", made, f",{last}]", 1.05)


def joints(grown: Grown) -> None:
    """A chain of joints, all of them in joint_mix of each group and turned by driving."""
    _joints(grown, "")


def wrong_joint(grown: Grown) -> None:
    """The same with a name that is like all others, and none of them."""
    _joints(grown, "z" * 80)


def _joints(grown: Grown, wrong: str) -> None:
    document, avatar = grown.document, grown.document["avatar"]
    old = avatar["joints"]
    count = min(grown.room() // 60, RATIO * grown.size // 300)
    new = [f"jj{name}" for name, _ in zip(names(), range(count), strict=False)]
    total = len(old) + count
    avatar["joints"] = old + new
    avatar["clips"] = []
    document["arrays"] = {k: v for k, v in document["arrays"].items() if not k.startswith("clips.")}
    identity = np.tile(np.eye(4, dtype=np.float32), (total, 1, 1))
    for name in ("rig.rest_local", "rig.inverse_bind_matrix"):
        grown.array(name, identity, "f32")
    grown.array("rig.parents", np.arange(-1, total - 1, dtype=np.int32), "i32")
    grown.array("rig.joint_basis", np.zeros((len(avatar["expressions"]), total, 3), np.float32), "f32")
    mix: Any = {name: 0 for name in new} | ({wrong: 1} if wrong else {})
    for group in document["levels"][0]["groups"]:
        if group["binding"] == "joint_mix":
            group["joint_mix"] |= mix
    driven = [f"joint/{name}/x" for name in new]
    avatar["driving"] |= {"mode": "matrix", "inputs": [], "outputs": driven, "matrix": [[]] * count}
    program = document["program"]
    program["pose_floats"] = program["pose"]["joints"] + 12 * total
    _buffer(document, "Pose")["bytes"] = 4 * program["pose_floats"]


def _buffer(document: Any, name: str) -> Any:
    (found,) = (buffer for buffer in document["program"]["buffers"] if buffer["name"] == name)
    return found


def entries(grown: Grown) -> None:
    """As many entries as a frame may have, of codes of no width."""
    with_entries(grown.parts, min(65536, int(grown.share * 15 * grown.size / 48)))


def clips(grown: Grown) -> None:
    """Clips that stand still, of as many frames as can be."""
    avatar, arrays = grown.document["avatar"], grown.document["arrays"]
    channels = len(avatar["expressions"]) + len(avatar["late_morphs"]) + 16 * (len(avatar["joints"]) + 1)
    avatar["clips"] = [{"name": "still", "fps": 30, "frames": (RATIO - 1) * grown.size // (4 * channels)}]
    for name in ("expression_weights", "late_weights", "joint_delta", "world_from_avatar"):
        scale = f"clips.0.{name}.scale"
        rows = arrays[scale]["shape"][0]
        flat = np.eye(4, dtype=np.float32).reshape(-1) if rows % 16 == 0 else np.zeros(1, np.float32)
        low = np.tile(flat, rows // len(flat))
        grown.array(scale, np.stack([low, np.zeros_like(low)], axis=1), "f32")
        grown.array(f"clips.0.{name}.codes", np.zeros((0, avatar["clips"][0]["frames"]), np.uint16), "u16")


def vertices(grown: Grown) -> None:
    """A mesh of no triangle and many vertices."""
    count = (RATIO - 20) * grown.size // 4
    sections: list[Any] = [
        {"name": "corners", "bits": 8, "count": 0, "codec": "raw", "tensor": grown.tensor("none", b"")},
        {"name": "vertex_triangle_ptr", "bits": 32, "count": count, "codec": "incidence"},
        {"name": "vertex_triangle", "bits": 8, "count": 0, "codec": "incidence"},
    ]
    grown.document["program"]["buffers"].append({"name": "More", "sections": sections})


def anchors(grown: Grown) -> None:
    """Every vertex an anchor, for many groups that follow anchors."""
    count = int(grown.share * 7.5 * grown.size)
    zeros, none = grown.tensor("zeros", bytes(count)), grown.tensor("none", b"")
    for buffer, parts in (("MorphStatic.0", ("morph", "corrective")), ("SkinStatic.0", ("late", "skin"))):
        for part in parts:
            grown.section(buffer, f"{part}_ptr", count=count + 1, tensor=zeros)
            for name in ("column", "weight" if part == "skin" else "position"):
                grown.section(buffer, f"{part}_{name}", count=0, tensor=none, record=1)
    places = grown.tensor("places", bytes(3 * count))
    grown.section("MorphStatic.0", "template_position", count=3 * count, tensor=places)
    program = grown.document["program"]
    program["buffers"][1]["bytes"] = 48 * count
    for one in program["mesh"]:
        said, at = one["constants"], 0
        for section in _buffer(grown.document, f"{one['entry'].capitalize()}Static.0")["sections"]:
            said[section["name"]] = at
            at += (section["count"] * section["bits"] + 31) // 32
        one["rows"] = said["count"] = count
        if "vertices" in said:
            said["vertices"] = count
    planes = np.arange(count, dtype="<u4").view(np.uint8).reshape(-1, 4).T
    tensor = grown.tensor("anchors", planes.tobytes())
    grown.document["arrays"]["rig.anchor_vertices"] |= {"shape": [count], "tensor": tensor}
    groups = grown.document["levels"][0]["groups"]
    groups[1:2] = [{"name": "a", "first": 24 + i, "count": 1, "binding": "anchor"} for i in range(8)]


def records(grown: Grown) -> None:
    """One tensor that sections read as records of other lengths, in elements of 8, 16 and 32 bits."""
    size = int(grown.share * (RATIO - 10) * grown.size) // 128 // 10_080 * 10_080
    one = {"codec": "planes", "tensor": grown.tensor("zeros", bytes(size))}
    sections = [
        {"name": f"{bits} {record}", "record": record, "bits": bits, "count": size // (bits // 8), **one}
        for bits in (8, 16, 32)
        for record in range(1, 129)
        if size // (bits // 8) % record == 0
    ]
    grown.document["program"]["buffers"].append({"name": "zeros", "sections": sections[:128]})


WORST: dict[str, Builder] = {
    "lists": _extras(lambda _: "[]"),
    "objects": _extras(lambda _: "{}"),
    "members": _extras(lambda name: f'"{name}":0', "{}"),
    "objects of one member": _extras(lambda name: f'{{"{name}":0}}'),
    "texts": _extras(lambda name: f'"{name}"'),
    "escapes": _extras(lambda _: '"\\u00e9\\u202e\\n"'),
    "numbers": _extras(lambda _: "-1.7976931348623157e308"),
    "long numbers": _extras(lambda _: f"0.{'1' * 4000}e-300"),
    "tensors": tensors,
    "expressions": expressions,
    "joints": joints,
    "wrong joint": wrong_joint,
    "entries": entries,
    "clips": clips,
    "vertices": vertices,
    "anchors": anchors,
    "records": records,
}
