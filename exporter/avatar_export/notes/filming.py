"""What is said of a film of a face, and how to film again."""

from __future__ import annotations

from collections.abc import Callable, Mapping

TEXTS: Mapping[str, str | Callable[..., str]] = {
    "film_hdr": "the film is HDR ({transfer}): its colours are converted, and reading takes longer; film with HDR off "
    "for true colours",
    "film_uneven": "the film's frames have unequal lengths, {fps:.3g} a second in the mean: for each moment the "
    "nearest one is taken",
    "film_part": "of the film's {seconds:.0f} seconds, those from {first:g} to {last:g} are read; --first and --last "
    "choose others",
    "film_no_face": "a face was found in {count} of {frames} frames: film one face from the front, in good light",
    "film_still": "nothing moves: it is a still picture; film the face for 30 seconds, talking and turning",
    "film_sideways": "the face is not upright, it leans {leans:.0f} degrees clockwise: pass --rotation {rotation}",
    "film_gaps": "{share:.0%} of the frames show no face: keep hands and hair away, and the face in the picture",
    "film_faces": "{share:.0%} of the frames show several faces; the largest is taken: film one person alone, or pass "
    "--crop",
    "film_small": "the face is {pixels:.0f} pixels high, less than {least:g}: come nearer, so that it fills half of "
    "the picture's height, or film in 1080p",
    "film_turns": "the head turns {left:.0f} degrees to its left and {right:.0f} to its right: turn it slowly by 30 to "
    "each side, else the sides stay guessed",
    "film_edge": "{share:.0%} of the frames cut off a part of the face: keep the whole head in the picture, with room "
    "around it",
    "film_expressions": "never seen: {names:listed}; they will be guessed: make each once, slowly",
    "film_lids": "closed eyes were never seen, so the lids will not close well: close both eyes for a second, twice",
    "film_cuts": "the film is cut, at second {seconds:some}: film in one piece, or choose a piece by --first "
    "and --last",
    "film_blur": "{share:.0%} of the frames are blurred by movement: move slowly, in more light",
    "film_soft": "the face is out of focus in most frames: tap on it before filming, clean the lens, use more light",
    "film_light": "the light on the face changes by {change:.0%}: film in even light, away from screens, with exposure "
    "locked",
}
