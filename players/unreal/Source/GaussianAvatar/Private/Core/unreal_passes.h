#pragma once
#include <vector>

#include "unreal_scene.h"

namespace avatar_unreal {

/// One list of passes of an instance, with the buffers of each dispatch.
class PassList {
public:
    /// A list of a level of a pack; `owner` is the avatar's id.
    PassList(const Pack& pack, uint32_t owner, uint32_t level, uint32_t list);
    /// The passes of a sort, which the sort owns; `others` are the buffers of its chunks, by the names that it got.
    PassList(const AvatarSort* sort, const std::map<std::string, BufferUse>& others);
    ~PassList();
    PassList(const PassList&) = delete;
    PassList& operator=(const PassList&) = delete;

    /// Null, or why there are no passes.
    const char* error() const { return avatar_passes_error(passes); }

    /// Takes the values of a frame. Whether one has changed.
    bool set(const AvatarInstance* instance) { return owned != nullptr && avatar_passes_set(owned, instance) == 1; }
    /// See avatar_passes_keep_lasting.
    bool keep_lasting() { return owned != nullptr && avatar_passes_keep_lasting(owned) == 1; }
    void run(Device& device) const;

private:
    AvatarPasses* owned;
    const AvatarPasses* passes;
    struct Run {
        AvatarDispatch dispatch;
        std::vector<Bound> bound;
    };
    template <class BufferOf>
    void find(BufferOf buffer_of);

    std::vector<Run> runs;
};

/// A buffer of a pack, as an avatar uses it.
BufferUse pack_buffer(const AvatarPack* pack, uint32_t owner, uint32_t index);
/// A buffer of a sort.
BufferUse sort_buffer(const AvatarSort* sort, uint32_t index);

}  // namespace avatar_unreal
