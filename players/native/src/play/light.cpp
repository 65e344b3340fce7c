// The light of a scene: the numbers that stages shadow and light take of it, computed in float64.
#include "light.h"

#include <cmath>

#include "../formats/finite.h"
#include "../formats/sized.h"
#include "../made/constants.h"
#include "../pose/affine.h"

namespace avatar {

static constexpr double largest_colour = 1e4;  // brighter than any light of a scene
static constexpr double farthest = 1e9;        // further away than any
// How far a Gaussian is moved along its normal, and along the light, before it is asked whether it lies in shadow: trained
// Gaussians lie in layers about the skin (bundle units), and a map has an edge of texels.
static constexpr double layers[] = {0.006, 0.004}, texels[] = {1.5, 1.0};
static constexpr double nearest_radii = 1.05;  // a point light that is nearer casts no shadow

static double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static bool within(const double* numbers, size_t count, double low, double high) {
    bool sound = true;
    for (size_t i = 0; i < count; i++) sound &= numbers[i] >= low && numbers[i] <= high;
    return sound;
}

const char* take_light(const AvatarLight* given, AvatarLight& into) {
    if (!take(given, into)) return "struct_size must be sizeof(AvatarLight)";
    if (into.count > AVATAR_MOST_LIGHTS) return "has more than 4 lights";
    const double far = farthest;
    if (!within(into.ambient[0], 27, -far, far)) return "a number of ambient is not finite, or beyond 1e9";
    for (uint32_t i = 0; i < into.count; i++) {
        const AvatarDirectLight& one = into.lights[i];
        if (!within(one.place, 3, -far, far)) return "the place of a light is not finite, or beyond 1e9";
        if (!within(one.colour, 3, 0, largest_colour)) return "the colour of a light is not within 0 and 10000";
        if (one.point == 0 && !(dot(one.place, one.place) > 0)) return "the direction of a light has no length";
    }
    return nullptr;
}

static void cross(double* out, const double* a, const double* b) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/// Scales v to length 1; returns the length that it had.
static double make_unit(double* v) {
    const double length = std::sqrt(dot(v, v));
    for (int i = 0; i < 3; i++) v[i] /= length;
    return length;
}

static void set_row(float* to, const double* from, size_t count) {
    for (size_t i = 0; i < count; i++) to[i] = static_cast<float>(from[i]);
}

namespace {

/// The way from the scene to the pack's own space.
struct Inwards {
    double linear[12];  // the inverse of the place's 3x3 part, rows four apart
    double turn[12];    // the place's own turn, or mirror
    double scale;       // of lengths in the scene by those in the pack
    const double* placed;

    explicit Inwards(const double* given) : placed(given) {
        invert_linear(linear, given);
        double across[3];
        const double rows[3][3] = {{given[0], given[1], given[2]}, {given[4], given[5], given[6]}, {given[8], given[9], given[10]}};
        cross(across, rows[1], rows[2]);
        scale = std::cbrt(std::fabs(dot(rows[0], across)));
        for (int i = 0; i < 12; i++) turn[i] = i % 4 == 3 ? 0 : given[i] / scale;
        make_polar(turn, polar_steps);
    }

    bool is_sound() const { return all_finite(linear, 3) && all_finite(linear + 4, 3) && all_finite(linear + 8, 3) && all_finite(turn, 12); }

    void direction(double* out, const double* of) const {
        for (int row = 0; row < 3; row++) out[row] = dot(linear + 4 * row, of);
    }
    void position(double* out, const double* of) const {
        const double from[] = {of[0] - placed[3], of[1] - placed[7], of[2] - placed[11]};
        direction(out, from);
    }
};

/// One channel of ambient light as a form of the normal n: constant + first n + n second n.
struct AmbientForm {
    double first[3];
    double second[3][3];

    explicit AmbientForm(const double (*rows)[3], int channel) {
        const auto row = [&](int k) { return rows[k][channel]; };
        const double xy = sh_c2[0] * row(4) / 2, yz = sh_c2[1] * row(5) / 2, xz = sh_c2[3] * row(7) / 2;
        const double zz = sh_c2[2] * row(6), xx = sh_c2[4] * row(8);
        const double form[3][3] = {{xx - zz, xy, xz}, {xy, -zz - xx, yz}, {xz, yz, 2 * zz}};
        std::memcpy(second, form, sizeof(form));
        first[0] = sh_c1[2] * row(3);
        first[1] = sh_c1[0] * row(1);
        first[2] = sh_c1[1] * row(2);
    }

    /// The same light where normals are turned by `turn`, rows four apart, before they are looked up.
    void turned(const double* turn) {
        double vector[3] = {}, half[3][3] = {}, form[3][3] = {};
        for (int i = 0; i < 3; i++) {
            for (int k = 0; k < 3; k++) {
                vector[i] += turn[4 * k + i] * first[k];
                for (int j = 0; j < 3; j++) half[i][j] += turn[4 * k + i] * second[k][j];
            }
        }
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                for (int k = 0; k < 3; k++) form[i][j] += half[i][k] * turn[4 * k + j];
            }
        }
        std::memcpy(first, vector, sizeof(first));
        std::memcpy(second, form, sizeof(second));
    }

