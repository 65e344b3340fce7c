"""Tables of figures, from what tests and benches wrote: tests/results/accuracy.csv, bench/results/*.csv."""

from __future__ import annotations

import csv
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from engine_tables import table

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
ACCURACY = ROOT / "tests" / "results" / "accuracy.csv"
BENCH = ROOT / "bench" / "results" / "AMD-EPYC-2-cores.csv"
MISFITS = ROOT / "tests" / "results" / "misfits.csv"
WRONG = ROOT / "tests" / "results" / "wrong_files.csv"
CAPTURES = ROOT / "tests" / "results" / "wrong_captures.csv"
LOWEST_IS_WORST = "dB"
Row = dict[str, str]


def rows() -> dict[str, Any]:
    """What figures.toml asks for."""
    return tomllib.loads((HERE / "figures.toml").read_text("utf-8"))


def measured() -> list[Row]:
    """What tests measured: figure, worst, limit."""
    with ACCURACY.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def accuracy(group: str) -> str:
    """A table of one group of figures.toml: what is compared, the limit asked, the worst that was measured."""
    lines = []
    for row in rows()["accuracy"][group]:
        found = [m for m in measured() if re.fullmatch(row["figures"], m["figure"])]
        if not found:
            raise SystemExit(f"figures.toml: no figure matches {row['figures']}")
        least = found[0]["figure"].endswith(LOWEST_IS_WORST)
        limits = sorted({float(m["limit"]) for m in found if m["limit"]})
        worst = (min if least else max)(float(m["worst"]) for m in found)
        unit = f" {row['unit']}" if row.get("unit") else ""
        asked = f"{number(limits[0] if least else limits[-1])}{unit}" if limits else "by the test itself"
        lines.append([row["what"], asked, f"{number(worst)}{unit}"])
    return table(["compared", "at least" if group == "profiles" else "limit asked", "measured"], lines)


def number(value: float | str) -> str:
    """At most three digits that count; no exponent where it is short without."""
    plain = float(value)
    return f"{plain:.3g}" if not 1000 <= abs(plain) < 1e6 else f"{plain:,.0f}"


def benched() -> dict[str, float]:
    """The newest value of each row of the bench."""
    with BENCH.open(newline="", encoding="utf-8") as file:
        return {row["what"]: float(row["value"]) for row in csv.DictReader(file)}


def performance(name: str) -> str:
    """A table of figures.toml whose cells name rows of the bench: `{row}` or `{row:factor}`."""
    asked, values = rows()["performance"][name], benched()

    def cell(text: str) -> str:
        return re.sub(r"\{(\w+)\}", lambda match: number(values[match[1]]), text)

    return table(asked["head"], [[cell(text) for text in line] for line in asked["rows"]])


def misfits(_: Path) -> str:
    """How many inputs that do not belong together are found."""
    with MISFITS.open(newline="", encoding="utf-8") as file:
        found = list(csv.DictReader(file))
    return f"Of {len(found)} misfits {sum(bool(row['now']) for row in found)} are found."


def wrong_files(_: Path) -> str:
    """How many mistakes of one file are found as stated."""
    with WRONG.open(newline="", encoding="utf-8") as file:
        every = list(csv.DictReader(file))
    cases, right = ([row for row in every if bool(row["mistake"]) == wrong] for wrong in (True, False))
    count = sum(row["found"] == "yes" for row in cases)
    alarms = sum(row["found"] != "yes" for row in right)
    return f"Of {len(cases)} cases {count} are found as stated. Of {len(right)} sound inputs {alarms} give an alarm."


def wrong_captures(_: Path) -> str:
    """How many captures with a mistake `avatar-train check` names, and how many right ones it leaves alone."""
    with CAPTURES.open(newline="", encoding="utf-8") as file:
        found = list(csv.DictReader(file))
    wrong, right = ([row for row in found if row["wrong"] == kind] for kind in ("yes", "no"))
    named = sum(row["found"] == row["subjects"] for row in wrong)
    quiet = sum(not row["now"] for row in right)
    return (
        f"Of {len(wrong)} mistakes {named} are named on every subject. "
        f"Of {len(right)} right captures {quiet} give no alarm."
    )


def escaped(text: str) -> str:
    """Text of a cell; names with underscores stay as they are."""
    return text if text.startswith("`") else re.sub(r"([|_*])", r"\\\1", text)


SECTIONS: dict[str, Callable[[Path], str]] = {
    "misfits": misfits,
    "wrong-captures": wrong_captures,
    "wrong-files": wrong_files,
    **{f"accuracy-{group}": lambda _, group=group: accuracy(group) for group in rows().get("accuracy", {})},
    **{
        f"performance-{name}": lambda _, name=name: performance(name)
        for name in rows().get("performance", {})
    },
}
