"""Packs of both handednesses, by every player."""
