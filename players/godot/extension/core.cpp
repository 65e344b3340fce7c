#include "core.h"

#include <cmath>
#include <cstring>

namespace godot {

static const char not_loaded[] = "no avatar is loaded";

/// x points the other way in a left-handed frame: entries that mix it with another axis change their sign.
static double mirrored(double value, int row, int column, bool left_handed) {
    return left_handed && (row == 0) != (column == 0) ? -value : value;
}

Transform3D transform_of(const double* matrix, bool left_handed) {
    Transform3D made = {};
    float* const origin = &made.origin.x;
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) made.rows[r][c] = static_cast<float>(mirrored(matrix[4 * r + c], r, c, left_handed));
        origin[r] = static_cast<float>(mirrored(matrix[4 * r + 3], r, 3, left_handed));
    }
    return made;
}

void matrix_of(const Transform3D& transform, bool left_handed, double* into) {
    const float* const origin = &transform.origin.x;
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) into[4 * r + c] = mirrored(static_cast<double>(transform.rows[r][c]), r, c, left_handed);
        into[4 * r + 3] = mirrored(static_cast<double>(origin[r]), r, 3, left_handed);
    }
    for (int c = 0; c < 4; c++) into[12 + c] = c == 3;
}

void Core::drop() {
    avatar_instance_close(instance_);
    instance_ = nullptr;
    if (posed_ != nullptr) posed_->release();
    posed_ = nullptr;
}

AvatarFacts Core::known() const {
    AvatarFacts facts;
    if (posed_ != nullptr) avatar_facts(posed_->pack, &facts);
    return facts;
}

static const char loaded_already[] = "an avatar is loaded already: make another GaussianAvatarCore";

Value Core::load(const Value& data, const Value& name) {
    if (posed_ != nullptr) return loaded_already;
    char called[256];
    name.to_utf8(called, sizeof called);
    const size_t size = data.size();
    AvatarPack* pack = avatar_load(size == 0 ? nullptr : data.bytes_data(), size, called, &counted_allocator());
    if (const char* line = avatar_error(pack)) {
        const Value said(line);
        avatar_close(pack);
        return said;
    }
    return take(new SharedPack(pack));
}

Value Core::load_same(const Value& other) {
    if (posed_ != nullptr) return loaded_already;
    const Core* from = static_cast<const Core*>(instance_of(other, row));
    if (from == nullptr || from->posed_ == nullptr) return not_loaded;
    from->posed_->shared->hold();
    return take(from->posed_->shared);
}

/// Takes a reference.
Value Core::take(SharedPack* shared) {
    posed_ = new Posed(shared);
    instance_ = avatar_instance_open(shared->pack, 0, &counted_allocator());
    if (instance_ != nullptr && avatar_instance_error(instance_) == nullptr) return "";
    const Value said(instance_ == nullptr ? "there is no memory" : avatar_instance_error(instance_));
    drop();
    return said;
}

Value Core::commit() {
    if (instance_ == nullptr) return not_loaded;
    posed_->put(instance_, level);
    return "";
}

/// The element of a pose by index, or null.
static float* weight_of(const Value& index, float* weights, uint32_t count) {
    const int64_t i = index.to_int();
    return weights == nullptr || i < 0 || i >= static_cast<int64_t>(count) ? nullptr : weights + i;
}

static float* expression(const Core& core, const Value& index) {
    return weight_of(index, avatar_expression_weights(core.instance()), core.known().expressions);
}

static float* eyelid(const Core& core, const Value& index) {
    return weight_of(index, avatar_eyelid_weights(core.instance()), core.known().eyelids);
}

static double* joint(const Core& core, const Value& index) {
    const int64_t i = index.to_int();
    const bool is_there = core.instance() != nullptr && i >= 0 && i < static_cast<int64_t>(core.known().joints);
    return is_there ? avatar_joint_delta(core.instance()) + 16 * i : nullptr;
}

