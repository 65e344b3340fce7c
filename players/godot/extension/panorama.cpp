// A panorama of what a matt surface reflects, as spherical harmonics of its normal.
#include "panorama.h"

#include <cmath>

#include "../../native/src/made/constants.h"

namespace godot {

static constexpr double pi = 3.14159265358979323846;
static constexpr size_t terms = 9;

/// The bases of colours, of a unit vector.
static void write_bases(const double* n, double* out) {
    using namespace avatar;
    const double x = n[0], y = n[1], z = n[2];
    const double of[terms] = {1, y, z, x, x * y, y * z, 2 * z * z - x * x - y * y, x * z, x * x - y * y};
    for (size_t k = 0; k < terms; k++) out[k] = of[k] * (k == 0 ? sh_c0[0] : k < 4 ? sh_c1[k - 1] : sh_c2[k - 4]);
}

Value rows_of_panorama(const Value& rgba, int64_t height, const Transform3D& turn) {
    const size_t rows = height > 0 ? static_cast<size_t>(height) : 0, columns = 2 * rows;
    const Value made = Value::floats(3 * terms);
    if (rows == 0 || rgba.size() != 16 * rows * columns) return made;
    const float* pixel = reinterpret_cast<const float*>(rgba.bytes_data());
    double sums[3 * terms] = {};
    for (size_t row = 0; row < rows; row++) {
        const double top = std::cos(pi * static_cast<double>(row) / static_cast<double>(rows));
        const double bottom = std::cos(pi * static_cast<double>(row + 1) / static_cast<double>(rows));
        const double solid_angle = (top - bottom) * 2 * pi / static_cast<double>(columns);
        const double down = pi * (static_cast<double>(row) + 0.5) / static_cast<double>(rows);
        for (size_t column = 0; column < columns; column++, pixel += 4) {
            const double about = 2 * pi * (static_cast<double>(column) + 0.5) / static_cast<double>(columns);
            const double seen[3] = {-std::sin(about) * std::sin(down), std::cos(down), -std::cos(about) * std::sin(down)};
            double normal[3] = {}, bases[terms];
            for (size_t i = 0; i < 9; i++) normal[i / 3] += static_cast<double>(turn.rows[i / 3][i % 3]) * seen[i % 3];
            write_bases(normal, bases);
            for (size_t i = 0; i < 3 * terms; i++) sums[i] += solid_angle * bases[i / 3] * static_cast<double>(pixel[i % 3]);
        }
    }
    for (size_t i = 0; i < 3 * terms; i++) made.floats_data()[i] = static_cast<float>(sums[i]);
    return made;
}

}  // namespace godot
