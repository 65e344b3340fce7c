"""The conformance kit: inputs and outputs of every stage, reference vectors, and how backends and ports are judged."""

from __future__ import annotations

from avatar_runtime.conformance.arrays import STAGE_ARRAYS
from avatar_runtime.conformance.driving import conform_driving, conform_driving_outputs, driving_cases
from avatar_runtime.conformance.driving_files import decode_driving, encode_driving
from avatar_runtime.conformance.files import decode, encode
from avatar_runtime.conformance.make import RUNTIME, Maker, make_reference
from avatar_runtime.conformance.model import (
    Case,
    CaseVectors,
    DrivingCase,
    DrivingReference,
    Expected,
    Reference,
    Step,
    View,
)
from avatar_runtime.conformance.run import ImageRow, Report, Row, conform, conform_outputs

__all__ = [
    "RUNTIME",
    "STAGE_ARRAYS",
    "Case",
    "CaseVectors",
    "DrivingCase",
    "DrivingReference",
    "Expected",
    "ImageRow",
    "Maker",
    "Reference",
    "Report",
    "Row",
    "Step",
    "View",
    "conform",
    "conform_driving",
    "conform_driving_outputs",
    "conform_outputs",
    "decode",
    "decode_driving",
    "driving_cases",
    "encode",
    "encode_driving",
    "images",
    "make_reference",
]
