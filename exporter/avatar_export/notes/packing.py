"""What the packing says of a pack, and of the levels that it leaves out."""

from __future__ import annotations

from collections.abc import Callable, Mapping

CURES = {  # by the choice that made the picture poor
    "max_bytes": "raise --max-bytes, or pass --min-psnr 50 in its place",
    "min_psnr": "raise --min-psnr, or leave it out",
    "sh_degree": "leave out --sh-degree, or raise it",
    "exact": "--exact keeps every number",
}


def _poor(cure: str, **_: object) -> str:
    figures = (
        "mean {mean:.1f} dB, worst {worst:.1f} dB {region}; good ones have {least:g} and {lowest:g} or more"
    )
    return f"the picture is poor: {figures}; {CURES[cure]}"


TEXTS: Mapping[str, str | Callable[..., str]] = {
    "poor_picture": _poor,
    "floor": "parts that no step makes smaller: {parts:kilobytes}; at least {bytes} bytes in all",
    "level_unlike": "the level of {count} Gaussians is left out: it looks different from full detail wherever the "
    "avatar is above {least} pixels high",
    "level_served": "the level of {count} Gaussians is left out: a coarser one serves up to the same height, {height} "
    "pixels",
    "nothing_nearer": "nothing that was tried comes nearer to what was asked for",
    "short_of_aims": "the pack falls short of its aims, {aims}: nothing that was tried comes nearer",
    "tried": "{count} packs were tried",
    "steps": "finest against the usual steps: {finest} (times {fine:.3g}); coarsest: {coarsest} (times {coarse:.3g})",
    "degree_lowered": "spherical harmonics of degree {degree} instead of {before}",
    "gaussians_merged": "{count} of {before} Gaussians",
    "no_enhancer": "the enhancer does not go into packs; the bundle has it",
}