/// Numbers that are not finite stay out.
static void set_weight(float* into, const Value& value) {
    const float weight = static_cast<float>(value.to_float());
    if (into != nullptr && std::isfinite(weight)) *into = weight;
}

static void set_matrix(const Core& core, double* into, const Value& value) {
    const Transform3D given = value.to_transform();
    const float* numbers = &given.rows[0][0];
    for (int i = 0; i < 12; i++) {
        if (into == nullptr || !std::isfinite(numbers[i])) return;
    }
    matrix_of(given, core.known().left_handed != 0, into);
}

static Value matrix_value(const Core& core, const double* from) {
    return from == nullptr ? Value(Value().to_transform()) : Value(transform_of(from, core.known().left_handed != 0));
}

static Value drive(const Core& core, const Value* given) {
    if (core.instance() == nullptr) return not_loaded;
    if (given[0].size() != AVATAR_ARKIT_CHANNELS) return "channels: 61 numbers are needed, in the order of arkit_names()";
    AvatarFrame frame;
    const float* channels = given[0].floats_data();
    std::memcpy(frame.weights, channels, sizeof frame.weights);
    double* const angles[] = {frame.head, frame.left_eye, frame.right_eye};
    for (int i = 0; i < 9; i++) angles[i / 3][i % 3] = static_cast<double>(channels[AVATAR_ARKIT_WEIGHTS + i]);
    const bool good = avatar_enable_driving(core.instance(), given[1].to_bool()) == AVATAR_OK &&
                      avatar_drive(core.instance(), &frame) == AVATAR_OK;
    return good ? "" : avatar_instance_error(core.instance());
}

static Value channels_of(const AvatarFrame& frame) {
    const Value made = Value::floats(AVATAR_ARKIT_CHANNELS);
    float* channels = made.floats_data();
    std::memcpy(channels, frame.weights, sizeof frame.weights);
    const double* const angles[] = {frame.head, frame.left_eye, frame.right_eye};
    for (int i = 0; i < 9; i++) channels[AVATAR_ARKIT_WEIGHTS + i] = static_cast<float>(angles[i / 3][i % 3]);
    return made;
}

static Value read_packet(const Value& packet) {
    AvatarFrame frame;
    const size_t size = packet.size();
    const bool read = size > 0 && avatar_read_packet(packet.bytes_data(), size, &frame) != 0;
    return read ? channels_of(frame) : Value::floats(0);
}

/// The face of idle life. Of a seed the lowest 32 bits count.
static Value idle(const Value* given) {
    AvatarFrame frame;
    const bool made = avatar_idle(given[0].to_float(), static_cast<uint32_t>(given[1].to_int()), &frame) == AVATAR_OK;
    return made ? channels_of(frame) : Value::floats(0);
}

static Value arkit_names() {
    const Value made = Value::empty(GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY);
    for (uint32_t i = 0; avatar_arkit_name(i) != nullptr; i++) made.append(avatar_arkit_name(i));
    return made;
}

static Value pose_floats(const Core& core) {
    uint32_t count = 0;
    if (core.instance() == nullptr || avatar_update_pose(core.instance()) != AVATAR_OK) return Value::floats(0);
    const float* floats = avatar_pose_floats(core.instance(), &count);
    return Value::floats(count, floats);
}

static Core& of(Instance* instance) { return *static_cast<Core*>(instance); }

#define RUN(body) [](Instance* instance, [[maybe_unused]] const Value* given) -> Value { [[maybe_unused]] Core& core = of(instance); body }
static constexpr auto nothing = GDEXTENSION_VARIANT_TYPE_NIL, number = GDEXTENSION_VARIANT_TYPE_FLOAT,
                      integer = GDEXTENSION_VARIANT_TYPE_INT, text = GDEXTENSION_VARIANT_TYPE_STRING,
                      boolean = GDEXTENSION_VARIANT_TYPE_BOOL, bytes = GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY,
                      floats = GDEXTENSION_VARIANT_TYPE_PACKED_FLOAT32_ARRAY, dictionary = GDEXTENSION_VARIANT_TYPE_DICTIONARY,
                      transform = GDEXTENSION_VARIANT_TYPE_TRANSFORM3D;

