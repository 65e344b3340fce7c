"""The GPU program of an avatar: buffers, and the kernels that run over them. Players walk it; none knows a system."""
