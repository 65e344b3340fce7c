#pragma once
#include "../src/c_interface/play_handles.h"
#include "sorted.h"

namespace avatar {

/// Avatars that are sorted and drawn together on a device. What returns false sets the error. One thread at a time.
/// Packs and instances that are added must live until they are removed or the scene ends.
class Scene : public HandleBase {
public:
    Scene(const AvatarAllocator& given, Device& device) : HandleBase(given), device_(device) {}
    ~Scene();
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

    /// Forgets the error of the last call.
    void begin();

    /// Uploads an instance of the pack at its level, and the pack where no other instance has. It is shown.
    bool add(const AvatarPack* pack, AvatarInstance* instance);

    /// Frees what it held; a pack's buffers with its last instance.
    bool remove(const AvatarInstance* instance);

    /// Shows or hides it; what it holds stays.
    bool show(const AvatarInstance* instance, bool shown);

    /// Once a pose: takes the poses of what is shown and deforms those that changed. A level that was set is uploaded.
    bool pose();

    /// Once a camera, one of take_camera: projects, sorts and gathers what is to be drawn, if anything changed.
    bool order(const AvatarCamera& camera);

    /// What the newest `order` gathered: buffer "Quads" and its splats. 0: nothing yet.
    Handle quads() const { return sorted_ == nullptr ? 0 : sorted_->quads(); }
    uint32_t count() const { return sorted_ == nullptr ? 0 : sorted_->count(); }

    /// Frees everything on the device. Afterwards `restore` uploads it again, or the scene ends.
    void release();
    bool restore();

    Context context() { return {device_, errors, allocator}; }

    Clock clock;

private:
    Resident** place_of(const AvatarInstance* instance);
    SharedBuffers* shared_of(const AvatarPack* pack);
    Resident* uploaded(SharedBuffers* shared, AvatarInstance* instance);
    bool upload_again(Resident** place);
    bool follow_levels();
    bool sort();
    void drop(Resident* resident);
    void drop_unused(SharedBuffers* shared);
    void forget_order();

    Device& device_;
    Resident* first_ = nullptr;
    SharedBuffers* packs_ = nullptr;
    Sorted* sorted_ = nullptr;  // null: to be made
};

}  // namespace avatar
