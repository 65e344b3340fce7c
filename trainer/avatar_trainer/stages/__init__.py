"""The runtime's stages on tensors, differentiable: each has the name, the inputs and the outputs of its NumPy twin.

Stage `joints` and the transforms of groups (anchor, joint_mix) need no gradient and are the runtime's own.
"""
