#include "affine.h"

#include <cmath>

namespace avatar {

void multiply(double* out, const double* a, const double* b) {
    const double b0 = b[0], b1 = b[1], b2 = b[2], b3 = b[3], b4 = b[4], b5 = b[5];
    const double b6 = b[6], b7 = b[7], b8 = b[8], b9 = b[9], b10 = b[10], b11 = b[11];
    for (int row = 0; row < 12; row += 4) {
        const double x = a[row], y = a[row + 1], z = a[row + 2], t = a[row + 3];
        out[row] = x * b0 + y * b4 + z * b8;
        out[row + 1] = x * b1 + y * b5 + z * b9;
        out[row + 2] = x * b2 + y * b6 + z * b10;
        out[row + 3] = x * b3 + y * b7 + z * b11 + t;
    }
}

void invert_linear(double* out, const double* m) {
    const double a = m[0], b = m[1], c = m[2], d = m[4], e = m[5], f = m[6], g = m[8], h = m[9], k = m[10];
    const double scale = 1 / (a * (e * k - f * h) - b * (d * k - f * g) + c * (d * h - e * g));
    out[0] = (e * k - f * h) * scale;
    out[1] = (c * h - b * k) * scale;
    out[2] = (b * f - c * e) * scale;
    out[4] = (f * g - d * k) * scale;
    out[5] = (a * k - c * g) * scale;
    out[6] = (c * d - a * f) * scale;
    out[8] = (d * h - e * g) * scale;
    out[9] = (b * g - a * h) * scale;
    out[10] = (a * e - b * d) * scale;
}

void multiply_linear(double* out, const double* a, const double* b) {
    const double b0 = b[0], b1 = b[1], b2 = b[2], b4 = b[4], b5 = b[5], b6 = b[6], b8 = b[8], b9 = b[9], b10 = b[10];
    for (int row = 0; row < 12; row += 4) {
        const double x = a[row], y = a[row + 1], z = a[row + 2];
        out[row] = x * b0 + y * b4 + z * b8;
        out[row + 1] = x * b1 + y * b5 + z * b9;
        out[row + 2] = x * b2 + y * b6 + z * b10;
    }
}

void set_identity(double* out, int rows) {
    for (int k = 0; k < 4 * rows; k++) out[k] = k % 5 == 0 ? 1 : 0;
}

void make_polar(double* m, unsigned steps) {
    double inverse[12];
    for (unsigned step = 0; step < steps; step++) {
        invert_linear(inverse, m);
        for (int row = 0; row < 3; row++) {
            for (int column = 0; column < 3; column++) {
                double& at = m[4 * row + column];
                at = (at + inverse[4 * column + row]) / 2;
            }
        }
    }
}

void set_rotation(double* out, double x, double y, double z) {
    const double angle = std::sqrt(x * x + y * y + z * z);
    const double sine = angle > 0 ? std::sin(angle / 2) / angle : 0;
    set_from_quat(out, std::cos(angle / 2), x * sine, y * sine, z * sine);
}

void set_from_quat(double* out, double w, double x, double y, double z) {
    out[0] = 1 - 2 * (y * y + z * z);
    out[1] = 2 * (x * y - w * z);
    out[2] = 2 * (x * z + w * y);
    out[4] = 2 * (x * y + w * z);
    out[5] = 1 - 2 * (x * x + z * z);
    out[6] = 2 * (y * z - w * x);
    out[8] = 2 * (x * z - w * y);
    out[9] = 2 * (y * z + w * x);
    out[10] = 1 - 2 * (x * x + y * y);
}

void quat_from_matrix(double* q, const double* m) {
    const double d0 = m[0], d1 = m[5], d2 = m[10];
    const double ww = 1 + d0 + d1 + d2, xx = 1 + d0 - d1 - d2, yy = 1 - d0 + d1 - d2, zz = 1 - d0 - d1 + d2;
    const double a = m[9] - m[6], b = m[2] - m[8], c = m[4] - m[1];
    const double d = m[4] + m[1], e = m[2] + m[8], f = m[9] + m[6];
    const double most = std::fmax(std::fmax(ww, xx), std::fmax(yy, zz));
    const double scale = 1 / (2 * std::sqrt(most));
    q[0] = (most == ww ? ww : most == xx ? a : most == yy ? b : c) * scale;
    q[1] = (most == ww ? a : most == xx ? xx : most == yy ? d : e) * scale;
    q[2] = (most == ww ? b : most == xx ? d : most == yy ? yy : f) * scale;
    q[3] = (most == ww ? c : most == xx ? e : most == yy ? f : zz) * scale;
}

void multiply4(double* out, const float* a, const double* b) {
    for (int row = 0; row < 16; row += 4) {
        for (int column = 0; column < 4; column++) {
            double sum = 0;
            for (int k = 0; k < 4; k++) sum += static_cast<double>(a[row + k]) * b[4 * k + column];
            out[row + column] = sum;
        }
    }
}

}  // namespace avatar
