#pragma once
#include "resident.h"

namespace avatar {

/// The order of all splats that are shown, and the quads that draw them back to front. It is made anew for other avatars.
class Sorted {
public:
    explicit Sorted(Context context) : context_(context), arena_(context.allocator, context.errors) {}
    ~Sorted();
    Sorted(const Sorted&) = delete;
    Sorted& operator=(const Sorted&) = delete;

    /// Of the residents that are shown, of a list that begins at `first`.
    bool make(Resident* first);

    /// Sorts and gathers.
    void run(const Clock& clock);

    /// Whether it has run.
    bool ran() const { return ran_; }

    uint32_t count() const { return count_; }
    Handle quads() const { return buffers_[quads_index]; }

private:
    enum { buffer_count = 4, quads_index = 3 };

    static Handle find(void* user, const AvatarBinding& binding);
    bool take_chunks(Resident* first);

    Context context_;
    Arena arena_;
    AvatarSort* sort_ = nullptr;
    RecordedList recorded_;
    Span<AvatarSceneChunk> chunks_;
    Span<Handle> projected_;  // by chunk
    Handle buffers_[buffer_count] = {};
    uint32_t count_ = 0;
    bool ran_ = false;
};

}  // namespace avatar
