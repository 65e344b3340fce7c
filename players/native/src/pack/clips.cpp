// Recorded motions: float32, or by channel low + step * code with codes as differences from frame to frame.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "read.h"

namespace avatar {

static constexpr double most_off_rigid = 1e-3;  // largest difference of R R^T from the identity

namespace {

class Clips {
public:
    Clips(const HeldArrays& arrays, double limit, Arena& arena)
        : arrays_(arrays), limit_(limit), left_(limit), arena_(arena), errors_(arena.errors()) {}

    ClipData read(Json said, uint32_t index, const Avatar& avatar);

private:
    Span<float> read_array(Json said, uint32_t index, const char* name, const double* shape, uint32_t rank);
    Span<float> decoded(const char* key, size_t frames, size_t channels);
    Elements taken(const char* key, const char* part, const char* type, const char* type_name, size_t rows, size_t columns);
    void check_matrices(const ClipData& clip, Json said);

    const HeldArrays& arrays_;
    double limit_, left_;
    Arena& arena_;
    Errors& errors_;
};

ClipData Clips::read(Json said, uint32_t index, const Avatar& avatar) {
    ClipData clip = {};
    clip.frames = said.at("frames").integer();
    clip.fps = said.at("fps").number();
    clip.name = arena_.copy(said.at("name").text());
    const double t = clip.frames, joints = static_cast<double>(avatar.skeleton.names.size);
    const double weights[] = {t, static_cast<double>(avatar.expressions.size)};
    const double late[] = {t, static_cast<double>(avatar.late_morphs.size)};
    const double delta[] = {t, joints, 4, 4}, world[] = {t, 4, 4};
    clip.expression_weights = read_array(said, index, "expression_weights", weights, 2);
    clip.late_weights = read_array(said, index, "late_weights", late, 2);
    clip.joint_delta = read_array(said, index, "joint_delta", delta, 4);
    clip.world_from_avatar = read_array(said, index, "world_from_avatar", world, 3);
    if (!errors_.any()) check_matrices(clip, said);
    return clip;
}

Span<float> Clips::read_array(Json said, uint32_t index, const char* name, const double* shape, uint32_t rank) {
    if (errors_.any()) return {};
    char key[64];
    std::snprintf(key, sizeof(key), "clips.%u.%s", index, name);
    double channels = 1;
    for (uint32_t i = 1; i < rank; i++) channels *= shape[i];
    left_ -= 4 * shape[0] * channels;
    if (left_ < 0) {
        char line[80];
        std::snprintf(line, sizeof(line), "with it the clips take more than %.0f bytes", limit_);
        said.set(line);
        return {};
    }
    const HeldArray* whole = arrays_.find(key);
    Span<float> values;
    if (whole == nullptr) {
        values = decoded(key, static_cast<size_t>(shape[0]), static_cast<size_t>(channels));
    } else if (whole->is("f32", shape, rank)) {
        values = floats_of(whole->elements, arena_);
    } else {
        const ShownShape has(whole->shape, whole->rank), wanted(shape, rank);
        errors_.set(Place(key, 0), "has shape %s, not %s", has.data, wanted.data);
    }
    check_finite(values, Place(key, 0), errors_);
    return values;
}

Span<float> Clips::decoded(const char* key, size_t frames, size_t channels) {
    const Elements scale = taken(key, "scale", "f32", "float32", channels, 2);
    if (errors_.any()) return {};
    size_t moving = 0;
    for (size_t channel = 0; channel < channels; channel++) moving += scale.float_at(2 * channel + 1) != 0;
    const Elements codes = taken(key, "codes", "u16", "uint16", moving, frames);
    if (errors_.any()) return {};
    Span<float> values = arena_.make<float>(frames * channels);
    if (errors_.any()) return {};
    size_t row = 0;
    for (size_t channel = 0; channel < channels; channel++) {
        const double low = scale.float_at(2 * channel), step = scale.float_at(2 * channel + 1);
        uint16_t code = 0;
        for (size_t frame = 0; frame < frames; frame++) {
            float& value = values[frame * channels + channel];
            value = static_cast<float>(low);
            if (step == 0) continue;
            code = static_cast<uint16_t>(code + codes[row * frames + frame]);
            value = static_cast<float>(low + static_cast<float>(code * step));
        }
        row += step != 0;
    }
    return values;
}

Elements Clips::taken(const char* key, const char* part, const char* type, const char* type_name, size_t rows,
                      size_t columns) {
    char name[80];
    std::snprintf(name, sizeof(name), "%s.%s", key, part);
    const double shape[] = {static_cast<double>(rows), static_cast<double>(columns)};
    const HeldArray* held = arrays_.find(name);
    if (held != nullptr && held->is(type, shape, 2)) return held->elements;
    errors_.set(Place(name, 0), "is missing, or is not %s [%zu, %zu]", type_name, rows, columns);
    return {};
}

static bool is_rigid(const float* m) {
    double off = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double dot = i == j ? -1 : 0;
            for (int k = 0; k < 3; k++) dot += static_cast<double>(m[4 * i + k]) * static_cast<double>(m[4 * j + k]);
            off = std::fabs(dot) > off ? std::fabs(dot) : off;
        }
    }
    return off <= most_off_rigid && volume(m) > 0;
}

void Clips::check_matrices(const ClipData& clip, Json said) {
    for (const Span<float>* matrices : {&clip.joint_delta, &clip.world_from_avatar}) {
        for (size_t at = 0; at < matrices->size && !errors_.any(); at += 16) {
            if (!has_affine_row(&(*matrices)[at])) said.set("holds a matrix that is not affine");
        }
    }
    for (size_t at = 0; at < clip.world_from_avatar.size && !errors_.any(); at += 16) {
        if (is_rigid(&clip.world_from_avatar[at])) continue;
        char line[160];
        std::snprintf(line, sizeof(line),
                      "world_from_avatar of frame %zu is not rigid: a rotation and a translation move the avatar as a whole",
                      at / 16);
        said.set(line);
    }
}

}  // namespace

Span<ClipData> read_clips(Json listed, const HeldArrays& arrays, const Avatar& avatar, double limit, Arena& arena) {
    Clips clips(arrays, limit, arena);
    const JsonList said = listed.list();
    Span<ClipData> found = arena.make<ClipData>(said.size);
    uint32_t index = 0;
    for (Json one : said) {
        if (arena.errors().any()) return {};
        found[index] = clips.read(one, index, avatar);
        index++;
    }
    return found;
}

}  // namespace avatar
