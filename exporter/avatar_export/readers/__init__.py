"""One room per trained system: from its files to an Avatar. The table READERS is in table.py."""

from __future__ import annotations

__all__ = ["bundle", "enhancer_file", "rules_file", "surface", "table"]
