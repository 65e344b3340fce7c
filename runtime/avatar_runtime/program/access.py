"""One pass against the access contract of its entry: what a kernel would read and write, checked before it runs.

`avatar_shaders.contracts` explains the contracts. This interpreter knows no entry, no system and no rule.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.model import WORD, Buffer, Pass, Section
from avatar_runtime.program.passes import PADDING, interfaces

U32_END = 1 << 32
MOST_FLOAT32 = float(np.finfo(np.float32).max)
MOST_SCALE = 1e30  # of a float that codes are multiplied by: the product with any code is finite


class Packed:
    """A static buffer: where its sections begin, and what is found in them. Each is searched once."""

    def __init__(self, buffer: Buffer) -> None:
        self.offsets = buffer.offsets()
        self.sections = {section.name: section for section in buffer.sections}
        self.words = buffer.size // WORD
        self._found: dict[tuple[str, str], Any] = {}

    def largest(self, section: Section) -> int:
        """The largest element; -1 of none."""
        return int(self._once("largest", section, lambda e: e.max() if e.size else -1))

    def finite(self, section: Section, most: float = MOST_FLOAT32) -> bool:
        """Whether all elements, float32 by their bits, are finite and no larger than `most`."""

        def within(elements: Any) -> bool:
            values = np.ascontiguousarray(elements).view(np.float32)
            with np.errstate(invalid="ignore"):
                low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
            return bool(-most <= low and high <= most)  # min and max of NaN are NaN, which compares false

        return bool(self._once(f"finite {most}", section, within))

    def entries(self, section: Section) -> tuple[bool, int, int]:
        """Of a pointer: whether it begins with 0 and never falls; its last element; the longest row."""

        def walked(ptr: Any) -> tuple[bool, int, int]:
            if ptr.size == 0:
                return False, 0, 0
            rises = bool(ptr[0] == 0 and (ptr[1:] >= ptr[:-1]).all())
            return rises, int(ptr[-1]), int((ptr[1:] - ptr[:-1]).max()) if rises and ptr.size > 1 else 0

        found: tuple[bool, int, int] = self._once("entries", section, walked)
        return found

    def _once(self, what: str, section: Section, search: Any) -> Any:
        key = (what, section.name)
        if key not in self._found:
            self._found[key] = search(section.elements)
        return self._found[key]


class Access:
    """A pass, the contract of its entry, and the buffers that it binds."""

    def __init__(
        self,
        place: str,
        one: Pass,
        buffers: Mapping[str, Buffer],
        packed: Mapping[str, Packed],
        pose: Mapping[str, tuple[int, int]],  # section of Pose -> (first float, items)
    ) -> None:
        """Raises AvatarError unless the entry is known and the pass binds and sets exactly what it declares."""
        self.one, self.place = one, f"{place} ({str(one.entry)[:40]})"
        row = interfaces().get(one.entry) if isinstance(one.entry, str) else None
        if row is None or "access" not in row:
            raise AvatarError(
                "is no entry that a program may use; a newer version may know it", field=self.place
            )
        self.contract: Mapping[str, Any] = row["access"]
        self.storage: Mapping[str, Any] = {item["name"]: item for item in row["storage"]}
        self.stage: str = row["stage"]
        self.types = {m["name"]: m["type"] for b in row["uniform_blocks"] for m in b["members"]}
        self.types.pop(PADDING, None)
        self._pose, self._packed = pose, packed
        self.static = {told["buffer"] for told in self.contract.get("sections", {}).values()}
        self._same_names("buffers", self.storage, one.buffers)
        self._same_names("constants", self.types, one.constants)
        for name, bound in one.buffers.items():
            if not isinstance(bound, str) or bound not in buffers:
                raise self.error(name, f"{str(bound)[:80]!r} is no buffer of the program")
            if bool(buffers[bound].sections) != (name in self.static):
                need = "a buffer with sections" if name in self.static else "a buffer without sections"
                raise self.error(name, f"{bound!r} does not fit; {need} is needed")

    def error(self, what: str, message: str) -> AvatarError:
        """The error for a constant, section or buffer of this pass."""
        return AvatarError(message, field=f"{self.place}, {what}")

    def _same_names(self, what: str, wanted: Mapping[str, Any], given: Mapping[str, Any]) -> None:
        missing, extra = wanted.keys() - given.keys(), given.keys() - wanted.keys()
        if missing:
            raise self.error(what, f"{min(missing)} is missing")
        if extra:
            raise self.error(what, f"{str(min(extra, key=str))[:80]!r} is not known to this entry")

    def count(self, name: str) -> int:
        """A constant that is a whole number."""
        value = self.one.constants[name]
        assert isinstance(value, int), name
        return value

    def check_constants(self) -> None:
        """Types and ranges. Raises AvatarError. Names of the frame are not looked at."""
        for name, value in self.one.constants.items():
            self._check_type(name, value)
        for name, allowed in self.contract.get("values", {}).items():
            if self.count(name) not in allowed:
                known = ", ".join(map(str, allowed))
                raise self.error(name, f"{self.count(name)} is not known; known are {known}")
        for name, most in self.contract["most"].items():
            if not 1 <= self.count(name) <= most:
                raise self.error(name, f"is {self.count(name)}; 1 to {most} are taken")
        rows = self.contract["rows"]
        if not is_u32(self.one.rows) or self.one.rows != self.count(rows):
            raise self.error("rows", f"are {str(self.one.rows)[:40]}; constant {rows} is {self.count(rows)}")
        for total, limit in self.contract.get("fits", ()):
            if self.number(total) > self.number(limit):
                raise self.error(total, f"is {self.number(total)}; {limit} is {self.number(limit)}")
        for name, section in self.contract.get("pose", {}).items():
            if self.count(name) != self._pose[section][0]:
                raise self.error(name, f"is {self.count(name)}; {section} begins at {self._pose[section][0]}")

    def _check_type(self, name: str, value: object) -> None:
        kind = self.types[name]
        if kind == "uint":
            if not is_u32(value):
                raise self.error(name, f"is {str(value)[:40]}; a whole number of 32 bits is needed")
        elif kind == "float":
            if not is_float32(value):
                raise self.error(name, f"is {str(value)[:40]}; a finite float32 is needed")
        elif not isinstance(value, str):
            floats = int(kind.removeprefix("float"))
            if not isinstance(value, tuple) or len(value) != floats or not all(map(is_float32, value)):
                raise self.error(name, f"is {str(value)[:40]}; {floats} finite float32 are needed")

    def number(self, expression: str) -> int:
        """The value of an expression of the contract."""
        return sum(math.prod(map(self._factor, product)) for product in _parsed(expression))

    def _factor(self, factor: str) -> int:
        if factor.isdigit():
            return int(factor)
        if not factor.startswith("#"):
            return self.count(factor)
        name = factor[1:]
        pose = self.contract.get("pose", {})
        if name in pose:
            return self._pose[pose[name]][1]
        packed, section = self._section(name, self.contract["sections"][name]["buffer"])
        return packed.entries(section)[1]

    def touched(self) -> Mapping[str, int]:
        """Shader's name of a buffer without sections -> elements that the pass touches."""
        return {
            buffer: max(self.number(told["elements"]) for told in of if self._applies(told))
            for buffer, of in self.contract["elements"].items()
        }

    def _applies(self, told: Mapping[str, Any]) -> bool:
        return all(self.count(name) in values for name, values in told.get("when", {}).items())

    def check_sections(self) -> int:
        """Raises AvatarError for a section that the kernel would leave; the entries of all pointers together."""
        entries = 0
        for name, told in self.contract.get("sections", {}).items():
            if self._applies(told):
                self._check_section(name, told)
                entries += self.number(f"#{name}") if told["kind"] == "pointer" else 0
        return entries

    def _section(self, name: str, buffer: str) -> tuple[Packed, Section]:
        """The section of that name, which must begin where the constant says."""
        bound = self.one.buffers[buffer]
        packed = self._packed[bound]
        if name not in packed.sections:
            raise self.error(name, f"buffer {bound!r} has no section of that name")
        if self.count(name) != packed.offsets[name]:
            raise self.error(
                name, f"is {self.count(name)}; the section begins at word {packed.offsets[name]}"
            )
        return packed, packed.sections[name]

    def _check_section(self, name: str, told: Mapping[str, Any]) -> None:
        packed, section = self._section(name, told["buffer"])
        kind, wanted = told["kind"], self.number(told["elements"])
        width = self.count(told["width"]) if "width" in told else 32
        if width not in told.get("widths", (32,)):
            known = ", ".join(map(str, told["widths"]))
            raise self.error(told["width"], f"is {width}; known are {known}")
        if width == 0:
            if kind != "signed" and wanted and packed.offsets[name] >= packed.words:
                raise self.error(name, "begins at the end of its buffer; one word is read at width 0")
        else:
            if section.width != width:
                raise self.error(name, f"has elements of {section.width} bits; {width} are stated")
            if section.elements.size != wanted:
                raise self.error(name, f"has {section.elements.size} elements; {wanted} are needed")
            if width < 32 and wanted * width >= U32_END:
                raise self.error(
                    name, f"has {wanted} elements of {width} bits; their bits exceed a 32-bit index"
                )
        if kind == "pointer":
            self._check_pointer(name, told, packed, section)
        elif kind == "index":
            self._check_below(name, packed.largest(section), self.number(told["below"]))
        elif width == 32:
            if not packed.finite(section):
                raise self.error(name, "holds a float that is not finite")
        else:
            self._check_scale(name, told, packed, section, width)

    def _check_pointer(self, name: str, told: Mapping[str, Any], packed: Packed, section: Section) -> None:
        rises, _, longest = packed.entries(section)
        if not rises:
            raise self.error(name, "does not begin with 0, or falls")
        if longest > told["pointer"]:
            raise self.error(name, f"gives a row {longest} entries; {told['pointer']} are the most")

    def _check_below(self, name: str, largest: int, end: int) -> None:
        if largest >= end:
            raise self.error(name, f"holds {largest}; less than {end} is needed")

    def _check_scale(
        self, name: str, told: Mapping[str, Any], packed: Packed, section: Section, width: int
    ) -> None:
        scale = told["scale"]
        _, floats = self._section(scale, told["buffer"])
        wanted = self.number(told["floats"]) if "floats" in told else max(floats.elements.size, 1)
        if floats.width != 32 or floats.elements.size != wanted:
            raise self.error(scale, f"has {floats.elements.size} elements; {wanted} of 32 bits are needed")
        if not packed.finite(floats, MOST_SCALE):
            raise self.error(scale, f"holds a float that is not finite or exceeds {MOST_SCALE:g}")
        if told["kind"] == "table":
            largest = packed.largest(section) if width else 0
            self._check_below(name, largest, floats.elements.size)


@cache
def _parsed(expression: str) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(product.split("*")) for product in expression.split("+"))


def is_u32(value: object) -> bool:
    """Whether a value is a whole number of 32 bits."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < U32_END


def is_float32(value: object) -> bool:
    """Whether a value is a finite number that float32 has room for."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    return -MOST_FLOAT32 <= value <= MOST_FLOAT32
