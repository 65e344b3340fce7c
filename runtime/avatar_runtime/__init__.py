"""Plays a bundle: the one model, the stages, the player. NumPy only."""
