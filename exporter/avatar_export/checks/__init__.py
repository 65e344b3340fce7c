"""Checks of a bundle: validation, and conformance to its reference."""
