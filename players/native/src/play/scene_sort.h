#pragma once
#include "pass_list.h"

namespace avatar {

/// Stage sort of all splats of a scene, and the gather that writes the quads which draw them back to front: one stable
/// radix sort without wave operations.
class SceneSort {
public:
    /// The sort of chunks that follow each other; an id counts through all of them. The arena's error is set for more
    /// splats than one dispatch or one buffer has, and where there is no memory.
    void make(Span<AvatarSceneChunk> chunks, Arena& arena);

    uint32_t count = 0;            // all splats
    AvatarSceneBuffer buffers[4];  // Pairs, PairsOut, Counts, Quads
    PassList passes;               // the sort, then the gathers
    uint32_t sort_dispatches = 0;  // those that follow gather

private:
    struct Given {
        const char* name;
        uint32_t value;
    };

    Pass pass(const char* entry, const NamePair* bound, size_t buffer_count, const Given* given, size_t given_count,
              Arena& arena);
    void add(Pass made, uint32_t groups, Arena& arena);

    Span<Dispatched> list_;
    size_t added_ = 0;
};

}  // namespace avatar
