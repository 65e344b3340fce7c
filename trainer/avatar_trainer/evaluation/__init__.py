"""Measures of a trained avatar: against held-out frames, and against the bundle made of it."""
