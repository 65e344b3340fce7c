"""Portable avatars learnt from posed dumps of any code: what drove a dump, and the poses to dump."""
