"""Trains avatars made of 3D Gaussians from captured frames, and exports them."""
