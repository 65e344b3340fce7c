// The functions of avatar_player.h that pose an avatar.
#include <cmath>
#include <cstdio>
#include <initializer_list>

#include "../drive/idle.h"
#include "../drive/recording.h"
#include "../formats/sized.h"
#include "../play/camera.h"
#include "../play/levels.h"
#include "../pose/affine.h"
#include "play_handles.h"

using namespace avatar;

AvatarInstance::AvatarInstance(const AvatarAllocator& given, const AvatarPack& of, uint32_t at)
    : HandleBase(given), pack(of), values(of.unusable ? 0 : of.avatar.groups.size) {
    errors.set_owner(of.avatar.name);
    if (of.unusable) errors.set("", "its pack could not be loaded");
    else if (at >= of.avatar.levels.size) set_no_level(at);
    if (!errors.any()) {
        level = at;
        pose.make(of.avatar, arena);
        poser.make(of.avatar, arena);
        values.floats = arena.make<float>(values.layout.size());
    }
    set_identity(place, 4);
    unusable = errors.any();
    if (!unusable) update();
}

void AvatarInstance::set_no_level(uint32_t at) {
    errors.set("level", "there is no level %u; the last one is level %zu", at, pack.avatar.levels.size - 1);
}

/// The place of the first number that is not finite. Sets the error.
template <class T>
static bool refuse(Errors& errors, const char* field, Span<T> numbers) {
    if (all_finite(numbers.data, numbers.size)) return false;
    size_t at = 0;
    while (all_finite(&numbers[at], 1)) at++;
    errors.set(field, "number %zu is %s; numbers of a pose must be finite, and no larger than float32 holds", at,
               Digits(static_cast<double>(numbers[at])).data);
    return true;
}

bool AvatarInstance::has_finite_pose() {
    return !refuse(errors, "expression_weights", pose.expression_weights) && !refuse(errors, "eyelid_weights", pose.late_weights) &&
           !refuse(errors, "joint_delta", pose.joint_delta) && !refuse(errors, "world_from_avatar", pose.world_from_avatar);
}

bool AvatarInstance::has_finite_frame() {
    const Span<float> groups[] = {poser.groups.matrix, poser.groups.rotation};
    bool finite = all_finite(poser.pose_floats.data, poser.pose_floats.size);
    for (const Span<float> one : groups) finite = finite && all_finite(one.data, one.size);
    if (!finite) errors.set("pose", "moves the avatar beyond the numbers of float32");
    return finite;
}

void AvatarInstance::update() {
    poser.update(pose);
    values.set_posed(poser.groups.matrix.data, poser.groups.rotation.data, pose.world_from_avatar.data);
}

void AvatarInstance::write_placed(double* into) const {
    std::memcpy(into, place, sizeof(place));
    for (int row = 0; row < 4 && pack.avatar.left_handed; row++) into[4 * row] = -into[4 * row];
}

AvatarInstance* avatar_instance_open(const AvatarPack* pack, uint32_t level, const AvatarAllocator* allocator) {
    return pack == nullptr ? nullptr : open_handle<AvatarInstance>(allocator, *pack, level);
}

void avatar_instance_close(AvatarInstance* instance) { close_handle(instance); }

const char* avatar_instance_error(const AvatarInstance* instance) { return line_of(instance); }

void avatar_reset_pose(AvatarInstance* instance) {
    if (ready(instance)) instance->pose.reset();
}

static bool is_finite_weight(AvatarInstance* instance, const char* what, const char* name, double value) {
    if (all_finite(&value, 1)) return true;
    char field[300];
    std::snprintf(field, sizeof(field), "%s %s", what, Cut(name, 80).data);
    instance->errors.set(field, "%s is not a finite float32", Digits(value).data);
    return false;
}

int avatar_set_expression(AvatarInstance* instance, const char* name, double weight) {
    if (!ready(instance)) return AVATAR_FAILED;
    const Avatar& of = instance->pack.avatar;
    const int64_t index = of.expression_names.find(name);
    if (index == Names::none) {
        instance->set_no_such_expression(name);
        return AVATAR_FAILED;
    }
    if (!is_finite_weight(instance, "expression", name, weight)) return AVATAR_FAILED;
    instance->pose.expression_weights[static_cast<size_t>(index)] = static_cast<float>(weight);
    return AVATAR_OK;
}

void AvatarInstance::set_no_such_expression(Text name) {
    constexpr size_t most = 512;  // names that are compared
    Text known[most];
    const size_t count = pack.avatar.expressions.size < most ? pack.avatar.expressions.size : most;
    for (size_t i = 0; i < count; i++) known[i] = pack.avatar.expressions[i].name;
    errors.set_no_such("", "expression of this avatar", name, known, count);
}

