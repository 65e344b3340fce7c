"""ASM (arXiv 2304.09423), a bone-driven face: its model, its maths and its files."""
