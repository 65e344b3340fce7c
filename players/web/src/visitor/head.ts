// The head's rotation from MediaPipe's matrix, as the channels headYaw, headPitch and headRoll.

/** Writes the rotation part of a column-major 4x4, without its scale, row-major into `out` [9]. */
export function setRotationOf(matrix: ArrayLike<number>, out: Float64Array): void {
  for (let column = 0; column < 3; column++) {
    const [x, y, z] = [0, 1, 2].map((row) => matrix[4 * column + row] as number) as [number, number, number];
    const length = Math.hypot(x, y, z) || 1;
    out[column] = x / length;
    out[3 + column] = y / length;
    out[6 + column] = z / length;
  }
}

/**
 * Writes yaw, pitch and roll (radians, as Live Link Face has them) of the rotation from `rest` to `now` into
 * channels[at..at+2]. Both are camera_from_head; axes are those of the head: +X its left, +Y up, +Z the face.
 */
export function setAngles(channels: Float32Array, at: number, rest: Float64Array, now: Float64Array): void {
  const m = (row: number, column: number): number => {
    let sum = 0;
    for (let k = 0; k < 9; k += 3) sum += (rest[k + row] as number) * (now[k + column] as number);
    return sum;
  };
  // Ry(yaw) Rx(-pitch) Rz(roll)
  channels[at] = Math.atan2(m(0, 2), m(2, 2));
  channels[at + 1] = Math.asin(Math.min(Math.max(m(1, 2), -1), 1));
  channels[at + 2] = Math.atan2(m(1, 0), m(1, 1));
}
