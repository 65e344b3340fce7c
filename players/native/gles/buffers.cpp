#include "buffers.h"

namespace avatar {

static constexpr uint64_t least_bytes = 16;  // of a binding: kernels declare arrays of float4

static bool fill(const Gl& gl, ptrdiff_t size, const AvatarPack* pack, int64_t content) {
    void* into = gl.MapBufferRange(gl_copy_write_buffer, 0, size, gl_map_write | gl_map_invalidate_buffer);
    if (into == nullptr) return false;
    std::memset(into, 0, static_cast<size_t>(size));
    const bool good = content < 0 || avatar_buffer_content(pack, static_cast<uint32_t>(content), into) == AVATAR_OK;
    return gl.UnmapBuffer(gl_copy_write_buffer) != 0 && good;
}

uint32_t make_buffer(const Gl& gl, Errors& errors, const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content) {
    const uint64_t size = bytes < least_bytes ? least_bytes : (bytes + 15) / 16 * 16;
    if (size > static_cast<uint64_t>(gl.most_bytes)) {
        errors.set("OpenGL", "buffer %s takes %llu bytes; this GPU takes %lld in one buffer. Use a coarser level of detail.", name,
                   static_cast<unsigned long long>(bytes), static_cast<long long>(gl.most_bytes));
        return 0;
    }
    uint32_t made = 0;
    gl.GenBuffers(1, &made);
    gl.BindBuffer(gl_copy_write_buffer, made);
    gl.clear_errors();
    gl.BufferData(gl_copy_write_buffer, static_cast<ptrdiff_t>(size), nullptr, content >= 0 ? gl_static_draw : gl_dynamic_draw);
    if (gl.GetError() == 0 && fill(gl, static_cast<ptrdiff_t>(size), pack, content)) return made;
    gl.DeleteBuffers(1, &made);
    errors.set("OpenGL", "buffer %s: the GPU has no %llu bytes left, or its context is lost", name,
               static_cast<unsigned long long>(bytes));
    return 0;
}

}  // namespace avatar
