"""Functions from Avatar to Avatar, and measures of an Avatar."""

from __future__ import annotations

__all__ = ["active_sh"]
