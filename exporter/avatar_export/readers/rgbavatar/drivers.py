"""What drives the bases of RGBAvatar: 129 values of FLAME, and what an expression or a joint adds to each weight.

The values: 100 expressions; the first two rows of the rotations of neck, jaw, left eye, right eye; two eyelids, left
first; the head's translation. Source: dataset/flame_dataset.py of 27c2ba8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_export.readers.rgbavatar.files import Network
from avatar_runtime.avatar import F32, F64

EXPRESSIONS, JOINTS, ROWS = 100, 4, 6  # joints 1..4 of FLAME, six entries of each rotation
EYELIDS = EXPRESSIONS + JOINTS * ROWS  # column of the left one
VALUES = EYELIDS + 2 + 3
FEATURES = 9  # entries of R - I of a joint


@dataclass(frozen=True)
class Map:
    """The network, and the expressions of the avatar: `expressions` of FLAME, `eyelids`, then others up to `total`."""

    network: Network
    expressions: int
    eyelids: int
    total: int

    def values(self, expressions: F64 | F32, turns: F64, eyelids: F64, translation: F64) -> F64:
        """[T, inputs] of expressions [T, E], rotations [T, 5, 3, 3], eyelids [T, 2] and translations [T, 3]."""
        values = np.zeros((len(expressions), VALUES))
        count = min(EXPRESSIONS, expressions.shape[1])
        values[:, :count] = expressions[:, :count]
        values[:, EXPRESSIONS:EYELIDS] = turns[:, 1:, :2].reshape(len(values), JOINTS * ROWS)
        values[:, EYELIDS : EYELIDS + 2] = eyelids
        values[:, EYELIDS + 2 :] = translation
        return values[:, : self.network.inputs]

    def at_rest(self) -> F64:
        """[K] the weights of the bases where every expression is 0 and no joint turns."""
        still = np.tile(np.eye(3), (1, 1 + JOINTS, 1, 1))
        values = self.values(np.zeros((1, 0)), still, np.zeros((1, 2)), np.zeros((1, 3)))
        result: F64 = self.network.weights(values)[0]
        return result

    def of_expressions(self) -> F64:
        """[total, K] what a weight of 1 of each expression of the avatar adds to the weights of the bases."""
        bases = len(self.at_rest())
        result = np.zeros((self.total, bases))
        if not self.network.linear:
            result[self.total - bases :] = np.eye(bases)
            return result
        slope = self._slope()
        count = min(EXPRESSIONS, self.expressions)
        result[:count] = slope[:count]
        lids = slice(self.expressions, self.expressions + self.eyelids)
        result[lids] = slope[EYELIDS : EYELIDS + self.eyelids]
        return result

    def of_pose_features(self) -> F64:
        """[36, K] what each entry of R - I of the four joints adds to the weights of the bases."""
        result = np.zeros((JOINTS, FEATURES, len(self.at_rest())))
        if self.network.linear:
            result[:, :ROWS] = self._slope()[EXPRESSIONS:EYELIDS].reshape(JOINTS, ROWS, -1)
        return result.reshape(JOINTS * FEATURES, -1)

    def _slope(self) -> F64:
        """[VALUES, K] of a linear network; inputs that it does not take have no effect."""
        weight = self.network.layers[0][0]
        result = np.zeros((VALUES, len(weight)))
        result[: self.network.inputs] = weight.T
        return result
