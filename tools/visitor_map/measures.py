"""What a page measures of a face, as the page's face_reader.ts does: scores, and points in the head's axes.

Points are centred on the stable ones, whose mean distance from there is 1. What is left of them beside the motion of a
rigid face says what the face does.
"""

from __future__ import annotations

import numpy as np

from tools.landmark_map.faces import Array

# Points that the face's muscles hardly move: bridge and tip of the nose, corners of the eyes, temples, forehead.
STABLE = (
    *(
        6,
        168,
        197,
        195,
        5,
        4,
        1,
        33,
        133,
        362,
        263,
        127,
        356,
        234,
        454,
        10,
        151,
        9,
        8,
        108,
        337,
        67,
        297,
        54,
        284,
    ),
    *(21, 251, 162, 389, 98, 327, 48, 278, 129, 358),
)
LIPS = (
    *(61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291, 185, 40, 39, 37, 0, 267, 269, 270, 409),
    *(78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308, 191, 80, 81, 82, 13, 312, 311, 310, 415),
)
BROWS = (70, 63, 105, 66, 107, 46, 53, 52, 65, 55, 300, 293, 334, 296, 336, 276, 283, 282, 295, 285)
LIDS = (33, 160, 158, 133, 153, 144, 159, 145, 362, 385, 387, 263, 373, 380, 386, 374)
NOSE = (129, 358, 48, 278, 98, 327, 2, 164)
CHEEKS = (50, 280, 205, 425, 187, 411, 207, 427, 117, 346)
CHIN = (152, 148, 377, 176, 400, 136, 365, 18, 200, 199)
LANDMARKS = tuple(dict.fromkeys((*STABLE, *LIPS, *BROWS, *LIDS, *NOSE, *CHEEKS, *CHIN)))
DEPTH = 0.3  # how much z counts beside x and y


def points(landmarks: Array, matrix: Array) -> Array:
    """[N, L, 3] of MediaPipe's landmarks [N, 478, 3] in pixels and matrices [N, 4, 4]."""
    rotation = matrix[:, :3, :3] / np.linalg.norm(matrix[:, :3, :3], axis=1, keepdims=True)
    seen = landmarks[:, LANDMARKS] * (1, -1, -1)
    own = np.einsum("nlr,nra->nla", seen, rotation)
    stable = [LANDMARKS.index(landmark) for landmark in STABLE]
    own = own - own[:, stable].mean(axis=1, keepdims=True)
    result: Array = own / np.linalg.norm(own[:, stable], axis=2).mean(axis=1)[:, None, None]
    return result


def left(seen: Array, rest: Array) -> Array:
    """[N, 2 L + 3]: points [N, L, 3] less the rigid motion that brings those at rest [L, 3] nearest to the stable ones.

    The last three are that motion's turn about x, y, z, radians.
    """
    moves = np.zeros((len(rest), 3, 7))
    moves[..., 0] = rest
    moves[:, (0, 1, 2), (1, 2, 3)] = 1
    x, y, z = rest.T
    for column, axis, value in ((4, 1, -z), (4, 2, y), (5, 0, z), (5, 2, -x), (6, 0, -y), (6, 1, x)):
        moves[:, axis, column] = value
    stable = [LANDMARKS.index(landmark) for landmark in STABLE]
    weight = np.array((1, 1, DEPTH))[:, None]
    fitted = np.linalg.pinv((moves[stable] * weight).reshape(-1, 7))
    away = seen - rest
    motion = (away[:, stable] * weight[:, 0]).reshape(len(seen), -1) @ fitted.T
    still = (away - np.einsum("lau,nu->nla", moves, motion))[..., :2].reshape(len(seen), -1)
    return np.concatenate([still, motion[:, 4:]], axis=1)


def features(landmarks: Array, scores: Array, matrix: Array, at_rest: Array) -> Array:
    """[N, 52 + 2 L + 3] of one person's pictures; `at_rest`: which of them show the neutral face."""
    seen = points(landmarks, matrix)
    face = left(seen, np.median(seen[at_rest], axis=0))
    return np.concatenate([scores - np.median(scores[at_rest], axis=0), face], axis=1)


def angles(rotation: Array) -> Array:
    """[N, 3] yaw, pitch and roll as Live Link Face has them, of rotations [N, 3, 3] in the head's axes."""
    pitch = np.arcsin(np.clip(rotation[:, 1, 2], -1, 1))
    yaw, roll = (
        np.arctan2(rotation[:, a, b], rotation[:, c, d]) for a, b, c, d in ((0, 2, 2, 2), (1, 0, 1, 1))
    )
    return np.stack([yaw, pitch, roll], axis=1)


def too_little(matrix: Array, rotation: Array, at_rest: Array) -> Array:
    """[N, 3] true less seen angles of MediaPipe's matrices [N, 4, 4]; true `rotation` [N, 3, 3], OpenCV's."""
    seen = matrix[:, :3, :3] / np.linalg.norm(matrix[:, :3, :3], axis=1, keepdims=True)
    true = np.diag([1.0, -1, -1]) @ rotation
    found = []
    for turn, rest in ((true, true[at_rest]), (seen, seen[at_rest])):
        u, _, vt = np.linalg.svd(rest.mean(axis=0))
        found.append(angles(np.einsum("ba,nbc->nac", u @ vt, turn)))
    result: Array = found[0] - found[1]
    return result
