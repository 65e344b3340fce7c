"""The two real recordings of Live Link Face."""

from __future__ import annotations

from pathlib import Path

from tests.shared_data import ROOT, shared

CSV = "live_link_face_rom_300.csv"
UDP = "live_link_face_udp.gesichter"


def recording(name: str) -> Path:
    """The committed sample if it is there, else the optional test data's copy (or a skip)."""
    sample = ROOT / "samples" / "drive" / name
    return sample if sample.exists() else shared(f"drive/{name}")
