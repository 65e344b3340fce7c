"""Whether a document meets its JSON Schema, without saying why not: much faster than a full validator.

A schema becomes one function, made of one for each keyword and each kind of value. Both answers are exact for values
as `json.loads` gives them: a keyword that is not in the tables below is asked of `jsonschema`. Source of the rules:
JSON Schema 2020-12, Validation, section 6, as `jsonschema` implements them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from jsonschema import Draft202012Validator

Accept = Callable[[Any], bool]
Schema = bool | Mapping[str, Any]
SAYS_NOTHING = {
    "$comment",
    "$defs",
    "$id",
    "$schema",
    "description",
    "title",
    "type",
}  # `type` chooses the checks
KINDS: Mapping[type, set[str]] = {  # of a value: the names that `type` may have for it
    dict: {"object"}, list: {"array"}, str: {"string"}, bool: {"boolean"}, type(None): {"null"},
    int: {"integer", "number"}, float: {"integer", "number"},
}  # fmt: skip


class Acceptors:
    """The functions of one schema and of every part of it. The schema must not change afterwards."""

    def __init__(self, root: Schema) -> None:
        self._root, self._made = root, dict[int, Accept]()

    def of(self, part: Schema) -> Accept:
        """What decides whether a value meets `part`, an object inside the schema. It is made once."""
        if isinstance(part, bool):
            return lambda _: bool(part)
        found = self._made.get(id(part))
        if found is None:
            found = self._made[id(part)] = self._compiled(part)
        return found

    def _compiled(self, part: Mapping[str, Any]) -> Accept:
        said = part.get("type", sorted({name for names in KINDS.values() for name in names}))
        allowed = {said} if isinstance(said, str) else {*said}
        checks: dict[type, list[Accept] | None] = {
            kind: [] if names & allowed else None for kind, names in KINDS.items()
        }
        if "integer" in allowed and "number" not in allowed:
            checks[float] = [float.is_integer]
        for keyword in part.keys() - SAYS_NOTHING:
            kinds, check = self._check(keyword, part)
            for kind in kinds:
                found = checks[kind]
                if found is not None:
                    found.append(check)
        table = {kind: tuple(found) for kind, found in checks.items() if found is not None}

        def accepts(value: Any) -> bool:
            for check in table.get(type(value), NEVER):  # noqa: SIM110 - all() of a generator is slower
                if not check(value):
                    return False
            return True

        return accepts

    def _check(self, keyword: str, part: Mapping[str, Any]) -> tuple[tuple[type, ...], Accept]:
        """(kinds of values that a keyword concerns, its check)."""
        given = part[keyword]
        if keyword in SIMPLE:
            kinds, make = SIMPLE[keyword]
            return kinds, make(given)
        if keyword == "$ref" and given.startswith("#/"):
            return (*KINDS,), self.of(self._at(given))
        if keyword in ("anyOf", "allOf", "oneOf"):
            return (*KINDS,), _combined(keyword, [self.of(inner) for inner in given])
        if keyword == "items" and "prefixItems" not in part:
            return (list,), self._items(given)
        if keyword == "properties":
            return (dict,), self._properties(given)
        if keyword == "additionalProperties" and "patternProperties" not in part:
            return (dict,), self._others(given, part.get("properties", {}).keys())
        if keyword == "propertyNames":
            named = self.of(given)
            return (dict,), lambda value: all(map(named, value))
        if keyword == "if":
            when, then, other = (self.of(part.get(name, True)) for name in ("if", "then", "else"))
            return (*KINDS,), lambda value: then(value) if when(value) else other(value)
        if keyword in ("then", "else"):  # `if` asks them
            return (), lambda _: True
        return (*KINDS,), self._slow(keyword, part)

    def _at(self, pointer: str) -> Schema:
        found: Any = self._root
        for name in pointer.removeprefix("#/").split("/"):
            found = found[name.replace("~1", "/").replace("~0", "~")]
        part: Schema = found
        return part

    def _slow(self, keyword: str, part: Mapping[str, Any]) -> Accept:
        beside = {"prefixItems", "properties", "patternProperties", "contains", "minContains", "maxContains"}
        asked = {name: value for name, value in part.items() if name == keyword or name in beside}
        return Draft202012Validator(self._root).evolve(schema=asked).is_valid

    def _items(self, given: Schema) -> Accept:
        if isinstance(given, Mapping) and given.keys() == {"type", "minimum", "maximum"}:
            low, high = given["minimum"], given["maximum"]
            if given["type"] == "number":  # a capture has a million of them
                numbers = (int, float)
                return lambda row: all(
                    type(number) in numbers and not (number < low or number > high) for number in row
                )
        item = self.of(given)
        return lambda value: all(map(item, value))

    def _properties(self, given: Mapping[str, Schema]) -> Accept:
        inner = [(name, self.of(part)) for name, part in given.items()]
        return lambda value: all(accept(value[name]) for name, accept in inner if name in value)

    def _others(self, given: Schema, known: Any) -> Accept:
        if given is False:
            return lambda value: value.keys() <= known
        other = self.of(given)
        return lambda value: all(other(inner) for name, inner in value.items() if name not in known)


def _never(_: Any) -> bool:
    return False


NEVER = (_never,)


def _one_of(options: list[Any]) -> Accept:
    """Equal values; true and 1 differ, 1 and 1.0 do not."""
    flags = [option for option in options if isinstance(option, bool)]
    others = [option for option in options if not isinstance(option, bool)]
    return lambda value: value in (flags if isinstance(value, bool) else others)


def _unique(wanted: bool) -> Accept:
    slow = Draft202012Validator({"uniqueItems": wanted}).is_valid

    def check(value: list[Any]) -> bool:
        if all(type(item) is str for item in value):
            return not wanted or len({*value}) == len(value)
        return slow(value)

    return check


def _combined(keyword: str, options: list[Accept]) -> Accept:
    if keyword == "oneOf":
        return lambda value: sum(option(value) for option in options) == 1
    test = any if keyword == "anyOf" else all
    return lambda value: test(option(value) for option in options)


def _required(names: list[str]) -> Accept:
    wanted = frozenset(names)
    return lambda value: value.keys() >= wanted


def _pattern(text: str) -> Accept:
    search = re.compile(text).search
    return lambda value: search(value) is not None


# An enumeration of lists or objects would need the comparison that `_one_of` does not make: no schema here has one.
_NUMBER, _SCALAR = (int, float), (str, int, float, bool, type(None))
SIMPLE: Mapping[str, tuple[tuple[type, ...], Callable[[Any], Accept]]] = {
    "minimum": (_NUMBER, lambda least: lambda value: not value < least),
    "maximum": (_NUMBER, lambda most: lambda value: not value > most),
    "exclusiveMinimum": (_NUMBER, lambda below: lambda value: not value <= below),
    "minLength": ((str,), lambda least: lambda value: len(value) >= least),
    "maxLength": ((str,), lambda most: lambda value: len(value) <= most),
    "pattern": ((str,), _pattern),
    "minItems": ((list,), lambda least: lambda value: len(value) >= least),
    "maxItems": ((list,), lambda most: lambda value: len(value) <= most),
    "uniqueItems": ((list,), _unique),
    "minProperties": ((dict,), lambda least: lambda value: len(value) >= least),
    "maxProperties": ((dict,), lambda most: lambda value: len(value) <= most),
    "required": ((dict,), _required),
    "enum": ((*KINDS,), _one_of),
    "const": ((*KINDS,), lambda only: _one_of([only])),
}
