#include "recorded.h"

namespace avatar {

static bool take_step(const AvatarPasses* passes, uint32_t index, BufferFinder finder, Errors& errors,
                      RecordedStep& step) {
    AvatarDispatch& dispatch = step.dispatch = AvatarDispatch{};
    avatar_dispatch(passes, index, &dispatch);
    constexpr uint32_t most = RecordedStep::most_bindings;
    if (dispatch.binding_count > most) {
        errors.set(dispatch.entry, "binds %u buffers; this player has room for %u", dispatch.binding_count, most);
        return false;
    }
    step.count = dispatch.binding_count;
    for (uint32_t b = 0; b < step.count; b++) {
        AvatarBinding one;
        avatar_binding(passes, index, b, &one);
        step.bound[b] = {one.binding, finder.find(finder.user, one), one.read_only != 0};
        if (step.bound[b].buffer == 0) return false;
    }
    return true;
}

/// Whether a step touches what a step since the last barrier wrote, or writes what one read.
static bool must_wait(Span<RecordedStep> steps, size_t since, size_t index) {
    const RecordedStep& now = steps[index];
    for (size_t i = since; i < index; i++) {
        for (uint32_t a = 0; a < steps[i].count; a++) {
            for (uint32_t b = 0; b < now.count; b++) {
                const bool writes = !steps[i].bound[a].read_only || !now.bound[b].read_only;
                if (writes && steps[i].bound[a].buffer == now.bound[b].buffer) return true;
            }
        }
    }
    return false;
}

bool record(Device& device, const AvatarPasses* passes, BufferFinder finder, Arena& arena, RecordedList& into) {
    const uint32_t count = avatar_passes_count(passes);
    Span<RecordedStep> steps = arena.make<RecordedStep>(count);
    if (arena.errors().any()) return false;
    size_t since = 0;  // the last barrier
    for (uint32_t i = 0; i < count; i++) {
        if (!take_step(passes, i, finder, arena.errors(), steps[i])) return false;
        steps[i].waits = must_wait(steps, since, i);
        if (steps[i].waits) since = i;
    }
    into.passes = passes;
    into.steps = steps;
    if (!device.make_list(arena.errors(), into)) return false;
    device.upload(into);
    return true;
}

bool binds(const RecordedList& list, Text buffer) {
    AvatarBinding one;
    for (uint32_t i = 0; i < list.steps.size; i++) {
        for (uint32_t b = 0; avatar_binding(list.passes, i, b, &one) == AVATAR_OK; b++) {
            if (buffer == Text(one.buffer)) return true;
        }
    }
    return false;
}

void run_all(Device& device, const RecordedList& list, const Clock& clock) {
    device.run(list, 0, static_cast<uint32_t>(list.steps.size), clock);
}

void free_recorded(Device& device, RecordedList& list) {
    if (list.passes != nullptr) device.free_list(list);
    list = RecordedList();
}

}  // namespace avatar
