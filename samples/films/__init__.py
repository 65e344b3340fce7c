"""Rendered films of heads that no tracker saw, with the truth of every frame."""
