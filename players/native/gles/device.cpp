#include "device.h"

#include "buffers.h"

namespace avatar {

static uint32_t name_of(Handle object) { return static_cast<uint32_t>(object); }

bool GlesDevice::load(Errors& errors, AvatarGlesLoad function) {
    if (!gl.load(function, errors) || !image.make(errors)) return false;
    const uint8_t* name = gl.GetString(gl_renderer);
    std::strncpy(renderer, name != nullptr ? reinterpret_cast<const char*>(name) : "", sizeof renderer - 1);
    return true;
}

Handle GlesDevice::make_buffer(Errors& errors, const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content) {
    return avatar::make_buffer(gl, errors, name, bytes, pack, content);
}

void GlesDevice::write_buffer(Handle buffer, const void* bytes, size_t size) {
    if (size == 0) return;
    gl.BindBuffer(gl_copy_write_buffer, name_of(buffer));
    gl.BufferSubData(gl_copy_write_buffer, 0, static_cast<ptrdiff_t>(size), bytes);
}

bool GlesDevice::read_buffer(Errors& errors, Handle buffer, void* bytes, size_t size) {
    if (size == 0) return true;
    gl.MemoryBarrier(gl_buffer_update_barrier);
    gl.BindBuffer(gl_copy_write_buffer, name_of(buffer));
    const void* from = gl.MapBufferRange(gl_copy_write_buffer, 0, static_cast<ptrdiff_t>(size), gl_map_read);
    if (from != nullptr) std::memcpy(bytes, from, size);
    if (from != nullptr && gl.UnmapBuffer(gl_copy_write_buffer) != 0) return true;
    errors.set("OpenGL", "a buffer cannot be read: its context is lost");
    return false;
}

void GlesDevice::free_buffer(Handle buffer) {
    const uint32_t name = name_of(buffer);
    gl.DeleteBuffers(1, &name);
}

bool GlesDevice::make_list(Errors& errors, RecordedList& list) {
    for (RecordedStep& step : list.steps) {
        step.kernel = programs.kernel(errors, step.dispatch.entry);
        if (step.kernel == 0) return false;
    }
    size_t bytes = 0;
    avatar_passes_blocks(list.passes, &bytes);
    list.blocks = make_buffer(errors, "of constants", bytes, nullptr, -1);
    return list.blocks != 0;
}

void GlesDevice::upload(const RecordedList& list) {
    size_t bytes = 0;
    const void* blocks = avatar_passes_blocks(list.passes, &bytes);
    write_buffer(list.blocks, blocks, bytes);
}

void GlesDevice::run(const RecordedList& list, uint32_t first, uint32_t end, const Clock& clock) {
    for (uint32_t i = first; i < end; i++) {
        const RecordedStep& step = list.steps[i];
        const AvatarDispatch& dispatch = step.dispatch;
        if (step.waits || i == first) gl.MemoryBarrier(gl_storage_barrier);
        for (uint32_t b = 0; b < step.count; b++) {
            gl.BindBufferBase(gl_storage_buffer, step.bound[b].binding, name_of(step.bound[b].buffer));
        }
        const ptrdiff_t bytes = static_cast<ptrdiff_t>((dispatch.block_bytes + 15) / 16 * 16);  // drivers round up, too
        const ptrdiff_t offset = static_cast<ptrdiff_t>(dispatch.block_offset);
        gl.BindBufferRange(gl_uniform_buffer, dispatch.block_binding, name_of(list.blocks), offset, bytes);
        gl.UseProgram(name_of(step.kernel));
        gl.DispatchCompute(dispatch.groups, 1, 1);
        const bool last = i + 1 == end || std::strcmp(list.steps[i + 1].dispatch.stage, dispatch.stage) != 0;
        if (last) clock.end(*this, dispatch.stage);
    }
}

void GlesDevice::free_list(RecordedList& list) {
    if (list.blocks != 0) free_buffer(list.blocks);
}

bool GlesDevice::draw(Errors& errors, Handle quads, uint32_t count, int32_t width, int32_t height, float* rgba) {
    if (!image.begin(errors, width, height, nullptr)) return false;
    image.quads(name_of(quads), count);
    return image.read(errors, rgba);
}

void GlesDevice::release() {
    programs.release();
    image.release();
}

}  // namespace avatar
