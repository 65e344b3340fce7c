#pragma once
#include "../include/avatar_light.h"
#include "recorded.h"

namespace avatar {

/// Everything that residents need of their scene.
struct Context {
    Device& device;
    Errors& errors;
    const AvatarAllocator& allocator;
};

/// Buffers with content of a pack: shared by its instances, uploaded when a pass first binds them.
struct SharedBuffers {
    SharedBuffers(Context given, const AvatarPack* of);

    /// The buffer of an index; 0 with an error.
    Handle get(const Context& context, uint32_t index, const AvatarBuffer& declared);
    void release(Device& device);

    const AvatarPack* pack;
    uint32_t users = 0;
    SharedBuffers* next = nullptr;

private:
    Arena arena_;
    Span<Handle> buffers_;  // of the pack, by index; 0: not uploaded
};

/// What an instance holds on a device at one level: its own buffers and its passes.
class Resident {
public:
    Resident(Context context, SharedBuffers* shared, AvatarInstance* instance);
    ~Resident();
    Resident(const Resident&) = delete;
    Resident& operator=(const Resident&) = delete;

    /// Makes and uploads everything. On an error, what was made is freed with it.
    bool make();

    /// Takes the pose of the instance and deforms it if it has changed.
    bool pose(const Clock& clock);

    /// Projects what a camera sees and lights it, if that has changed; then `projected` is true.
    bool view(const AvatarCamera& camera, const Clock& clock, bool& projected);

    /// Chunks of the level, and the buffer of projected splats of one.
    uint32_t chunks() const;
    bool chunk(uint32_t index, Handle& projected, uint32_t& count);

    void release();

    AvatarInstance* const instance;
    SharedBuffers* const shared;
    const uint32_t level;
    bool shown = true;
    Resident* next = nullptr;

private:
    enum { lists = 5 };  // AVATAR_MESH .. AVATAR_LIGHT; the last two are made when a light is first set

    static Handle find(void* user, const AvatarBinding& binding);
    Handle buffer(uint32_t index);
    bool make_list(uint32_t list);
    bool upload_pose();
    bool cast_shadow(const Clock& clock, bool& changed);
    bool take_light(const Clock& clock, bool& changed);
    void set(uint32_t list, bool& changed);
    bool take_error(const char* line);

    Context context_;
    Arena arena_;
    AvatarPasses* passes_[lists] = {};
    RecordedList recorded_[lists];
    Span<Handle> own_;  // writable buffers, by index; 0: not made
    Span<float> last_pose_;
    Handle pose_buffer_ = 0;
    bool reads_mesh_ = false;
    bool ran_ = false;       // all passes of deform have run once
    bool deformed_ = false;  // since they were last projected
    bool moved_ = true;      // since the shadow was last cast
    int lighting_ = AVATAR_UNLIT;  // when they were last projected
};

}  // namespace avatar
