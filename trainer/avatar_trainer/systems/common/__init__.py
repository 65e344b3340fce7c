"""Shared by several systems: first points on a mesh, and rigid placement."""
