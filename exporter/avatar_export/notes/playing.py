"""What clips and recordings move that an avatar lacks."""

from __future__ import annotations

TEXTS = {
    "no_counterpart": "{names:many} {part} of the clip have no counterpart in this avatar: {names:some}",
    "rotations_alone": "{names:many} joints of the clip also move against their parents, which bones of another length "
    "do not: only their rotations are taken ({names:some})",
    "of_avatar": "{avatar}: {what:note}",
    "clip_chosen": "clip {name!r} of {clips:listed}",
    "channels_unused": "{names:many} of the {count} ARKit names move nothing of this avatar: {names:listed}",
}
