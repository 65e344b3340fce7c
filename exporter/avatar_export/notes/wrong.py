"""What is said of files that are readable and probably wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping


def _reordered(order: str | None, **_: object) -> str:
    what = (
        "triangle numbers are {step:+d} off"
        if order is None
        else "weights stand in the order {order} of the corners"
    )
    return f"{what}: so {{share:.0%}} of the Gaussians would lie where x y z of {{cloud}} say; look at the embedding"


TEXTS: Mapping[str, str | Callable[..., str]] = {
    "scales_wide": "{share:.0%} of the Gaussians are too wide for the avatar{cause:also}",
    "scales_are_lengths": "their scales seem to be lengths: write the logarithm, ln(scale)",
    "scales_unit": "their scales seem to be in {unit}: take ln {factor:.4g} from them",
    "opacities_not_logits": "opacities of {share:.0%} of the Gaussians lie in 0..1 and seem to be no logits: write "
    "ln(o / (1 - o))",
    "opacities_negated": "opacities seem to have the other sign: what should be opaque is transparent",
    "colours_bright": "the colours (f_dc) of {share:.0%} of the Gaussians are far brighter than white or darker than "
    "black{cause:also}",
    "colours_are_bytes": "they seem to be RGB 0..255: write (c / 255 - 0.5) / 0.28209",
    "colours_are_rgb": "the colours (f_dc) of {share:.0%} of the Gaussians seem to be RGB 0..1, not SH: write "
    "(c - 0.5) / 0.28209",
    "rotations_zero": "the rotations of {share:.1%} of the Gaussians are zero: write 1, 0, 0, 0 where nothing turns",
    "clip_percent": "clip {clip}: {name} goes up to {most:.3g}: are the weights percent? 1 is the whole expression",
    "names_of_sides": "{names:some} move {what} on another side than their names tell: are left and right, or two "
    "expressions, exchanged? Left is +X",
    "names_of_places": "{names:some} move {what} elsewhere than their names tell: are names or deltas exchanged? Brows "
    "lie above eyes, eyes above the mouth",
    "names_of_ways": "{names:some} move {what} up for down, or down for up: are names or deltas exchanged?",
    "eyelids_still": "the deltas of {names:some} are all zero: eyes never close",
    "embedding_reordered": _reordered,
    "regressor_shifted": "the columns of the joint regressor of {file} seem to be shifted by {by} ({who}): vertices "
    "that carry a joint are no neighbours",
}
