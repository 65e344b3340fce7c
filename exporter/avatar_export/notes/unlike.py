"""What is said of an avatar whose statistics are not those of a trained one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

FORMS = {
    "xyzw": "seem to be in the order x, y, z, w: write w first",
    "conjugated": "seem to be of the inverse rotations: negate x, y, z",
    None: "are other ones than those of the embedding",
}


def _quaternions(form: str, whole: bool, **_: object) -> str:
    return f"{'' if whole else 'some '}quaternions {FORMS[form]}"


def _hue(order: Sequence[str], share: float, **_: object) -> str:
    read = f"read as {', '.join(order)}, {{share:.0%}} of the Gaussians would have the hue of skin"
    return f"the channels of colours seem to be exchanged: {read}"


def _mirrored(axes: str, **_: object) -> str:
    what = (
        "offsets seem to have the other sign"
        if axes == "all"
        else "{axes} of offsets seems to have the other sign"
    )
    return f"{what}: the surface that they lead to is smoother then, or of neighbours more alike"


TEXTS: Mapping[str, str | Callable[..., str]] = {
    "quaternions": _quaternions,
    "stored_quaternions": lambda form, **_: "{share:.0%} of the rotations in {cloud} " + FORMS[form],
    "stored_elsewhere": "{share:.0%} of the Gaussians lie elsewhere in {cloud}, turned alike: are rows of the "
    "embedding exchanged?",
    "displacement_mirrored": "the Gaussians of {cloud} lie on the other side of the mesh ({share:.0%} of those that "
    "differ): displacements seem to have the other sign",
    "unlike_neighbours": "{what} of neighbours are not alike (correlation {own:.2f}, other properties {others:.2f} or "
    "more): are their rows exchanged?",
    "transparent": "{share:.0%} of the Gaussians are transparent",
    "other_hue": _hue,
    "offsets_scattered": "{axis} of the offsets of neighbours differs as that of any two: are rows or signs exchanged?",
    "offsets_mirrored": _mirrored,
    "images_missing": "{file} goes from image {last} to image {next}: are frames missing?",
    "clip_gaps": "clip {clip} does not move after frame {frame} as before: are frames missing?",
}
