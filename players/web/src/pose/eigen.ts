const MOST_SWEEPS = 32;

/**
 * Jacobi's method on a symmetric matrix [n, n], in place: its diagonal becomes the eigenvalues, the rows of
 * `vectors` [n, n] the eigenvectors, of unit length. Returns the index of the largest eigenvalue. No allocation.
 */
export function eigen(m: Float64Array, vectors: Float64Array, n: number): number {
  for (let i = 0; i < n * n; i++) vectors[i] = i % (n + 1) === 0 ? 1 : 0;
  for (let sweep = 0; sweep < MOST_SWEEPS && offDiagonal(m, n) > 0; sweep++) {
    for (let p = 0; p < n; p++) {
      for (let q = p + 1; q < n; q++) rotate(m, vectors, n, p, q);
    }
  }
  let best = 0;
  for (let i = 1; i < n; i++) best = (m[i * (n + 1)] as number) > (m[best * (n + 1)] as number) ? i : best;
  return best;
}

/** The sum of sizes off the diagonal; 0 where they do not count beside the diagonal. */
function offDiagonal(m: Float64Array, n: number): number {
  let off = 0, on = 0;
  for (let p = 0; p < n; p++) {
    on += Math.abs(m[p * (n + 1)] as number);
    for (let q = p + 1; q < n; q++) off += Math.abs(m[p * n + q] as number);
  }
  return off <= Number.EPSILON * Number.EPSILON * on ? 0 : off;
}

/** Turns axes p and q so that m[p, q] becomes 0. */
function rotate(m: Float64Array, vectors: Float64Array, n: number, p: number, q: number): void {
  const off = m[p * n + q] as number;
  if (off === 0) return;
  const half = ((m[q * (n + 1)] as number) - (m[p * (n + 1)] as number)) / (2 * off);
  const tangent = (half < 0 ? -1 : 1) / (Math.abs(half) + Math.sqrt(half * half + 1));
  const cosine = 1 / Math.sqrt(tangent * tangent + 1);
  const sine = tangent * cosine;
  for (let k = 0; k < n; k++) {
    const a = m[k * n + p] as number, b = m[k * n + q] as number;
    m[k * n + p] = cosine * a - sine * b;
    m[k * n + q] = sine * a + cosine * b;
  }
  for (let k = 0; k < n; k++) {
    const a = m[p * n + k] as number, b = m[q * n + k] as number;
    m[p * n + k] = cosine * a - sine * b;
    m[q * n + k] = sine * a + cosine * b;
    const c = vectors[p * n + k] as number, d = vectors[q * n + k] as number;
    vectors[p * n + k] = cosine * c - sine * d;
    vectors[q * n + k] = sine * c + cosine * d;
  }
  m[p * n + q] = m[q * n + p] = 0;
}
