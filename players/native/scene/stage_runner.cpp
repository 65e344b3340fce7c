#include "stage_runner.h"

namespace avatar {

AvatarStageRunner StageRunner::functions() {
    AvatarStageRunner made = {};
    made.user = this;
    made.load = [](void* user, const AvatarPack* pack, const AvatarSort* scene) {
        return static_cast<StageRunner*>(user)->load(pack, scene) ? 1 : 0;
    };
    made.write = [](void* user, const char* name, const void* bytes, size_t size) {
        StageRunner* self = static_cast<StageRunner*>(user);
        const Handle into = self->buffer(name);
        if (into != 0) self->context_.device.write_buffer(into, bytes, size);
        return into != 0 ? 1 : 0;
    };
    made.read = [](void* user, const char* name, void* bytes, size_t size) {
        StageRunner* self = static_cast<StageRunner*>(user);
        const Handle from = self->buffer(name);
        return from != 0 && self->context_.device.read_buffer(self->context_.errors, from, bytes, size) ? 1 : 0;
    };
    made.run = [](void* user, const AvatarPasses* passes, uint32_t dispatch) {
        StageRunner* self = static_cast<StageRunner*>(user);
        const RecordedList* list = self->recorded(passes);
        if (list == nullptr) return 0;
        self->context_.device.upload(*list);
        self->context_.device.run(*list, dispatch, dispatch + 1, Clock());
        return 1;
    };
    made.draw = [](void* user, uint32_t quads, int32_t width, int32_t height, float* rgba) {
        StageRunner* self = static_cast<StageRunner*>(user);
        const Handle from = self->buffer("Quads");
        return from != 0 && self->context_.device.draw(self->context_.errors, from, quads, width, height, rgba) ? 1 : 0;
    };
    return made;
}

bool StageRunner::load(const AvatarPack* pack, const AvatarSort* scene) {
    release();
    AvatarFacts facts;
    avatar_facts(pack, &facts);
    buffers_ = arena_.make<Known>(facts.buffers + 4);
    if (context_.errors.any()) return false;
    for (uint32_t i = 0; i < facts.buffers; i++) {
        AvatarBuffer declared;
        avatar_buffer(pack, i, &declared);
        if (!add(declared.name, declared.bytes, pack, declared.has_content != 0 ? static_cast<int64_t>(i) : -1)) return false;
    }
    AvatarSceneBuffer declared;
    for (uint32_t i = 0; avatar_sort_buffer(scene, i, &declared) == AVATAR_OK; i++) {
        if (!add(declared.name, static_cast<uint64_t>(declared.stride) * declared.count, nullptr, -1)) return false;
    }
    return true;
}

bool StageRunner::add(const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content) {
    const Handle made = context_.device.make_buffer(context_.errors, name, bytes, pack, content);
    if (made != 0) buffers_[count_++] = {name, made};
    return made != 0;
}

/// Buffers of chunks are named "0/NAME" in a scene, and "NAME" in the pack.
Handle StageRunner::buffer(const char* name) {
    const char* slash = std::strchr(name, '/');
    const char* own = slash == nullptr ? name : slash + 1;
    for (size_t i = 0; i < count_; i++) {
        if (std::strcmp(buffers_[i].name, own) == 0) return buffers_[i].buffer;
    }
    context_.errors.set(own, "there is no such buffer");
    return 0;
}

Handle StageRunner::find(void* user, const AvatarBinding& binding) {
    return static_cast<StageRunner*>(user)->buffer(binding.buffer);
}

/// The list ready to run: recorded when it is first met. Null with an error.
const RecordedList* StageRunner::recorded(const AvatarPasses* passes) {
    for (uint32_t i = 0; i < list_count_; i++) {
        if (lists_[i].passes == passes) return &lists_[i];
    }
    if (list_count_ == most_lists) {
        context_.errors.set("", "more than %u lists of passes", most_lists);
        return nullptr;
    }
    RecordedList& one = lists_[list_count_];
    if (record(context_.device, passes, {&StageRunner::find, this}, arena_, one)) return &lists_[list_count_++];
    free_recorded(context_.device, one);
    return nullptr;
}

void StageRunner::release() {
    for (uint32_t i = 0; i < list_count_; i++) free_recorded(context_.device, lists_[i]);
    for (size_t i = 0; i < count_; i++) context_.device.free_buffer(buffers_[i].buffer);
    list_count_ = 0;
    count_ = 0;
}

}  // namespace avatar
