#pragma once
#include "draw.h"
#include "resident.h"

namespace avatar {

/// Holds the buffers of a pack and of a scene by their names and runs single dispatches: what avatar_conform calls.
class StageRunner {
public:
    StageRunner(Context context, Draw& draw) : context_(context), draw_(draw), arena_(context.allocator, context.errors) {}
    ~StageRunner() { release(); }
    StageRunner(const StageRunner&) = delete;
    StageRunner& operator=(const StageRunner&) = delete;

    /// The functions; `user` is this runner.
    AvatarStageRunner functions();

    void release();

private:
    static constexpr uint32_t most_lists = 8;

    struct Known {
        const char* name;
        uint32_t buffer;
    };

    bool load(const AvatarPack* pack, const AvatarSort* scene);
    bool add(const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content);
    uint32_t buffer(const char* name);
    static uint32_t find(void* user, const AvatarBinding& binding);
    RecordedPasses* recorded(const AvatarPasses* passes);

    Context context_;
    Draw& draw_;
    Arena arena_;
    Span<Known> buffers_;
    size_t count_ = 0;
    RecordedPasses lists_[most_lists];
    uint32_t list_count_ = 0;
};

}  // namespace avatar
