"""Rigs from files (.glb, .fbx, ASM) for the mesh of an avatar, and the matching of their vertices."""
