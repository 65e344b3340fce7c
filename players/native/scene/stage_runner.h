#pragma once
#include "../include/avatar_conform.h"
#include "resident.h"

namespace avatar {

/// Holds the buffers of a pack and of a scene by their names and runs single dispatches: what avatar_conform calls.
class StageRunner {
public:
    explicit StageRunner(Context context) : context_(context), arena_(context.allocator, context.errors) {}
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
        Handle buffer;
    };

    bool load(const AvatarPack* pack, const AvatarSort* scene);
    bool add(const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content);
    Handle buffer(const char* name);
    static Handle find(void* user, const AvatarBinding& binding);
    const RecordedList* recorded(const AvatarPasses* passes);

    Context context_;
    Arena arena_;
    Span<Known> buffers_;
    size_t count_ = 0;
    RecordedList lists_[most_lists];
    uint32_t list_count_ = 0;
};

}  // namespace avatar
