"""Every line of the table."""

from __future__ import annotations

from tests.exporter.fit.wrong import doubtful, known

LINES = (*known.LINES, *doubtful.LINES)
