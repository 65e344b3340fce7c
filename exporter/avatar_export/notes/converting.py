"""What a conversion says of an avatar and of the files that it wrote; also of those that drop and publish leave."""

from __future__ import annotations

from collections.abc import Callable, Mapping

FOUR_JOINTS = "three.js and both glTF importers of Unity"  # that ignore JOINTS_1: docs/engines
CAUSES = {  # of a rig.glb that differs from the runtime's mesh, by the key of the manifest's `engine`
    "truncation_mm": "{influences} joints a vertex are too few",
    "late_morph_mm": "engines move the eyelids before the skeleton",
    "shear_mm": "nodes of glTF cannot shear",
}


def _rig_differs(cause: str, more: int | None, **_: object) -> str:
    text = f"rig.glb differs from the runtime's mesh by up to {{mm:.2g}} mm, since {CAUSES[cause]}"
    if cause != "truncation_mm":
        return text
    if more is None:
        return f"{text}; rig.usdc keeps all"
    return f"{text}; --influences {{more}} gives more, but {FOUR_JOINTS} ignore the second four; rig.usdc keeps all"


TEXTS: Mapping[str, str | Callable[..., str]] = {
    "unstated": "no file of the checkpoint and no option says {settings:unstated}; wrong values change the size and "
    "the look: pass --units and --mesh-scaling or --no-mesh-scaling as in the training",
    "rows_dropped": "{count} rows with a NaN or infinity were dropped; avatar.json lists them",
    "no_rig": "no rig: only expressions move; joints and teeth do not",
    "not_driven": "ARKit cannot drive this avatar yet; pass --driving FILE with a matrix from the ARKit names",
    "jaw_not_driven": "the jaw is a joint ({joint}), which ARKit names cannot rotate without a driving matrix, so "
    "jawOpen only moves the skin; pass --driving FILE with rows joint/jaw/x if this avatar was trained with a "
    "rotating jaw",
    "rig_differs": _rig_differs,
    "groups": "Gaussians by group: {groups:listed}",
    "files": "files read: {files:listed}",
    "no_licence": "{avatar}: no licence is stated; {option} states one",
    "not_stated": 'the page says "not stated" of consent or licence; run the same command again with {options:listed}',
    "changed_since": "{path} was changed after it was {verb} and stays as it is; {cure}",
    "large_page": "mail and chats may refuse so large a file; `pack --max-bytes` makes it smaller",
}
