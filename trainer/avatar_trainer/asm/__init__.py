"""ASM: bone-driven faces (arXiv 2304.09423), fitted to scans and to images. Not a system of the training loop."""