static const MethodRow methods[] = {
    {"load", RUN(return core.load(given[0], given[1]);), text, {{"data", bytes}, {"name", text}}, 2},
    {"load_same", RUN(return core.load_same(given[0]);), text, {{"other", GDEXTENSION_VARIANT_TYPE_OBJECT, "GaussianAvatarCore"}}, 1},
    {"facts", RUN(return core.facts();), dictionary, {}, 0},
    {"expression", RUN(const float* w = expression(core, given[0]); return w == nullptr ? 0.0 : static_cast<double>(*w);), number,
     {{"index", integer}}, 1},
    {"set_expression", RUN(set_weight(expression(core, given[0]), given[1]); return {};), nothing,
     {{"index", integer}, {"weight", number}}, 2},
    {"eyelid", RUN(const float* w = eyelid(core, given[0]); return w == nullptr ? 0.0 : static_cast<double>(*w);), number,
     {{"index", integer}}, 1},
    {"set_eyelid", RUN(set_weight(eyelid(core, given[0]), given[1]); return {};), nothing,
     {{"index", integer}, {"weight", number}}, 2},
    {"joint", RUN(return matrix_value(core, joint(core, given[0]));), transform, {{"index", integer}}, 1},
    {"set_joint", RUN(set_matrix(core, joint(core, given[0]), given[1]); return {};), nothing,
     {{"index", integer}, {"delta", transform}}, 2},
    {"root", RUN(return matrix_value(core, avatar_world_from_avatar(core.instance()));), transform, {}, 0},
    {"set_root", RUN(set_matrix(core, avatar_world_from_avatar(core.instance()), given[0]); return {};), nothing,
     {{"world_from_avatar", transform}}, 1},
    {"reset_pose", RUN(avatar_reset_pose(core.instance()); return {};), nothing, {}, 0},
    {"clip_pose",
     RUN(return avatar_clip_pose(core.instance(), static_cast<uint32_t>(given[0].to_int()), given[1].to_float()) == AVATAR_OK;),
     boolean, {{"clip", integer}, {"seconds", number}}, 2},
    {"clip_tracks", RUN(return core.clip_tracks(given[0].to_int());), dictionary, {{"clip", integer}}, 1},
    {"drive", RUN(return drive(core, given);), text, {{"channels", floats}, {"within_range", boolean}}, 2},
    {"read_packet", RUN(return read_packet(given[0]);), floats, {{"packet", bytes}}, 1},
    {"idle", RUN(return idle(given);), floats, {{"seconds", number}, {"seed", integer}}, 2},
    {"arkit_names", RUN(return arkit_names();), GDEXTENSION_VARIANT_TYPE_PACKED_STRING_ARRAY, {}, 0},
    {"pose_floats", RUN(return pose_floats(core);), floats, {}, 0},
    {"commit", RUN(return core.commit();), text, {}, 0},
    {"level", RUN(return static_cast<int64_t>(core.level);), integer, {}, 0},
    {"set_level", RUN(core.level = static_cast<int32_t>(given[0].to_int()); return {};), nothing, {{"level", integer}}, 1},
    {"conform", RUN(return core.conform(given[0], given[1]);), dictionary, {{"cases", text}, {"vectors", bytes}}, 2},
};
#undef RUN

const ClassRow Core::row = {"GaussianAvatarCore",
                            "RefCounted",
                            [](GDExtensionObjectPtr) -> Instance* { return new Core; },
                            [](Instance* instance) { delete static_cast<Core*>(instance); },
                            nullptr,
                            nullptr,
                            methods,
                            sizeof methods / sizeof methods[0]};

}  // namespace godot