int avatar_set_eyelid(AvatarInstance* instance, const char* name, double weight) {
    if (!ready(instance)) return AVATAR_FAILED;
    const Avatar& of = instance->pack.avatar;
    const int64_t index = of.late_names.find(name);
    if (index == Names::none) {
        instance->errors.set_no_such("", "eyelid of this avatar", name, of.late_morphs.data, of.late_morphs.size);
        return AVATAR_FAILED;
    }
    if (!is_finite_weight(instance, "eyelid", name, weight)) return AVATAR_FAILED;
    instance->pose.late_weights[static_cast<size_t>(index)] = static_cast<float>(weight);
    return AVATAR_OK;
}

int avatar_set_joint(AvatarInstance* instance, const char* name, double rx, double ry, double rz) {
    if (!ready(instance)) return AVATAR_FAILED;
    const Avatar& of = instance->pack.avatar;
    const int64_t index = of.joint_names.find(name);
    if (index == Names::none) {
        instance->errors.set_no_such("", "joint of this avatar", name, of.skeleton.names.data, of.skeleton.names.size);
        return AVATAR_FAILED;
    }
    for (const double turn : {rx, ry, rz}) {
        if (!is_finite_weight(instance, "joint", name, turn)) return AVATAR_FAILED;
    }
    double* delta = &instance->pose.joint_delta[16 * static_cast<size_t>(index)];
    const double side = of.left_handed ? -1 : 1;  // a rotation vector keeps x in a mirror
    set_identity(delta, 4);
    set_rotation(delta, rx, side * ry, side * rz);
    return AVATAR_OK;
}

float* avatar_expression_weights(AvatarInstance* instance) {
    return ready(instance) ? instance->pose.expression_weights.data : nullptr;
}

float* avatar_eyelid_weights(AvatarInstance* instance) {
    return ready(instance) ? instance->pose.late_weights.data : nullptr;
}

double* avatar_joint_delta(AvatarInstance* instance) { return ready(instance) ? instance->pose.joint_delta.data : nullptr; }

double* avatar_world_from_avatar(AvatarInstance* instance) {
    return ready(instance) ? instance->pose.world_from_avatar.data : nullptr;
}

double* avatar_place(AvatarInstance* instance) { return ready(instance) ? instance->place : nullptr; }

int avatar_set_level(AvatarInstance* instance, uint32_t level) {
    if (!ready(instance)) return AVATAR_FAILED;
    if (level >= instance->pack.avatar.levels.size) {
        instance->set_no_level(level);
        return AVATAR_FAILED;
    }
    instance->level = level;
    return AVATAR_OK;
}

uint32_t avatar_instance_level(const AvatarInstance* instance) { return instance == nullptr ? 0 : instance->level; }

int avatar_clip_pose(AvatarInstance* instance, uint32_t clip, double seconds) {
    if (!ready(instance)) return AVATAR_FAILED;
    const Span<ClipData> clips = instance->pack.avatar.clips;
    if (clip >= clips.size) {
        if (clips.size == 0) instance->errors.set("clips", "there is no clip %u; this avatar has none", clip);
        else instance->errors.set("clips", "there is no clip %u; the last one is clip %zu", clip, clips.size - 1);
        return AVATAR_FAILED;
    }
    sample_clip(clips[clip], seconds, instance->pose);
    return AVATAR_OK;
}

int avatar_enable_driving(AvatarInstance* instance, int within_range) {
    if (!ready(instance)) return AVATAR_FAILED;
    const int kind = within_range != 0;
    if (!instance->has_driver[kind]) {
        Driver made;
        made.make(instance->pack.avatar, within_range != 0, instance->arena);
        if (instance->errors.any()) return AVATAR_FAILED;
        instance->drivers[kind] = made;
        instance->has_driver[kind] = true;
    }
    instance->driver = &instance->drivers[kind];
    return AVATAR_OK;
}

/// Whether a captured frame can be used. Sets the error.
static bool is_finite_frame(AvatarInstance& instance, const AvatarFrame& frame) {
    double channels[arkit_channels];
    for (int i = 0; i < arkit_shapes; i++) channels[i] = static_cast<double>(frame.weights[i]);
    std::memcpy(channels + arkit_shapes, frame.head, sizeof(frame.head));
    std::memcpy(channels + arkit_shapes + 3, frame.left_eye, sizeof(frame.left_eye));
    std::memcpy(channels + arkit_shapes + 6, frame.right_eye, sizeof(frame.right_eye));
    for (int i = 0; i < arkit_channels; i++) {
        if (!is_finite_weight(&instance, "frame", arkit_names[i], channels[i])) return false;
    }
    return true;
}

int avatar_drive(AvatarInstance* instance, const AvatarFrame* frame) {
    if (!ready(instance)) return AVATAR_FAILED;
    if (instance->driver == nullptr) {
        instance->errors.set("driving", "it is not enabled; call avatar_enable_driving first");
        return AVATAR_FAILED;
    }
    AvatarFrame own;
    if (!take(frame, own)) instance->errors.set("frame", frame == nullptr ? "none is given" : not_sized);
    if (instance->errors.any() || !is_finite_frame(*instance, own)) return AVATAR_FAILED;
    instance->driver->pose(own, instance->pose);
    return AVATAR_OK;
}

