"""Godot on this machine: gets the engine, builds the add-on's libraries and its table of functions."""

from __future__ import annotations

VERSION = "4.6.3"  # that the add-on is tested with, and the oldest that it says it needs
