"""What the two recordings say about Live Link Face's rotation channels; driving/axes.py quotes these numbers.

    python -m tests.runtime.driving.axes_evidence

Works on raw channels with its own formulas; nothing of axes.py is used.
"""

from __future__ import annotations

import itertools

import numpy as np

from avatar_export.driving.takes import read_take
from avatar_runtime.driving.arkit import CHANNELS
from tests.runtime.driving.recordings import CSV, UDP, recording

HALF_PUPIL_DISTANCE = 0.0315  # metres


def columns(name: str) -> dict[str, np.ndarray]:
    return dict(zip(CHANNELS, read_take(recording(name)).channels.T, strict=True))


def eye_against_weights(c: dict[str, np.ndarray], channel: str, weights: str) -> dict[str, tuple[float, ...]]:
    """(slope, offset, residual) of an eye's yaw on In - Out and pitch on Down - Up, weights of one side."""
    found = {}
    for angle, plus, minus in (("Yaw", "In", "Out"), ("Pitch", "Down", "Up")):
        x = c[f"eyeLook{plus}{weights}"] - c[f"eyeLook{minus}{weights}"]
        y = c[f"{channel}Eye{angle}"]
        slope, offset = np.polyfit(x, y, 1)
        found[angle] = (float(slope), float(offset), float(np.std(y - offset - slope * x)))
    return found


def listing_error(c: dict[str, np.ndarray], channel: str, roll_sign: int) -> float:
    """Largest |roll - roll of a torsion-free eye| for R = Ry(yaw) Rx(pitch) Rz(roll_sign * roll), radians.

    A rotation about an axis in the XY plane has tan(roll / 2) = tan(yaw / 2) tan(pitch / 2).
    """
    yaw, pitch, roll = (c[f"{channel}Eye{angle}"] for angle in ("Yaw", "Pitch", "Roll"))
    free = 2 * np.arctan(np.tan(yaw / 2) * np.tan(pitch / 2))
    return float(np.abs(roll_sign * roll - free).max())


def gaze_sweep(c: dict[str, np.ndarray], head_against_eye: int) -> float:
    """Standard deviation of head yaw + eye yaw, the head's sign given against the eyes', radians."""
    return float(np.std(head_against_eye * c["headYaw"] + (c["leftEyeYaw"] + c["rightEyeYaw"]) / 2))


def convergence(c: dict[str, np.ndarray]) -> float:
    """How far the subject's left eye (channel rightEye) points further right than the right eye, radians."""
    return float(np.mean(c["rightEyeYaw"] - c["leftEyeYaw"]))


def head_sign_errors(c: dict[str, np.ndarray]) -> dict[tuple[int, int, int], float]:
    """Signs of head (yaw, pitch, roll) about +Y, +X, +Z -> rms error (radians) of the best head on a neck.

    Model: the head turns about a pivot and both eyes look at one point that drifts slowly (cubic in time);
    fitted are the point, the drift and where the eyes are from the pivot. The head trails the eyes by two
    packets (its channels are smoothed).
    """
    eyes = [
        _tangents(c[f"{ch}EyeYaw"], c[f"{ch}EyePitch"]) for ch in ("right", "left")
    ]  # subject's left first
    seen = np.concatenate(eyes, axis=1)[:-4]
    head = [np.roll(c[f"head{angle}"], -2)[:-4] for angle in ("Yaw", "Pitch", "Roll")]
    return {s: _fit(_head(s, *head), seen) for s in itertools.product((1, -1), repeat=3)}


def _tangents(yaw: np.ndarray, pitch: np.ndarray) -> np.ndarray:
    """Gaze (x / z, y / z) [F, 2] in head axes; yaw to the subject's right, pitch down."""
    return np.stack([-np.tan(yaw), -np.tan(pitch) / np.cos(yaw)], axis=1)


def _head(signs: tuple[int, int, int], yaw: np.ndarray, pitch: np.ndarray, roll: np.ndarray) -> np.ndarray:
    def about(axis: int, angle: np.ndarray) -> np.ndarray:
        j, k = (axis + 1) % 3, (axis + 2) % 3
        m = np.tile(np.eye(3), (len(angle), 1, 1))
        m[:, j, j] = m[:, k, k] = np.cos(angle)
        m[:, k, j] = np.sin(angle)
        m[:, j, k] = -np.sin(angle)
        return m

    return about(1, signs[0] * yaw) @ about(0, signs[1] * pitch) @ about(2, signs[2] * roll)


def _fit(head: np.ndarray, seen: np.ndarray) -> float:
    """Levenberg-Marquardt with weak priors on plausible sizes; the rms of gaze tangents."""
    drift = np.polynomial.legendre.legvander(np.linspace(-1, 1, len(head)), 3)
    prior = np.array([0, 0.15, 0.6, *[0.0] * 9, 0.15, 0.1])
    spread = np.array([0.3, 0.3, 0.3, *[0.1] * 9, 0.1, 0.03])

    def error(p: np.ndarray) -> np.ndarray:
        point = np.einsum("nji,nj->ni", head, drift @ p[:12].reshape(4, 3))
        both = [point - np.array([side * HALF_PUPIL_DISTANCE, p[12], p[13]]) for side in (1, -1)]
        return np.concatenate([v[:, :2] / v[:, 2:] for v in both], axis=1) - seen

    def residual(p: np.ndarray) -> np.ndarray:
        return np.concatenate([error(p).ravel() / 0.02, 3 * (p - prior) / spread])

    p, damping = prior.copy(), 1e-3
    r = residual(p)
    for _ in range(40):
        j = np.stack([(residual(p + step) - r) / 1e-5 for step in 1e-5 * np.eye(len(p))], axis=1)
        step = np.linalg.solve(j.T @ j + damping * np.eye(len(p)), -j.T @ r)
        if np.sum(residual(p + step) ** 2) < np.sum(r**2):
            p, damping = p + step, damping / 3
            r = residual(p)
        else:
            damping *= 5
    return float(np.sqrt(np.mean(error(p) ** 2)))


def main() -> None:
    for name in (UDP, CSV):
        c = columns(name)
        print(name)
        for channel, side in itertools.product(("left", "right"), ("Left", "Right")):
            for angle, (slope, offset, rest) in eye_against_weights(c, channel, side).items():
                line = f"{slope:+.4f} w {offset:+.4f}, residual {rest:.5f}"
                print(f"  {channel}Eye{angle:5} on {side:5} weights: {line}")
        print(f"  convergence {convergence(c):+.4f} rad, {2 * HALF_PUPIL_DISTANCE / convergence(c):.2f} m")
        for channel, sign in itertools.product(("left", "right"), (1, -1)):
            print(
                f"  {channel}EyeRoll {sign:+d}: {listing_error(c, channel, sign):.2e} rad off Listing's law"
            )
    c = columns(UDP)
    print(f"gaze in space, head against eyes: {gaze_sweep(c, -1):.3f} rad; with them: {gaze_sweep(c, 1):.3f}")
    for signs, error in sorted(head_sign_errors(c).items(), key=lambda item: item[1]):
        print(f"  head signs {signs}: {error:.4f} rad")


if __name__ == "__main__":
    main()