int avatar_update_pose(AvatarInstance* instance) {
    if (!ready(instance)) return AVATAR_FAILED;
    if (!instance->has_finite_pose()) return AVATAR_FAILED;
    instance->update();
    return instance->has_finite_frame() && instance->update_light() ? AVATAR_OK : AVATAR_FAILED;
}

int avatar_update_camera(AvatarInstance* instance, const AvatarCamera* camera) {
    if (!ready(instance)) return AVATAR_FAILED;
    AvatarCamera own;
    if (const char* line = take_camera(camera, own)) instance->errors.set("", "%s", line);
    else if (!all_finite(instance->place, 16)) instance->errors.set("place", "has a number that is not finite");
    if (instance->errors.any()) return AVATAR_FAILED;
    double placed[16];
    instance->write_placed(placed);
    instance->values.set_camera(own, placed);
    return instance->update_light() ? AVATAR_OK : AVATAR_FAILED;
}

double avatar_height_px(const AvatarInstance* instance, const AvatarCamera* camera) {
    AvatarCamera own;
    if (instance == nullptr || instance->unusable || take_camera(camera, own) != nullptr) return HUGE_VAL;
    if (!all_finite(instance->place, 16) || !all_finite(instance->pose.world_from_avatar.data, 16)) return HUGE_VAL;
    double placed[16], posed[12];
    instance->write_placed(placed);
    multiply(posed, placed, instance->pose.world_from_avatar.data);
    for (int row = 0; row < 3 && instance->pack.avatar.left_handed; row++) posed[4 * row] = -posed[4 * row];
    return height_px(instance->pack.avatar.framing.whole, posed, own);
}

const float* avatar_pose_floats(const AvatarInstance* instance, uint32_t* count) {
    const bool usable = instance != nullptr && !instance->unusable;
    if (count != nullptr) *count = usable ? static_cast<uint32_t>(instance->poser.pose_floats.size) : 0;
    return usable ? instance->poser.pose_floats.data : nullptr;
}

const float* avatar_group_matrix(const AvatarInstance* instance) {
    return instance == nullptr || instance->unusable ? nullptr : instance->poser.groups.matrix.data;
}

const float* avatar_group_rotation(const AvatarInstance* instance) {
    return instance == nullptr || instance->unusable ? nullptr : instance->poser.groups.rotation.data;
}

const char* avatar_arkit_name(uint32_t channel) { return channel < arkit_channels ? arkit_names[channel] : nullptr; }

int32_t avatar_arkit_channel(const char* name) { return name == nullptr ? -1 : channel_of(name); }

int avatar_read_packet(const void* packet, size_t bytes, AvatarFrame* frame) {
    AvatarFrame made = {};
    return read_packet(static_cast<const uint8_t*>(packet), bytes, made) && give(made, frame) == AVATAR_OK;
}

int avatar_idle(double seconds, uint32_t seed, AvatarFrame* frame) {
    if (!(std::fabs(seconds) <= 1e15)) return AVATAR_FAILED;
    AvatarFrame made;
    write_idle(seconds, seed, made);
    return give(made, frame);
}

AvatarRecording* avatar_recording_open(const char* text, size_t bytes, const char* name, const AvatarAllocator* allocator) {
    AvatarRecording* made = open_handle<AvatarRecording>(allocator);
    if (made == nullptr) return nullptr;
    made->errors.set_owner(name != nullptr ? name : "the recording");
    if (text == nullptr) made->errors.set("", "no text is given");
    else if (bytes > INT32_MAX) made->errors.set("", "has more than 2147483647 bytes");
    else read_live_link_csv(Text(text, bytes), made->recording, made->arena);
    made->unusable = made->errors.any();
    return made;
}

void avatar_recording_close(AvatarRecording* recording) { close_handle(recording); }

const char* avatar_recording_error(const AvatarRecording* recording) { return line_of(recording); }

int avatar_recording_facts(const AvatarRecording* recording, AvatarRecordingFacts* out) {
    if (recording == nullptr || recording->unusable) return refuse(out);
    const Recording& of = recording->recording;
    const uint32_t frames = static_cast<uint32_t>(of.times.size);
    return give(AvatarRecordingFacts{sizeof(AvatarRecordingFacts), frames, of.without_face, of.fps, of.seconds(), of.times.data,
                                     of.channels.data},
                out);
}

int avatar_recording_sample(AvatarRecording* recording, double seconds, AvatarFrame* frame) {
    if (recording == nullptr || recording->unusable) return AVATAR_FAILED;
    AvatarFrame made = {};
    recording->recording.sample(seconds, made);
    return give(made, frame);
}
