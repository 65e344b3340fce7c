"""From one Avatar to the files of a bundle: the table WRITERS, a file for each, and `bundle`, which writes all."""

from __future__ import annotations

__all__ = ["bundle"]
