"""FLAME and SMPL: body models, identities, tracked poses, and the rigs baked from them."""

from __future__ import annotations

__all__ = ["body_model", "body_rig", "inputs", "pose_files", "subject_files", "tracked_cameras"]
