"""What a comparison with a reference did not compare, and how far the two raster profiles differ."""

from __future__ import annotations

from collections.abc import Callable, Mapping


def _skipped(backend: str | None, **_: object) -> str:
    why = "not given" if backend is None else "backend {backend} does not draw"
    return f"{why}, so skipped: {{stages}}"


def _profiles(expected: float | None, **_: object) -> str:
    short = "" if expected is None else ", less than the expected {expected:g}"
    return f"case {{case}}: profile engine against trainer {{db:.1f}} dB{short}"


TEXTS: Mapping[str, str | Callable[..., str]] = {
    "skipped": _skipped,
    "no_images": "images are not compared where outputs are given",
    "profiles_same": "case {case}: the profiles engine and trainer draw the same image",
    "profiles_differ": _profiles,
}
