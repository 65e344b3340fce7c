"""Reads trained avatars, writes bundles."""
