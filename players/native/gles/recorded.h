#pragma once
#include "../src/formats/memory.h"
#include "programs.h"

namespace avatar {

/// Called after each stage when it is measured; see avatar_gles_set_clock.
struct Clock {
    void (*ended)(void* user, const char* stage) = nullptr;
    void* user = nullptr;

    /// Waits for the GPU and reports its time, if somebody measures.
    void end(const Gl& gl, const char* stage) const {
        if (ended == nullptr) return;
        gl.Finish();
        ended(user, stage);
    }
};

/// Finds the GL buffer of a binding; 0: there is none, and the error is set.
struct BufferFinder {
    uint32_t (*find)(void* user, const AvatarBinding& binding);
    void* user;
};

/// A list of dispatches with their programs, buffers and uniform blocks, ready to run.
class RecordedPasses {
public:
    /// Compiles and binds. `passes` must outlive it; `arena` gives the memory. On an error, release what was made.
    bool make(const Gl& gl, Programs& programs, const AvatarPasses* passes, BufferFinder finder, Arena& arena);

    /// Uploads the constants, after they changed.
    void upload(const Gl& gl) const;

    /// Runs dispatches `first` to `end`, with a barrier wherever one needs what others wrote.
    void run(const Gl& gl, uint32_t first, uint32_t end, const Clock& clock) const;

    /// Runs all.
    void run(const Gl& gl, const Clock& clock) const { run(gl, 0, static_cast<uint32_t>(steps_.size), clock); }

    /// Whether a dispatch binds a buffer of that name.
    bool binds(Text buffer) const;

    const AvatarPasses* passes() const { return passes_; }

    void release(const Gl& gl);

private:
    static constexpr uint32_t most_bindings = 8;

    struct Bound {
        uint32_t binding, buffer;
        bool read_only;
    };

    struct Step {
        AvatarDispatch dispatch;
        uint32_t program;
        Bound bound[most_bindings];
        uint32_t count;
        bool waits;  // for earlier ones
    };

    bool make_step(uint32_t index, Programs& programs, BufferFinder finder, Errors& errors);
    bool must_wait(size_t since, size_t index) const;

    const AvatarPasses* passes_ = nullptr;
    Span<Step> steps_;
    uint32_t blocks_ = 0;
};

}  // namespace avatar
