"""The conformance kit: inputs and outputs of every stage, reference vectors, and how backends and ports are judged."""

from __future__ import annotations

from avatar_runtime.conformance.arrays import STAGE_ARRAYS
from avatar_runtime.conformance.files import decode, encode
from avatar_runtime.conformance.make import RUNTIME, Maker, make_reference
from avatar_runtime.conformance.model import Case, CaseVectors, Expected, Reference, Step, View
from avatar_runtime.conformance.run import ImageRow, Report, Row, conform, conform_outputs

__all__ = [
    "RUNTIME",
    "STAGE_ARRAYS",
    "Case",
    "CaseVectors",
    "Expected",
    "ImageRow",
    "Maker",
    "Reference",
    "Report",
    "Row",
    "Step",
    "View",
    "conform",
    "conform_outputs",
    "decode",
    "encode",
    "make_reference",
]
