"""Synthetic captures: `python -m samples.capture OUT --subject head|body`. Images with known ground truth.

A textured mesh - the scanned head, or the walking man - is drawn frame by frame. Nothing was filmed: the recording
that moves the face is real, the images are computed. The parameters are exact unless
noise is asked for; the images have none.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from samples.capture.body import write_body
from samples.capture.extras import EXTRAS
from samples.capture.head import write_head
from samples.capture.light import write_light
from samples.capture.shots import Noise
from samples.capture.unseen import write_unseen


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m samples.capture", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write into")
    parser.add_argument("--subject", choices=("head", "body"), default="head")
    parser.add_argument("--size", type=int, default=256, help="pixels along an edge of the square images")
    parser.add_argument("--frames", type=int, default=300, help="the last fifth is for testing")
    parser.add_argument(
        "--tracking-noise", type=float, default=0.0, help="deviation of weights and joint rotations (radians)"
    )
    parser.add_argument(
        "--calibration-noise",
        type=float,
        default=0.0,
        help="deviation of the camera: radians, metres, share of focal",
    )
    parser.add_argument(
        "--hold-out",
        default="",
        metavar="NAME,...",
        help="expressions of the head that only test frames show",
    )
    parser.add_argument(
        "--yaw",
        type=float,
        default=40.0,
        metavar="DEGREES",
        help="how far the camera swings about the head; beyond 40 once, in the training part",
    )
    parser.add_argument(
        "--jitter",
        type=int,
        default=0,
        metavar="N",
        help="training frames of the head before the take, each with a random expression and camera",
    )
    parser.add_argument(
        "--close",
        type=int,
        default=0,
        metavar="N",
        help="training frames of the head with random expressions, the camera close to eyes or mouth",
    )
    parser.add_argument(
        "--unseen",
        type=int,
        metavar="N",
        help="instead: the truth of N poses of the head that no sample is trained on, for samples.closeups",
    )
    parser.add_argument(
        "--light",
        action="store_true",
        help="instead: the truth of 10 poses of the head in 12 lights that no sample is trained in, for bench.light",
    )
    parser.add_argument("--shadows", action="store_true", help="of --light: the first light casts shadows")
    for name in EXTRAS:
        parser.add_argument(
            f"--{name}", dest="worn", action="append_const", const=name, help="put on the head; made by code"
        )
    parser.add_argument("--seed", type=int, default=0, help="of the noise")
    given = parser.parse_args()
    noise = Noise(given.tracking_noise, given.calibration_noise, given.seed)
    held_out = tuple(name for name in given.hold_out.split(",") if name)
    worn = tuple(given.worn or ())
    if given.shadows and not given.light:
        parser.error("--shadows is of --light")
    if given.subject == "head" and given.light:
        print(write_light(given.out, given.size, worn, given.shadows))
    elif given.subject == "head" and given.unseen is not None:
        print(write_unseen(given.out, given.size, given.unseen, worn))
    elif given.subject == "head":
        yaw = np.radians(given.yaw)
        more = given.jitter, given.close
        print(write_head(given.out, given.size, given.frames, noise, held_out, yaw, worn, *more))
    elif given.jitter or given.close or given.light or given.unseen is not None:
        parser.error("--jitter, --close, --unseen and --light are of the head")
    elif worn:
        parser.error(f"the body wears no {' and no '.join(worn)}")
    else:
        print(write_body(given.out, given.size, given.frames, noise))


if __name__ == "__main__":
    main()
