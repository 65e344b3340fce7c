"""Files and the errors about them: opening, reading and writing whole files, and whose an error is."""

from __future__ import annotations

from avatar_runtime.io.errors import MemoryShortage, no_such
from avatar_runtime.io.files import open_file
from avatar_runtime.io.ownership import of_file
from avatar_runtime.io.staging import followed, sync_folder
from avatar_runtime.io.text_files import write_text
from avatar_runtime.io.whole_files import read_bytes

__all__ = [
    "MemoryShortage",
    "followed",
    "no_such",
    "of_file",
    "open_file",
    "read_bytes",
    "sync_folder",
    "write_text",
]
