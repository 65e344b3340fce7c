"""3D Gaussian Blendshapes (arXiv 2404.19398) as a trainable system."""
