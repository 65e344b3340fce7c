#pragma once
#include "../drive/driver.h"
#include "../drive/recording.h"
#include "../play/scene_sort.h"
#include "handles.h"

struct AvatarInstance : avatar::HandleBase {
    AvatarInstance(const AvatarAllocator& given, const AvatarPack& of, uint32_t at);

    /// Stage joints: the floats and the values of the pose.
    void update();
    /// Scene from the pack's frame, [4, 4]: the one place where a left-handed pack is mirrored. Its x points the other way
    /// than the person's.
    void write_placed(double* into) const;
    /// The values of the light for the place and the pose. Sets the error.
    bool update_light();
    /// Whether every number of the pose is finite. Sets the error.
    bool has_finite_pose();
    /// Whether the results of stage joints are. Sets the error.
    bool has_finite_frame();
    void set_no_level(uint32_t at);
    void set_no_such_expression(avatar::Text name);

    const AvatarPack& pack;
    uint32_t level = 0;
    avatar::Pose pose;
    avatar::Poser poser;
    avatar::FrameValues values;
    avatar::Driver drivers[2];  // of free expressions, and within their ranges; made once each
    bool has_driver[2] = {false, false};
    avatar::Driver* driver = nullptr;  // null: driving is not enabled
    double place[16];
    AvatarLight light;
    bool has_light = false;
    bool casts = false;  // the light has a shadow map
};

/// Whether an instance can be used; then it has no error yet.
inline bool ready(AvatarInstance* instance) {
    if (instance == nullptr || instance->unusable) return false;
    instance->errors.clear();
    return true;
}

struct AvatarRecording : avatar::HandleBase {
    using HandleBase::HandleBase;

    avatar::Recording recording = {};
};

struct AvatarPasses : avatar::HandleBase {
    using HandleBase::HandleBase;

    avatar::PassList list;
    const AvatarPack* of = nullptr;  // whose frames it takes; null: it takes none
};

struct AvatarSort : avatar::HandleBase {
    AvatarSort(const AvatarAllocator& given, const AvatarSceneChunk* chunks, uint32_t count);

    avatar::SceneSort sort;
    AvatarPasses passes;  // those of the sort
};
