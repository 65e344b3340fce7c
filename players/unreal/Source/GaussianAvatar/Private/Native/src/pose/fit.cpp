// Copy of players/native/src/pose/fit.cpp by `python -m avatar_shaders`; do not edit.
#include "fit.h"

#include <cmath>

#include "affine.h"

namespace avatar {

static constexpr int most_sweeps = 32;
static constexpr double float64_epsilon = 2.220446049250313e-16;

/// The sum of sizes off the diagonal; 0 where they do not count beside the diagonal.
static double off_diagonal(const double* m, int n) {
    double off = 0, on = 0;
    for (int p = 0; p < n; p++) {
        on += std::fabs(m[p * (n + 1)]);
        for (int q = p + 1; q < n; q++) off += std::fabs(m[p * n + q]);
    }
    return off <= float64_epsilon * float64_epsilon * on ? 0 : off;
}

/// Turns axes p and q so that m[p, q] becomes 0.
static void rotate(double* m, double* vectors, int n, int p, int q) {
    const double off = m[p * n + q];
    if (off == 0) return;
    const double half = (m[q * (n + 1)] - m[p * (n + 1)]) / (2 * off);
    const double tangent = (half < 0 ? -1 : 1) / (std::fabs(half) + std::sqrt(half * half + 1));
    const double cosine = 1 / std::sqrt(tangent * tangent + 1), sine = tangent * cosine;
    for (int k = 0; k < n; k++) {
        const double a = m[k * n + p], b = m[k * n + q];
        m[k * n + p] = cosine * a - sine * b;
        m[k * n + q] = sine * a + cosine * b;
    }
    for (int k = 0; k < n; k++) {
        const double a = m[p * n + k], b = m[q * n + k];
        m[p * n + k] = cosine * a - sine * b;
        m[q * n + k] = sine * a + cosine * b;
        const double c = vectors[p * n + k], d = vectors[q * n + k];
        vectors[p * n + k] = cosine * c - sine * d;
        vectors[q * n + k] = sine * c + cosine * d;
    }
    m[p * n + q] = m[q * n + p] = 0;
}

int solve_eigen(double* m, double* vectors, int n) {
    for (int i = 0; i < n * n; i++) vectors[i] = i % (n + 1) == 0 ? 1 : 0;
    for (int sweep = 0; sweep < most_sweeps && off_diagonal(m, n) > 0; sweep++) {
        for (int p = 0; p < n; p++) {
            for (int q = p + 1; q < n; q++) rotate(m, vectors, n, p, q);
        }
    }
    int best = 0;
    for (int i = 1; i < n; i++) best = m[i * (n + 1)] > m[best * (n + 1)] ? i : best;
    return best;
}

void set_mean(double* out, Span<double> points, Span<double> weights) {
    double sum = 0;
    out[0] = out[1] = out[2] = 0;
    for (size_t i = 0; i < weights.size; i++) {
        sum += weights[i];
        for (size_t c = 0; c < 3; c++) out[c] += weights[i] * points[3 * i + c];
    }
    for (int c = 0; c < 3; c++) out[c] /= sum;
}

void set_rigid_fit(double* out, Span<double> from, Span<double> to, Span<double> weights, const double* centre) {
    double mean[3], m[16], vectors[16];
    set_mean(mean, to, weights);
    double xx = 0, xy = 0, xz = 0, yx = 0, yy = 0, yz = 0, zx = 0, zy = 0, zz = 0;
    for (size_t i = 0; i < weights.size; i++) {
        const double ax = weights[i] * (from[3 * i] - centre[0]), ay = weights[i] * (from[3 * i + 1] - centre[1]);
        const double az = weights[i] * (from[3 * i + 2] - centre[2]);
        const double bx = to[3 * i] - mean[0], by = to[3 * i + 1] - mean[1], bz = to[3 * i + 2] - mean[2];
        xx += ax * bx; xy += ax * by; xz += ax * bz;
        yx += ay * bx; yy += ay * by; yz += ay * bz;
        zx += az * bx; zy += az * by; zz += az * bz;
    }
    m[0] = xx + yy + zz;
    m[1] = m[4] = yz - zy;
    m[2] = m[8] = zx - xz;
    m[3] = m[12] = xy - yx;
    m[5] = xx - yy - zz;
    m[6] = m[9] = xy + yx;
    m[7] = m[13] = zx + xz;
    m[10] = yy - xx - zz;
    m[11] = m[14] = yz + zy;
    m[15] = zz - xx - yy;
    const double* q = vectors + 4 * solve_eigen(m, vectors, 4);
    set_from_quat(out, q[0], q[1], q[2], q[3]);
    for (int c = 0; c < 3; c++) {
        const double* row = out + 4 * c;
        out[4 * c + 3] = mean[c] - (row[0] * centre[0] + row[1] * centre[1] + row[2] * centre[2]);
    }
}

}  // namespace avatar
