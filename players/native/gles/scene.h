#pragma once
#include "../src/c_interface/play_handles.h"
#include "sorted.h"
#include "stage_runner.h"

/// A scene in a context: see avatar_gles.h.
struct AvatarGles : avatar::HandleBase {
    AvatarGles(const AvatarAllocator& given, AvatarGlesLoad function);
    ~AvatarGles();
    AvatarGles(const AvatarGles&) = delete;
    AvatarGles& operator=(const AvatarGles&) = delete;

    /// Begins a call: forgets the error of the last one. False for a scene that cannot be used.
    bool begin();

    bool add(const AvatarPack* pack, AvatarInstance* instance);
    bool remove(const AvatarInstance* instance);
    bool show(const AvatarInstance* instance, bool shown);
    bool pose();
    bool view(const AvatarCamera* camera, const AvatarGlesDepth* depth);
    bool restore();
    void forget();

    avatar::Gl gl = {};
    avatar::Programs programs;
    avatar::Draw draw;
    avatar::StageRunner runner;
    avatar::Clock clock;
    char renderer[128] = "";

private:
    /// Where the context was lost, or never was.
    bool is_lost_ = false;

    bool load();
    void release();
    avatar::Context context() { return {gl, programs, errors, allocator}; }
    avatar::Resident** place_of(const AvatarInstance* instance);
    avatar::SharedBuffers* shared_of(const AvatarPack* pack);
    avatar::Resident* uploaded(avatar::SharedBuffers* shared, AvatarInstance* instance);
    bool upload_again(avatar::Resident** place);
    bool follow_levels();
    bool sort();
    void drop(avatar::Resident* resident);
    void drop_unused(avatar::SharedBuffers* shared);
    void forget_order();

    AvatarGlesLoad load_;
    avatar::Resident* first_ = nullptr;
    avatar::SharedBuffers* packs_ = nullptr;
    avatar::Sorted* sorted_ = nullptr;  // null: to be made
};
