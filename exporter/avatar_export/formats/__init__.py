"""From bytes to arrays: file formats that know nothing of a trained system. All files are untrusted."""

from __future__ import annotations

__all__ = ["mesh_files", "npy", "pth"]
