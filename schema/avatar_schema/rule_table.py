"""The rules of the bundle format, from v1/rules.json: the one table of their names, codes, places and sources.

JSON enums, shader constants and the codes of every backend are made from it or read from it. A new value of a rule is
a row here and a formula in each backend. SPEC.md defines every value by formula.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any

from avatar_schema.documents import text


@dataclass(frozen=True)
class Family:
    """Rules that go together: within a family each binding, rotation, position and scale goes with each other."""

    name: str
    embedded: bool  # whether the avatar has an embedding
    about: str
    source: str


@dataclass(frozen=True)
class Value:
    """One value that a rule may have."""

    name: str  # as the manifest spells it
    code: int  # as shaders, kernels and packs get it; a code never changes and is never used again
    source: str  # paper equation, or file:line of the trained system
    families: tuple[str, ...] = ()  # where it may stand; () is anywhere
    needs: tuple[str, ...] = ()  # of an avatar: rig, rotation_joint, displacement, local_offset
    same_formula_as: str | None = None  # the value whose code it has
    shown_by: str | None = None  # a conformance avatar whose reference differs under each other value
    mirror_of: str | None = None  # the value whose name it takes in a mirrored frame, and in no other


@dataclass(frozen=True)
class Rule:
    """One choice that the manifest records."""

    name: str
    about: str
    spec: str  # section of SPEC.md that defines its values
    values: tuple[Value, ...]  # in the order of the schema's enum
    enums: tuple[str, ...]  # FILE#/JSON/POINTER of the enums that list all values
    embedded_enums: tuple[str, ...] = ()  # of those that list what may stand with an embedding

    def names(self, family: str | None = None) -> tuple[str, ...]:
        """Names of all values, or of those that may stand in a family, in the order of the enum."""
        return tuple(v.name for v in self.values if family is None or not v.families or family in v.families)

    def value(self, name: str) -> Value:
        """The value of that name. Raises KeyError for another."""
        for value in self.values:
            if value.name == name:
                return value
        raise KeyError(f"rule {self.name} has no value {name!r}; it has {', '.join(self.names())}")


@cache
def rules() -> Mapping[str, Rule]:
    """Every rule by name, in the order of the table."""
    rows = _table()["rules"]
    return MappingProxyType({name: _rule(name, row) for name, row in rows.items()})


@cache
def families() -> Mapping[str, Family]:
    """Every family by name, in the order of the table."""
    rows = _table()["families"]
    return MappingProxyType({name: Family(name=name, **row) for name, row in rows.items()})


def _table() -> dict[str, Any]:
    table: dict[str, Any] = json.loads(text("rules.json"))
    return table


def _rule(name: str, row: dict[str, Any]) -> Rule:
    enums, embedded_enums = tuple(row["enums"]), tuple(row.get("embedded_enums", ()))
    values = tuple(_value(value) for value in row["values"])
    return Rule(name, row["about"], row["spec"], values, enums, embedded_enums)


def _value(row: dict[str, Any]) -> Value:
    cells: dict[str, Any] = {k: tuple(cell) if isinstance(cell, list) else cell for k, cell in row.items()}
    return Value(**cells)
