#pragma once
#include "../scene/device.h"
#include "draw.h"

namespace avatar {

/// A context of OpenGL: its functions, its programs, and the image.
class GlesDevice final : public Device {
public:
    ~GlesDevice() { release(); }

    /// Takes the context that is current, and compiles what draws.
    bool load(Errors& errors, AvatarGlesLoad function);

    Handle make_buffer(Errors& errors, const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content) override;
    void write_buffer(Handle buffer, const void* bytes, size_t size) override;
    bool read_buffer(Errors& errors, Handle buffer, void* bytes, size_t size) override;
    void free_buffer(Handle buffer) override;
    bool make_list(Errors& errors, RecordedList& list) override;
    void upload(const RecordedList& list) override;
    void run(const RecordedList& list, uint32_t first, uint32_t end, const Clock& clock) override;
    void free_list(RecordedList& list) override;
    bool draw(Errors& errors, Handle quads, uint32_t count, int32_t width, int32_t height, float* rgba) override;
    void finish() override { gl.Finish(); }

    /// Frees the programs and the image.
    void release();

    Gl gl = {};
    Programs programs{gl};
    Draw image{gl, programs};
    char renderer[128] = "";
};

}  // namespace avatar
