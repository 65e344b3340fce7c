"""The commands of avatar-export: arguments in, one library call, printing."""

from __future__ import annotations

__all__ = ["arguments", "batch", "console", "memory", "process", "program"]
