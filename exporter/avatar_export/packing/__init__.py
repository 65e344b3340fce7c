"""Packs: an avatar in one small file that holds its own GPU program, with a measured error."""