    double row(int k) const {
        const double rows[] = {first[1] / sh_c1[0], first[2] / sh_c1[1], first[0] / sh_c1[2], 2 * second[0][1] / sh_c2[0],
                               2 * second[1][2] / sh_c2[1], second[2][2] / (2 * sh_c2[2]), 2 * second[0][2] / sh_c2[3],
                               (second[0][0] - second[1][1]) / (2 * sh_c2[4])};
        return rows[k - 1];
    }
};

}  // namespace

static void write_ambient(const AvatarLight& light, const Inwards& inwards, LightRows& into) {
    for (int channel = 0; channel < 3; channel++) {
        AmbientForm form(light.ambient, channel);
        form.turned(inwards.turn);
        for (int k = 0; k < 9; k++) {
            into.ambient[k][channel] = static_cast<float>(k == 0 ? light.ambient[0][channel] : form.row(k));
        }
    }
}

/// Column, row, distance and w of a shadow map that holds the sphere about `centre`. False if a point light is within what it
/// lights. `place` is the light's in the pack's space: towards it with length 1, or where it is.
static bool write_shadow(const double* place, bool point, const double* centre, double radius, double (*rows)[4]) {
    double axis[3], across[3], down[3];
    for (int i = 0; i < 3; i++) axis[i] = place[i] - (point ? centre[i] : 0);
    const double distance = make_unit(axis);
    if (point && !(distance > nearest_radii * radius)) return false;
    const bool upright = std::fabs(axis[1]) < 0.9;
    const double up[] = {upright ? 0.0 : 1.0, upright ? 1.0 : 0.0, 0};
    cross(across, up, axis);
    make_unit(across);
    cross(down, across, axis);
    const double half = shadow_size / 2.0, middle = half - 0.5;
    const double* const eye = point ? place : centre;
    const double* const along[] = {across, down};
    const double scale = (point ? half * std::sqrt(distance * distance - radius * radius) : half) / radius;
    for (int k = 0; k < 3; k++) {
        rows[3][k] = point ? -axis[k] : 0;
        rows[2][k] = -axis[k];
    }
    rows[3][3] = point ? dot(axis, eye) : 1;
    rows[2][3] = dot(axis, eye) + (point ? 0 : radius);
    for (int row = 0; row < 2; row++) {
        for (int k = 0; k < 3; k++) rows[row][k] = scale * along[row][k] + middle * rows[3][k];
        rows[row][3] = middle * rows[3][3] - scale * dot(along[row], eye);
    }
    return true;
}

/// The inverse of how the light of the capture has turned with the avatar and its head.
static void write_turn(const Relight& relight, const double* posed, const float* skin, LightRows& into) {
    double turn[12], head[12];
    set_identity(turn, 3);
    set_identity(head, 3);
    for (int i = 0; i < 12 && skin != nullptr; i++) head[i] = static_cast<double>(skin[i]);
    if (relight.follows) multiply_linear(turn, posed, head);
    for (int row = 0; row < 3; row++) {
        for (int k = 0; k < 3; k++) into.turn[row][k] = static_cast<float>(turn[4 * k + row]);
    }
}

bool write_light(const AvatarLight& light, const Relight& relight, const double* placed, const double* posed,
                 const float* skin, LightRows& into) {
    std::memset(static_cast<void*>(&into), 0, sizeof(into));
    const Inwards inwards(placed);
    if (!inwards.is_sound()) return true;
    write_ambient(light, inwards, into);
    write_turn(relight, posed, skin, into);
    double first[3] = {};
    for (uint32_t i = 0; i < light.count; i++) {
        const AvatarDirectLight& one = light.lights[i];
        const bool point = one.point != 0;
        double at[3];
        if (point) inwards.position(at, one.place);
        else inwards.direction(at, one.place);
        if (!point) make_unit(at);
        set_row(into.place[i], at, 3);
        into.place[i][3] = point ? 1 : 0;
        const double fall = point ? inwards.scale * inwards.scale : 1;  // distances are shorter by the scale here
        for (int c = 0; c < 3; c++) into.colour[i][c] = static_cast<float>(one.colour[c] / fall);
        if (i == 0) std::memcpy(first, at, sizeof(first));
    }
    if (light.shadow != 0 && light.count > 0) {
        double centre[3], rows[4][4];
        for (int i = 0; i < 3; i++) centre[i] = dot(posed + 4 * i, relight.centre) + posed[4 * i + 3];
        if (write_shadow(first, light.lights[0].point != 0, centre, relight.radius, rows)) {
            set_row(into.shadow_row[0], rows[0], 16);
            const double texel = 2 * relight.radius / shadow_size;
            const double offset[] = {layers[0] + texels[0] * texel, layers[1] + texels[1] * texel, 1};
            set_row(into.shadow_offset, offset, 3);
        }
    }
    return all_finite(into.ambient[0], sizeof(into) / sizeof(float));
}

}  // namespace avatar
