"""What clips and recordings move that an avatar lacks, what they lack themselves, and what looks wrong in them."""

from __future__ import annotations

TEXTS = {
    "no_counterpart": "{names:many} {part} of the clip have no counterpart in this avatar: {names:some}",
    "rotations_alone": "{names:many} joints of the clip also move against their parents, which bones of another length "
    "do not: only their rotations are taken ({names:some})",
    "of_avatar": "{avatar}: {what:note}",
    "clip_chosen": "clip {name!r} of {clips:listed}",
    "percent": "{what}: {name} is {value:.4g} in frame {frame}: are the weights percent? Divide them by 100: 1 is the "
    "whole shape",
    "degrees": "{what}: {name} is {value:.4g} in frame {frame}: are the angles degrees? They are radians",
    "gaps": "gaps in {file}: {count}, the first {step:.3g} s long, {after:.3g} s after the begin; what follows plays "
    "early, by {lost:.3g} s in the end",
    "without_face": "frames of {file} without a face are left out: {count}",
    "names_missing": "{file} lacks {names:many} of the {of} ARKit names, which stay 0: {names:some}",
    "unmoved": "this avatar has nothing that {names:listed} moves",
    "channels_unused": "{names:many} of the {count} ARKit names move nothing of this avatar: {names:listed}",
}
