"""Which array of an avatar lies in which section of which packed buffer, once for writing and for reading."""

from __future__ import annotations

from collections.abc import Mapping

# attribute of SparseRows -> (section, kind of codes)
GEOMETRY = {"mean": ("geometry_mean", "signed"), "quat_wxyz": ("geometry_quat", "signed")}
APPEARANCE = {
    "log_scale": ("appearance_log_scale", "signed"),
    "opacity_logit": ("appearance_opacity", "signed"),
    "sh": ("appearance_sh", "signed"),
}
CORRECTIVE = {"mean": ("corrective_mean", "signed")}
LATE = {"mean": ("late_mean", "signed")}
SKIN = {"weight": ("skin_weight", "weight")}
MORPH = {"position": ("morph_position", "signed")}
VERTEX_CORRECTIVE = {"position": ("corrective_position", "signed")}
VERTEX_LATE = {"position": ("late_position", "signed")}

# section -> (path in the Avatar, kind of codes)
BASE: Mapping[str, tuple[str, str]] = {
    "base_mean": ("gaussians.mean", "linear"),
    "base_log_scale": ("gaussians.log_scale", "linear"),
    "base_quat": ("gaussians.quat_wxyz", "linear"),
    "base_opacity": ("gaussians.opacity_logit", "table"),
    "base_sh": ("gaussians.sh", "linear"),
}
LIT: Mapping[str, tuple[str, str]] = {"normal": ("relight.normal", "linear")}
EMBEDDED: Mapping[str, tuple[str, str]] = {
    "barycentric": ("embedding.barycentric", "linear"),
    "displacement": ("embedding.displacement", "linear"),
    "local_offset": ("embedding.local_offset", "linear"),
    "local_quat": ("embedding.local_quat_wxyz", "linear"),
}
