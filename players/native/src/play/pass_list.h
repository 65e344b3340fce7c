#pragma once
#include "frame_values.h"

namespace avatar {

/// A pass to be dispatched: its buffers by name, with their numbers.
struct Dispatched {
    const Pass* pass;
    uint32_t groups;  // thread groups
};

/// A dispatch, with the lists that it counts.
struct DispatchRow {
    AvatarDispatch dispatch;
    Span<AvatarBinding> bindings;
    Span<AvatarConstant> constants;
};

/// Dispatches that follow each other, with their uniform blocks in one array. set and keep_lasting allocate nothing.
class PassList {
public:
    /// Makes the list; values of the frame are 0 until set. `layout` may be null where no pass asks for one. `scene` has
    /// the names of buffers that belong to a scene; of others the number is that of the bound buffer. The arena's error
    /// is set where there is no memory.
    void make(Span<Dispatched> passes, const FrameLayout* layout, const Names* scene, Arena& arena);

    /// Copies what the frame gives. Returns whether a value has changed.
    bool set(const FrameValues& values);
    /// When the dispatches have run once: SH that no expression changes stay in their buffer, and blend, whose work
    /// they mostly are, reads none of them. Returns whether a value has changed.
    bool keep_lasting();

    Span<DispatchRow> dispatches;
    Span<uint8_t> blocks;

private:
    struct Copied {
        size_t from;  // of the frame's floats
        size_t to;    // byte of the blocks
        uint32_t count;
    };

    void make_dispatch(size_t index, const Dispatched& one, const FrameLayout* layout, const Names* scene, Arena& arena);
    void set_constant(size_t at, const Constant& value, ConstantType type, const FrameLayout* layout);

    Span<Copied> copies_;
    Span<size_t> lasting_;  // bytes of the blocks: sh_terms where no expression changes SH
    size_t copy_count_ = 0, lasting_count_ = 0;
};

/// Thread groups of that many threads each.
inline uint32_t groups_of(double rows, uint32_t threads_of_group) {
    return static_cast<uint32_t>((static_cast<uint64_t>(rows) + threads_of_group - 1) / threads_of_group);
}

/// The passes of a list of a program, ready for PassList::make.
Span<Dispatched> dispatched(Span<Pass> passes, Arena& arena);

}  // namespace avatar
