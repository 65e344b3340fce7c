// The functions of avatar_player.h that make lists of passes.
#include "../formats/sized.h"
#include "play_handles.h"

using namespace avatar;

AvatarSort::AvatarSort(const AvatarAllocator& given, const AvatarSceneChunk* chunks, uint32_t count)
    : HandleBase(given), passes(given) {
    errors.set_owner("the scene");
    const uint32_t stride = size_of(chunks);
    if (stride == 0 && count > 0) errors.set("", chunks == nullptr ? "no chunks are given" : not_sized);
    Span<AvatarSceneChunk> own = errors.any() ? Span<AvatarSceneChunk>{} : arena.make<AvatarSceneChunk>(count);
    for (uint32_t i = 0; i < count && !errors.any(); i++) {
        take(reinterpret_cast<const AvatarSceneChunk*>(reinterpret_cast<const char*>(chunks) + size_t{stride} * i), own[i]);
        if (own[i].buffer == nullptr) errors.set("", "chunk %u has no name of a buffer", i);
    }
    if (!errors.any()) sort.make(own, arena);
    passes.list = sort.passes;
    passes.unusable = unusable = errors.any();
}

AvatarPasses* avatar_passes_open(const AvatarPack* pack, uint32_t level, uint32_t list, const AvatarAllocator* allocator) {
    AvatarPasses* made = open_handle<AvatarPasses>(allocator);
    if (made == nullptr) return nullptr;
    Errors& errors = made->errors;
    if (pack == nullptr || pack->unusable) {
        errors.set("", "its pack could not be loaded");
    } else if (level >= pack->avatar.levels.size || list > AVATAR_LIGHT) {
        errors.set_owner(pack->avatar.name);
        errors.set("level", "there is no list %u of level %u", list, level);
    } else {
        const Program& program = pack->avatar.program;
        const Level& of = program.levels[level];
        const FrameLayout layout(pack->avatar.groups.size);
        const Span<Pass> lists[] = {program.mesh, of.deform, of.view, of.shadow, of.light};  // by AVATAR_MESH ..
        made->list.make(dispatched(lists[list], made->arena), &layout, nullptr, made->arena);
    }
    made->of = pack;
    made->unusable = errors.any();
    return made;
}

void avatar_passes_close(AvatarPasses* passes) { close_handle(passes); }

const char* avatar_passes_error(const AvatarPasses* passes) { return line_of(passes); }

static bool usable(const AvatarPasses* passes) { return passes != nullptr && !passes->unusable; }

uint32_t avatar_passes_count(const AvatarPasses* passes) {
    return usable(passes) ? static_cast<uint32_t>(passes->list.dispatches.size) : 0;
}

static const DispatchRow* row_of(const AvatarPasses* passes, uint32_t index) {
    return index < avatar_passes_count(passes) ? &passes->list.dispatches[index] : nullptr;
}

int avatar_dispatch(const AvatarPasses* passes, uint32_t index, AvatarDispatch* out) {
    const DispatchRow* row = row_of(passes, index);
    return row == nullptr ? refuse(out) : give(row->dispatch, out);
}

int avatar_binding(const AvatarPasses* passes, uint32_t dispatch, uint32_t index, AvatarBinding* out) {
    const DispatchRow* row = row_of(passes, dispatch);
    return row == nullptr || index >= row->bindings.size ? refuse(out) : give(row->bindings[index], out);
}

int avatar_constant(const AvatarPasses* passes, uint32_t dispatch, uint32_t index, AvatarConstant* out) {
    const DispatchRow* row = row_of(passes, dispatch);
    return row == nullptr || index >= row->constants.size ? refuse(out) : give(row->constants[index], out);
}

const void* avatar_passes_blocks(const AvatarPasses* passes, size_t* bytes) {
    if (bytes != nullptr) *bytes = usable(passes) ? passes->list.blocks.size : 0;
    return usable(passes) ? passes->list.blocks.data : nullptr;
}

int avatar_passes_set(AvatarPasses* passes, const AvatarInstance* instance) {
    if (!usable(passes)) return 0;
    passes->errors.clear();
    if (instance == nullptr || instance->unusable) passes->errors.set("", "no sound instance is given");
    else if (&instance->pack != passes->of) passes->errors.set("", "the instance is one of another pack");
    return !passes->errors.any() && passes->list.set(instance->values);
}

int avatar_passes_keep_lasting(AvatarPasses* passes) { return usable(passes) && passes->list.keep_lasting(); }

AvatarSort* avatar_sort_open(const AvatarSceneChunk* chunks, uint32_t count, const AvatarAllocator* allocator) {
    return open_handle<AvatarSort>(allocator, chunks, count);
}

void avatar_sort_close(AvatarSort* sort) { close_handle(sort); }

const char* avatar_sort_error(const AvatarSort* sort) { return line_of(sort); }

uint32_t avatar_sort_count(const AvatarSort* sort) { return sort == nullptr || sort->unusable ? 0 : sort->sort.count; }

int avatar_sort_buffer(const AvatarSort* sort, uint32_t index, AvatarSceneBuffer* out) {
    return sort == nullptr || sort->unusable || index >= 4 ? refuse(out) : give(sort->sort.buffers[index], out);
}

const AvatarPasses* avatar_sort_passes(const AvatarSort* sort) { return sort == nullptr ? nullptr : &sort->passes; }

uint32_t avatar_sort_dispatches(const AvatarSort* sort) {
    return sort == nullptr || sort->unusable ? 0 : sort->sort.sort_dispatches;
}
