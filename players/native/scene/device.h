#pragma once
#include "../src/formats/memory.h"

namespace avatar {

/// An object of a device: a buffer, a kernel, what a dispatch binds. 0: none.
using Handle = uint64_t;

class Device;

/// Called after each stage when it is measured.
struct Clock {
    void (*ended)(void* user, const char* stage) = nullptr;
    void* user = nullptr;

    /// Waits for the GPU and reports its time, if somebody measures.
    void end(Device& device, const char* stage) const;
};

/// A dispatch with its kernel and its buffers.
struct RecordedStep {
    static constexpr uint32_t most_bindings = 8;

    struct Bound {
        uint32_t binding;
        Handle buffer;
        bool read_only;
    };

    AvatarDispatch dispatch;
    Bound bound[most_bindings];
    uint32_t count;
    bool waits;       // for earlier ones
    Handle kernel;    // of the device
    Handle bindings;  // of the device, where it makes an object of them
    Handle block;     // of the device, where each dispatch has a uniform buffer of its own
};

/// A list of dispatches as a device runs it.
struct RecordedList {
    const AvatarPasses* passes = nullptr;
    Span<RecordedStep> steps;
    Handle blocks = 0;  // of the device, where one buffer holds all uniform blocks
};

/// What a GPU does for a scene of avatars. Each function sets the error where it fails.
class Device {
public:
    /// A storage buffer of zeros, or with the content of a pack's buffer (`content` 0 or more). 0 where the device takes no
    /// such buffer or has no memory.
    virtual Handle make_buffer(Errors& errors, const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content) = 0;
    /// Writes the first bytes of a buffer.
    virtual void write_buffer(Handle buffer, const void* bytes, size_t size) = 0;
    /// Reads them: it waits for the GPU.
    virtual bool read_buffer(Errors& errors, Handle buffer, void* bytes, size_t size) = 0;
    virtual void free_buffer(Handle buffer) = 0;

    /// Kernels, uniform blocks and bindings of a list whose steps have their dispatches and buffers.
    virtual bool make_list(Errors& errors, RecordedList& list) = 0;
    /// Uploads the constants (avatar_passes_blocks): once after make_list, and where they changed.
    virtual void upload(const RecordedList& list) = 0;
    /// Runs dispatches `first` to `end`, with a barrier wherever one waits.
    virtual void run(const RecordedList& list, uint32_t first, uint32_t end, const Clock& clock) = 0;
    /// Frees what make_list made, also a part of it.
    virtual void free_list(RecordedList& list) = 0;

    /// Draws quads of a buffer into a float image of zeros and reads it: [height, width, 4], first row on top.
    virtual bool draw(Errors& errors, Handle quads, uint32_t count, int32_t width, int32_t height, float* rgba) = 0;
    /// Waits for the GPU.
    virtual void finish() = 0;

protected:
    ~Device() = default;
};

inline void Clock::end(Device& device, const char* stage) const {
    if (ended == nullptr) return;
    device.finish();
    ended(user, stage);
}

}  // namespace avatar
