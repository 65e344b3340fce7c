"""The fast check of a pack's long lists never accepts what the schema refuses."""

from __future__ import annotations

import json
from random import Random

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.codec.program_shape import is_plain, without_lists
from avatar_schema.validate import schema_problems
from tests.avatars import surface_avatar
from tests.exporter.packing.cases import opened
from tests.fuzz.mutate import other, places
from tests.session.fuzz import examples


def test_a_document_that_looks_plain_passes_the_schema() -> None:
    rng, refused = Random(4), 0
    _, document, _ = opened(pack([surface_avatar(3, rigged=False)], Fineness(40.0)).file)
    for _ in range(examples(100)):
        copy = json.loads(json.dumps(document))
        spots = list(places(copy["program"]))
        holder, key = rng.choice(spots)
        holder[key] = other(holder[key], rng)
        problems = schema_problems(copy, "pack")
        refused += bool(problems)
        if is_plain(copy["program"]):
            rest = schema_problems(without_lists(copy), "pack")
            assert bool(rest) == bool(problems), problems
    assert refused
