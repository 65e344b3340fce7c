// A pack with a pose that two threads share: the main thread sets it, the render thread takes it.
#pragma once
#include <atomic>
#include <mutex>

#include "engine/memory.h"

namespace godot {

/// A sound pack that several avatars show: on the GPU once a world.
class SharedPack {
public:
    explicit SharedPack(AvatarPack* given) : pack(given) {}
    void hold() { references_.fetch_add(1); }
    void release() {
        if (references_.fetch_sub(1) == 1) delete this;
    }

    AvatarPack* const pack;

private:
    ~SharedPack() { avatar_close(pack); }

    std::atomic<uint32_t> references_{1};
};

class Posed {
public:
    /// Takes a reference of a pack. The maker holds the first reference of this.
    explicit Posed(SharedPack* shared);
    void hold() { references_.fetch_add(1); }
    void release();

    SharedPack* const shared;
    AvatarPack* const pack;

    /// Takes the pose and the level of the main thread's instance, if they changed.
    void put(AvatarInstance* from, int32_t level);
    /// Gives them to an instance of the render thread, if they are newer than `seen`. True: it was given.
    bool take(AvatarInstance* into, uint64_t& seen, int32_t& level);

private:
    ~Posed();
    struct Part {
        void* data;
        size_t bytes;
    };
    static constexpr int part_count = 4;

    void parts_of(AvatarInstance* instance, Part* out) const;

    std::atomic<uint32_t> references_{1};
    std::mutex mutex_;
    uint8_t* bytes_ = nullptr;
    size_t size_ = 0;
    int32_t level_ = 0;
    uint64_t version_ = 1;
};

}  // namespace godot
