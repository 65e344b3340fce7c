"""Checks of the one model; each raises AvatarError that names the field."""
