"""The runtime's stages on tensors, differentiable: each has the name, the inputs and the outputs of its NumPy twin."""
