"""The bundle format: JSON Schemas, constants, rules and versions. See SPEC.md beside this package.

`validate` checks documents against them; `python -m avatar_schema` makes the schemas' enums of rules.
"""

from __future__ import annotations

from avatar_schema.documents import LATEST, constants, schema
from avatar_schema.rule_table import Family, Rule, Value, families, rules

__all__ = [
    "LATEST",
    "Family",
    "Rule",
    "Value",
    "constants",
    "extras",
    "families",
    "rules",
    "schema",
    "validate",
]
