"""Numba kernels of the ASM fits."""
