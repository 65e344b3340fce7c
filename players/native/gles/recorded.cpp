#include "recorded.h"

#include "buffers.h"

namespace avatar {

bool RecordedPasses::make(const Gl& gl, Programs& programs, const AvatarPasses* passes, BufferFinder finder, Arena& arena) {
    passes_ = passes;
    const uint32_t count = avatar_passes_count(passes);
    Span<Step> steps = arena.make<Step>(count);
    if (arena.errors().any()) return false;
    steps_ = steps;
    size_t since = 0;  // the last barrier
    for (uint32_t i = 0; i < count; i++) {
        if (!make_step(i, programs, finder, arena.errors())) return false;
        steps[i].waits = must_wait(since, i);
        if (steps[i].waits) since = i;
    }
    size_t bytes = 0;
    avatar_passes_blocks(passes, &bytes);
    if (blocks_ == 0) blocks_ = make_buffer(gl, arena.errors(), "of constants", bytes);
    if (blocks_ == 0) return false;
    upload(gl);
    return true;
}

bool RecordedPasses::make_step(uint32_t index, Programs& programs, BufferFinder finder, Errors& errors) {
    Step& step = steps_[index];
    AvatarDispatch& dispatch = step.dispatch = AvatarDispatch{};
    avatar_dispatch(passes_, index, &dispatch);
    step.program = programs.kernel(dispatch.entry);
    if (step.program == 0) return false;
    if (dispatch.binding_count > most_bindings) {
        errors.set(dispatch.entry, "binds %u buffers; this player has room for %u", dispatch.binding_count, most_bindings);
        return false;
    }
    step.count = dispatch.binding_count;
    for (uint32_t b = 0; b < step.count; b++) {
        AvatarBinding one;
        avatar_binding(passes_, index, b, &one);
        step.bound[b] = {one.binding, finder.find(finder.user, one), one.read_only != 0};
        if (step.bound[b].buffer == 0) return false;
    }
    return true;
}

/// Whether a step touches what a step since the last barrier wrote, or writes what one read.
bool RecordedPasses::must_wait(size_t since, size_t index) const {
    const Step& now = steps_[index];
    for (size_t i = since; i < index; i++) {
        for (uint32_t a = 0; a < steps_[i].count; a++) {
            for (uint32_t b = 0; b < now.count; b++) {
                const bool writes = !steps_[i].bound[a].read_only || !now.bound[b].read_only;
                if (writes && steps_[i].bound[a].buffer == now.bound[b].buffer) return true;
            }
        }
    }
    return false;
}

void RecordedPasses::upload(const Gl& gl) const {
    size_t bytes = 0;
    const void* blocks = avatar_passes_blocks(passes_, &bytes);
    write_buffer(gl, blocks_, blocks, bytes);
}

void RecordedPasses::run(const Gl& gl, uint32_t first, uint32_t end, const Clock& clock) const {
    for (uint32_t i = first; i < end; i++) {
        const Step& step = steps_[i];
        const AvatarDispatch& dispatch = step.dispatch;
        if (step.waits || i == first) gl.MemoryBarrier(gl_storage_barrier);
        for (uint32_t b = 0; b < step.count; b++) gl.BindBufferBase(gl_storage_buffer, step.bound[b].binding, step.bound[b].buffer);
        const ptrdiff_t bytes = static_cast<ptrdiff_t>((dispatch.block_bytes + 15) / 16 * 16);  // drivers round up, too
        gl.BindBufferRange(gl_uniform_buffer, dispatch.block_binding, blocks_, static_cast<ptrdiff_t>(dispatch.block_offset), bytes);
        gl.UseProgram(step.program);
        gl.DispatchCompute(dispatch.groups, 1, 1);
        const bool last = i + 1 == end || std::strcmp(steps_[i + 1].dispatch.stage, dispatch.stage) != 0;
        if (last) clock.end(gl, dispatch.stage);
    }
}

bool RecordedPasses::binds(Text buffer) const {
    AvatarBinding one;
    for (uint32_t i = 0; i < steps_.size; i++) {
        for (uint32_t b = 0; avatar_binding(passes_, i, b, &one) == AVATAR_OK; b++) {
            if (buffer == Text(one.buffer)) return true;
        }
    }
    return false;
}

void RecordedPasses::release(const Gl& gl) {
    if (blocks_ != 0) gl.DeleteBuffers(1, &blocks_);
    blocks_ = 0;
}

}  // namespace avatar
