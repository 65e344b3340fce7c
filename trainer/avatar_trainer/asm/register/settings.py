"""Settings of fitting ASM faces to scans."""

from __future__ import annotations

from dataclasses import dataclass

from avatar_trainer.asm.model import VARIANTS
from avatar_trainer.settings import MOST, MOST_ITERATIONS, expect_ranges


@dataclass(frozen=True)
class RegisterSettings:
    """How a face is fitted to scans; ValueError for a value out of range.

    Lengths are measured as the paper's numbers suggest: translations of bones, whose step and whose term of Eq. 19
    are written without a unit, in decimetres (a step of 1e-3 is 0.1 mm, 300 steps reach 3 cm; in metres 300 steps
    of 1 mm would shake the face, in millimetres they would reach 0.3 mm); zeta and mu in tenths of the uv plane for
    the same reason, as a component is some hundredths wide; distances in millimetres.
    """

    variant: str = "full"  # VARIANTS: what is fitted
    iterations: int = 300  # paper, section 4.1
    learning_rate: float = 1e-3  # paper, section 4.1
    # The energy is the mean squared distance in mm^2 + `prior` times Eq. 19; the paper leaves this weight open.
    prior: float = 1e-3
    # Weight of `strain_energy`, against folds; the paper only says that it adds "regularization to avoid model
    # artifacts".
    smooth: float = 10.0
    # Points of a scan with triangles count where the cosine of its normal and the face's is above this.
    facing: float = 0.5
    lambda_pose: float = 1.0  # Eq. 19, lambda_1 to lambda_5
    lambda_zeta: float = 0.1
    lambda_pi: float = 0.1
    lambda_mu: float = 0.1
    lambda_sigma: float = 0.1
    first_cap_mm: float = 30.0  # a point farther away does not pull: hair, clothes, parts that the mesh lacks
    last_cap_mm: float = 10.0  # reached half way
    widened: float = 1.1  # radius of the part of a scan that is fitted, in radii of the facial region
    similarity: bool = False  # whether the scan's unit is unknown and found by the keypoints
    placed: bool = False  # whether the scans stand in the template's space, and stay there
    seed: int = 0  # of the variant random_weights

    def __post_init__(self) -> None:
        if self.variant not in VARIANTS:
            raise ValueError(f"variant {self.variant!r} is not one of {', '.join(VARIANTS)}")
        weights = dict.fromkeys(
            ("prior", "smooth", "lambda_pose", "lambda_zeta", "lambda_pi", "lambda_mu", "lambda_sigma"),
            (0.0, 1e6),
        )
        caps = dict.fromkeys(("first_cap_mm", "last_cap_mm"), (1e-3, 1e6))
        rest = {
            "iterations": (1, MOST_ITERATIONS),
            "learning_rate": (1e-9, 1.0),
            "facing": (-1.0, 1.0),
            "widened": (0.1, 100.0),
            "seed": (0, MOST),
        }
        expect_ranges(self, {**weights, **caps, **rest})
