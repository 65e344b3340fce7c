"""The verdict on a whole capture: what stops a training, and what is odd."""

from __future__ import annotations

from dataclasses import dataclass

from avatar_runtime import AvatarError
from avatar_trainer.captures.checks import fit, motion
from avatar_trainer.captures.model import Capture

ACCEPT = "--accept-misfit"
LOOK = "look at the overlays that `avatar-train check CAPTURE --pictures OUT` writes"


@dataclass(frozen=True)
class Verdict:
    """What is wrong with a capture that can be read."""

    wrong: tuple[tuple[str, str], ...]  # (field, why training would spoil the avatar)
    odd: tuple[str, ...]  # worth a look; no reason to refuse

    def refuse(self, capture: Capture) -> None:
        """Raise AvatarError for the first thing that is wrong."""
        for field, why in self.wrong:
            raise AvatarError(
                f"{why}. If they are right, pass {ACCEPT} to the training", file=capture.folder, field=field
            )


def judge(capture: Capture) -> Verdict:
    """The verdict on `capture`; its images are looked at only if its numbers can be right.

    Raises AvatarError for an image that cannot be read.
    """
    odd = [f"the body {text}"] if (text := motion.size(capture)) else []
    if wrong := tuple(motion.impossible(capture)):
        return Verdict(wrong, tuple(odd))
    fits = fit.measured(capture)
    better = fit.misfit(fits)
    if better is not None:
        return Verdict(((better.reading.part, str(better)),), tuple(odd))
    if fit.lost(fits):
        odd.append(
            f"{fits[0].overlap.inside:.0%} of the mesh's silhouette lies inside the masks, and no usual convention "
            f"mends it; {LOOK}"
        )
    return Verdict((), tuple(odd))
