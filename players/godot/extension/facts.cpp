// What scripts may know of a pack, and its clips as tracks.
#include <cstring>

#include "core.h"

namespace godot {

static Vector3 vector_of(const double* v) {
    return v == nullptr ? Vector3{} : Vector3{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

static Value expressions_of(const AvatarPack* pack, uint32_t count) {
    const Value rows = Value::array();
    for (uint32_t i = 0; i < count; i++) {
        double low = 0, high = 1;
        avatar_expression_range(pack, i, &low, &high);
        const Value row = Value::dictionary(), aliases = Value::empty(GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY);
        for (uint32_t a = 0; avatar_expression_alias(pack, i, a) != nullptr; a++) aliases.append(avatar_expression_alias(pack, i, a));
        row.set("name", avatar_expression_name(pack, i));
        row.set("low", low);
        row.set("high", high);
        row.set("aliases", aliases);
        rows.append(row);
    }
    return rows;
}

static Value joints_of(const AvatarPack* pack, const AvatarFacts& facts) {
    const Value rows = Value::array();
    for (uint32_t i = 0; i < facts.joints; i++) {
        const Value row = Value::dictionary();
        row.set("name", avatar_joint_name(pack, i));
        row.set("parent", avatar_joint_parents(pack)[i]);
        row.set("rest", transform_of(avatar_rest_local(pack) + 16 * i, facts.left_handed != 0));
        rows.append(row);
    }
    return rows;
}

static Value clips_of(const AvatarPack* pack, uint32_t count) {
    const Value rows = Value::array();
    for (uint32_t i = 0; i < count; i++) {
        AvatarClip clip;
        avatar_clip(pack, i, &clip);
        const Value row = Value::dictionary();
        row.set("name", clip.name);
        row.set("fps", clip.fps);
        row.set("frames", clip.frames);
        row.set("seconds", clip.seconds);
        rows.append(row);
    }
    return rows;
}

static Value levels_of(const AvatarPack* pack, uint32_t count) {
    const Value rows = Value::array();
    for (uint32_t i = 0; i < count; i++) {
        AvatarLevel level;
        avatar_level(pack, i, &level);
        const Value row = Value::dictionary();
        row.set("count", level.count);
        row.set("height_px", level.height_px);
        row.set("psnr_db", level.psnr_db);
        rows.append(row);
    }
    return rows;
}

Value Core::facts() const {
    const Value made = Value::dictionary();
    if (posed_ == nullptr) return made;
    const AvatarPack* pack = posed_->pack;
    const AvatarFacts facts = known();
    made.set("name", facts.name);
    made.set("license", facts.license);
    made.set("consent", facts.consent);
    made.set("left_handed", facts.left_handed != 0);
    made.set("relit", facts.relit != 0);
    made.set("drivable", facts.drivable != 0);
    made.set("bytes", static_cast<int64_t>(facts.file_bytes));
    const Vector3 low = vector_of(facts.bounds_low), high = vector_of(facts.bounds_high);
    made.set("bounds", Aabb{low, {high.x - low.x, high.y - low.y, high.z - low.z}});
    made.set("whole_target", vector_of(facts.whole_target));
    made.set("whole_size", vector_of(facts.whole_size));
    made.set("head_target", vector_of(facts.head_target));
    made.set("head_size", vector_of(facts.head_size));
    made.set("preview", Value::bytes(facts.preview_bytes, facts.preview));
    made.set("expressions", expressions_of(pack, facts.expressions));
    const Value eyelids = Value::empty(GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY);
    for (uint32_t i = 0; i < facts.eyelids; i++) eyelids.append(avatar_eyelid_name(pack, i));
    made.set("eyelids", eyelids);
    made.set("joints", joints_of(pack, facts));
    made.set("clips", clips_of(pack, facts.clips));
    made.set("levels", levels_of(pack, facts.levels));
    return made;
}

/// {index: weights over time} of the columns [T, count] that are not all zeros.
static Value moving_weights(const float* weights, uint32_t frames, uint32_t count) {
    const Value made = Value::dictionary();
    for (uint32_t k = 0; k < count; k++) {
        bool moves = false;
        for (uint32_t t = 0; t < frames; t++) moves = moves || weights[static_cast<size_t>(t) * count + k] != 0;
        if (!moves) continue;
        const Value column = Value::floats(frames);
        for (uint32_t t = 0; t < frames; t++) column.floats_data()[t] = weights[static_cast<size_t>(t) * count + k];
        made.set(Value(k), column);
    }
    return made;
}

/// Matrices over time, every `stride`-th of `from`; nil where all are the identity.
static Value moving_matrices(const float* from, uint32_t frames, size_t stride, bool left_handed) {
    const Value made = Value::array();
    bool moves = false;
    for (uint32_t t = 0; t < frames; t++) {
        double matrix[16];
        for (int i = 0; i < 16; i++) {
            matrix[i] = static_cast<double>(from[t * stride + static_cast<size_t>(i)]);
            moves = moves || matrix[i] != (i % 5 == 0 ? 1.0 : 0.0);
        }
        made.append(transform_of(matrix, left_handed));
    }
    return moves ? made : Value();
}

Value Core::clip_tracks(int64_t index) const {
    const Value made = Value::dictionary(), joints = Value::dictionary();
    AvatarClip clip;
    if (posed_ == nullptr || index < 0 || avatar_clip(posed_->pack, static_cast<uint32_t>(index), &clip) != AVATAR_OK) return made;
    const AvatarFacts facts = known();
    const Value times = Value::floats(clip.frames);
    for (uint32_t t = 0; t < clip.frames; t++) times.floats_data()[t] = static_cast<float>(t / clip.fps);
    made.set("times", times);
    made.set("expressions", moving_weights(clip.expression_weights, clip.frames, facts.expressions));
    made.set("eyelids", moving_weights(clip.eyelid_weights, clip.frames, facts.eyelids));
    for (uint32_t j = 0; j < facts.joints; j++) {
        const Value one = moving_matrices(clip.joint_delta + 16 * static_cast<size_t>(j), clip.frames, 16 * facts.joints, facts.left_handed != 0);
        if (!one.is_nil()) joints.set(Value(j), one);
    }
    made.set("joints", joints);
    const Value root = moving_matrices(clip.world_from_avatar, clip.frames, 16, facts.left_handed != 0);
    if (!root.is_nil()) made.set("root", root);
    return made;
}

}  // namespace godot
