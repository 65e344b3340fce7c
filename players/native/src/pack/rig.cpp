// The skeleton of a pack, for stage joints.
#include <cmath>
#include <cstdio>

#include "../pose/affine.h"
#include "read.h"

namespace avatar {

static constexpr double largest_number = 1e6;         // of a matrix
static constexpr double least_volume = 1e-18;        // of the 3x3 part of a matrix that has an inverse
static constexpr double least_rest_volume = 1e-300;  // of a product of such
static constexpr size_t fewest_anchors = 3;

ShownShape::ShownShape(const double* lengths, uint32_t count) {
    size_t size = static_cast<size_t>(std::snprintf(data, sizeof(data), "["));
    for (uint32_t i = 0; i < count; i++) {
        const char* gap = i > 0 ? ", " : "";
        size += static_cast<size_t>(std::snprintf(data + size, sizeof(data) - size, "%s%.0f", gap, lengths[i]));
    }
    std::snprintf(data + size, sizeof(data) - size, "]");
}

/// An array of a type and shape; -1 is any length. Empty where the error is set.
static Elements taken(const HeldArrays& arrays, const char* name, const char* type, const double* shape, uint32_t rank,
                      Errors& errors) {
    const HeldArray* held = arrays.find(name);
    if (held == nullptr) {
        errors.set(Place(name, 0), "is missing");
        return {};
    }
    if (held->is(type, shape, rank)) return held->elements;
    const ShownShape has(held->shape, held->rank), wanted(shape, rank);
    errors.set(Place(name, 0), "is %s %s, not %s %s", Cut(held->type, 8).data, has.data, type, wanted.data);
    return {};
}

template <class T>
static Span<T> words_of(const Elements& elements, Arena& arena) {
    Span<T> made = arena.make<T>(elements.length);
    for (size_t i = 0; i < made.size; i++) {
        const uint32_t word = elements[i];
        std::memcpy(&made[i], &word, 4);
    }
    return made;
}

Span<float> floats_of(const Elements& elements, Arena& arena) { return words_of<float>(elements, arena); }

static Span<double> doubles_of(Span<float> values, Arena& arena) {
    Span<double> made = arena.make<double>(values.size);
    for (size_t i = 0; i < made.size; i++) made[i] = values[i];
    return made;
}

void check_finite(Span<float> values, Text field, Errors& errors) {
    for (const float value : values) {
        if (!std::isfinite(value)) {
            errors.set(field, "holds a number that is not finite");
            return;
        }
    }
}

template <class T>
static void check_each_below(Span<T> values, double end, const char* name, Errors& errors) {
    for (const T value : values) {
        if (static_cast<double>(value) >= 0 && static_cast<double>(value) < end) continue;
        errors.set(Place(name, 0), "holds %.0f; 0 to %.0f are taken", static_cast<double>(value), end - 1);
        return;
    }
}

static void check_affine(Span<float> matrices, const char* name, Errors& errors) {
    for (size_t at = 0; at < matrices.size && !errors.any(); at += 16) {
        bool is_small = true;
        for (size_t i = at; i < at + 16; i++) is_small &= std::fabs(static_cast<double>(matrices[i])) <= largest_number;
        if (is_small && has_affine_row(&matrices[at]) && std::fabs(volume(&matrices[at])) > least_volume) continue;
        char field[120];
        std::snprintf(field, sizeof(field), "array %s[%zu]", name, at / 16);
        errors.set(field, "is not an affine matrix with an inverse");
    }
}

bool has_affine_row(const float* m) { return m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1; }

template <class T>
static double volume_of(const T* m) {
    const double a = m[0], b = m[1], c = m[2], d = m[4], e = m[5], f = m[6], g = m[8], h = m[9], i = m[10];
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
}

double volume(const float* matrix) { return volume_of(matrix); }

/// Every joint's rest transform through all its parents has an inverse in float64.
static void check_rest(const Skeleton& of, Errors& errors, const AvatarAllocator& allocator) {
    Arena own(allocator, errors);
    Span<double> rest = own.make<double>(16 * of.names.size);
    for (size_t joint = 0; joint < of.names.size && !errors.any(); joint++) {
        double* to = &rest[16 * joint];
        std::memcpy(to, &of.rest_local[16 * joint], 16 * sizeof(double));
        if (of.parents[joint] >= 0) multiply(to, &rest[16 * static_cast<size_t>(of.parents[joint])], to);
        bool sound = std::fabs(volume_of(to)) > least_rest_volume;
        for (size_t k = 0; k < 12; k++) sound = sound && std::isfinite(to[k]);
        const Cut name(of.names[joint], 80);
        if (!sound) errors.set("array rig.rest_local", "joint %s and its parents together have no inverse", name.data);
    }
}

Skeleton read_skeleton(const HeldArrays& arrays, Span<Text> names, uint32_t expressions, double vertices, Arena& arena) {
    Errors& errors = arena.errors();
    const double joints = static_cast<double>(names.size);
    const double matrices[] = {joints, 4, 4}, basis_shape[] = {static_cast<double>(expressions), joints, 3};
    const double list[] = {joints}, any[] = {-1};
    Skeleton made = {};
    made.names = names;
    made.parents = words_of<int32_t>(taken(arrays, "rig.parents", "i32", list, 1, errors), arena);
    const Span<float> local = floats_of(taken(arrays, "rig.rest_local", "f32", matrices, 3, errors), arena);
    const Span<float> bind = floats_of(taken(arrays, "rig.inverse_bind_matrix", "f32", matrices, 3, errors), arena);
    const Span<float> basis = floats_of(taken(arrays, "rig.joint_basis", "f32", basis_shape, 3, errors), arena);
    const Span<int32_t> correctives = words_of<int32_t>(taken(arrays, "rig.corrective_joints", "i32", any, 1, errors), arena);
    made.anchor_vertices = words_of<uint32_t>(taken(arrays, "rig.anchor_vertices", "u32", any, 1, errors), arena);
    if (errors.any()) return {};
    for (size_t joint = 0; joint < made.parents.size; joint++) {
        if (made.parents[joint] >= -1 && made.parents[joint] < static_cast<int32_t>(joint)) continue;
        errors.set("array rig.parents", "a parent must come before its children; a root is -1");
    }
    check_affine(local, "rig.rest_local", errors);
    check_affine(bind, "rig.inverse_bind_matrix", errors);
    check_finite(basis, "array rig.joint_basis", errors);
    check_each_below(correctives, joints, "rig.corrective_joints", errors);
    check_each_below(made.anchor_vertices, vertices, "rig.anchor_vertices", errors);
    made.rest_local = doubles_of(local, arena);
    made.inverse_bind = doubles_of(bind, arena);
    made.joint_basis = doubles_of(basis, arena);
    if (!errors.any()) check_rest(made, errors, arena.allocator());
    made.corrective_joints = arena.make<uint32_t>(correctives.size);
    for (size_t i = 0; i < made.corrective_joints.size; i++) made.corrective_joints[i] = static_cast<uint32_t>(correctives[i]);
    return errors.any() ? Skeleton{} : made;
}

Span<uint32_t> read_triangles(const HeldArrays& arrays, double vertices, Arena& arena) {
    const double shape[] = {3, -1};
    Span<uint32_t> corners = words_of<uint32_t>(taken(arrays, "rig.triangles", "u32", shape, 2, arena.errors()), arena);
    check_each_below(corners, vertices, "rig.triangles", arena.errors());
    return corners;
}

void check_groups(Span<Group> groups, const Avatar& avatar, Errors& errors) {
    static const char* const names[] = {"skin", "anchor", "joint_mix", "surface", "none"};
    for (const Group& group : groups) {
        char field[300];
        std::snprintf(field, sizeof(field), "group %s", Cut(group.name, 80).data);
        if (!avatar.has_skeleton && group.binding != Binding::none && group.binding != Binding::surface) {
            errors.set(field, "binding '%s' needs a skeleton", names[static_cast<int>(group.binding)]);
        }
        if (group.binding == Binding::anchor && avatar.skeleton.anchor_vertices.size < fewest_anchors) {
            errors.set(field, "binding 'anchor' needs at least %zu anchor vertices", fewest_anchors);
        }
        if ((group.binding == Binding::joint_mix) != !group.joint_mix.empty()) {
            errors.set(field, "joint_mix goes with binding 'joint_mix'");
        }
        std::snprintf(field + std::strlen(field), sizeof(field) - std::strlen(field), ", joint_mix");
        for (const Factor& one : group.joint_mix) check_joint(one.joint, avatar, field, errors);
        if (errors.any()) return;
    }
}

void check_joint(Text name, const Avatar& avatar, Text field, Errors& errors) {
    if (avatar.joint_names.find(name) != Names::none) return;
    errors.set_no_such(field, "joint of this avatar", name, avatar.skeleton.names.data, avatar.skeleton.names.size);
}

}  // namespace avatar
