"""The reader of 3D Gaussian Blendshapes."""
