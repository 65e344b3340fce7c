"""Avatars put into the projects of engines."""
