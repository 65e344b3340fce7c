"""`python -m avatar_schema`: writes the values of every rule into the JSON Schemas, from v1/rules.json."""

from __future__ import annotations

import argparse
import sys

from avatar_schema.generate import V1, schema_texts


def main() -> int:
    """0; with --check 1 where a schema differs from the table of rules."""
    parser = argparse.ArgumentParser(prog="python -m avatar_schema", description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; name the schemas that differ")
    asked = parser.parse_args()
    differing = {
        name: text for name, text in schema_texts().items() if (V1 / name).read_text("utf-8") != text
    }
    for name, text in differing.items():
        if asked.check:
            print(f"v1/{name} differs from v1/rules.json: run python -m avatar_schema")
        else:
            (V1 / name).write_text(text, "utf-8")
    return 1 if asked.check and differing else 0


if __name__ == "__main__":
    sys.exit(main())
