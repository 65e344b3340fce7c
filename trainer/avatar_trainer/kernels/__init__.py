"""The work of a training iteration on the CPU as Numba kernels with gradients: fast twins of plain definitions.

float32. A row is computed by one thread in the order stored: the same bits whatever the number of threads.
"""

from __future__ import annotations

from avatar_trainer.kernels.blend import blend_cpu
from avatar_trainer.kernels.skin import skinned_cpu
from avatar_trainer.kernels.ssim import ssim_cpu
from avatar_trainer.kernels.surface import embedded_cpu, pose_mesh_cpu

__all__ = ["blend_cpu", "embedded_cpu", "pose_mesh_cpu", "skinned_cpu", "ssim_cpu"]
