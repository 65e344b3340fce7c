"""People drawn at random, at rest and with a few expressions each, and what MediaPipe says of the pictures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from samples.capture.eyes import lid_shade

from avatar_runtime.rotation import matrix_from_rotvec
from tools.landmark_map.faces import GAZE, ONE_SIDED, Array, Detector, Random, Studio

SEED, SKINS = 0, 12
PICTURES, AT_REST = 60, 5  # of a person
TURN, AT_REST_TURN = (0.45, 0.3, 0.25), (0.05, 0.05, 0.05)  # yaw, pitch, roll at most, radians
FIELDS = ("weights", "rotation", "landmarks", "scores", "matrix")


class Visitors(Studio):
    """People before a webcam: without glasses, in one light and skin a person, the first pictures at rest."""

    picture_number = 0

    def weights(self, rng: Random) -> Array:
        """Weights [51]: none at rest, then one shape, or two to four with gaze; lids and jaw now and then."""
        result = dict.fromkeys(self.names, 0.0)
        number = self.picture_number
        if number >= AT_REST:
            alone = number % 2 == 1
            free = [name for name in self.names if not name.startswith(("eyeLook", "mouthClose"))]
            for name in rng.choice(free, 1 if alone else rng.integers(2, 5), replace=False).tolist():
                result[name] = rng.uniform(0.2, 1)
                other = name.replace("Left", "Right") if "Left" in name else name.replace("Right", "Left")
                if rng.random() < 0.75 and name not in ONE_SIDED:
                    result[other] = result[name]
            if not alone:
                aside, above = rng.normal(size=2) * GAZE
                for side, inwards in (("Left", -aside), ("Right", aside)):
                    for way, angle in (("In", inwards), ("Out", -inwards), ("Up", above), ("Down", -above)):
                        result[f"eyeLook{way}{side}"] = max(angle, 0)
            if number % 3 == 0:
                result["eyeBlinkLeft"] = result["eyeBlinkRight"] = rng.uniform(0.3, 1)
            if number % 5 == 0:
                result["jawOpen"] = rng.uniform(0.2, 1)
                result["mouthClose"] = rng.uniform(0, 1) * result["jawOpen"] * (number % 2)
        return np.clip(list(result.values()), 0, 1)

    def rotation(self, rng: Random) -> Array:
        """camera_from_head [3, 3]."""
        most = AT_REST_TURN if self.picture_number < AT_REST else TURN
        yaw, pitch, roll = rng.uniform(-1, 1, 3) * most
        around = [matrix_from_rotvec(np.array(v)) for v in ((0, 0, roll), (pitch, 0, 0), (0, yaw, 0))]
        result: Array = around[0] @ np.diag([1.0, -1, -1]) @ around[1] @ around[2]
        return result

    def photographed(self, detector: Detector, person: int) -> Iterator[dict[str, Any]]:
        """FIELDS and the picture's number, for each picture in which MediaPipe finds a face."""
        rng = np.random.default_rng([self.seed, 5, person])
        model = self.person(person)
        shade = lid_shade(self.head, model.head)
        for self.picture_number in range(PICTURES):
            look = np.random.default_rng([self.seed, 6, person])  # the same in all pictures
            skin = self.skins[int(look.integers(len(self.skins)))]
            image, truth = self.picture(model, shade, skin, rng, look)
            found = detector(image)
            if found is not None:
                said = dict(zip(("landmarks", "scores", "matrix"), found, strict=True))
                yield {"number": self.picture_number, **{key: truth[key] for key in FIELDS[:2]}, **said}


def drawn(folder: Path, people: int) -> list[dict[str, Array]]:
    """What is known of each person, drawn into `folder` where it is not there yet. Person 0 is a sample: left out."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{number:03d}.npz" for number in range(1, people + 1)]
    if not all(path.exists() for path in paths):
        visitors, detector = Visitors(SKINS, SEED), Detector()
        for path in paths:
            if not path.exists():
                rows = list(visitors.photographed(detector, int(path.stem)))
                np.savez(path, **{key: np.array([row[key] for row in rows]) for key in ("number", *FIELDS)})
    return [dict(np.load(path, allow_pickle=False)) for path in paths]
