"""The table of trainable tensors, its optimiser, and density control."""
