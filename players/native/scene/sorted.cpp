#include "sorted.h"

#include <cstdio>
#include <cstdlib>

namespace avatar {

Sorted::~Sorted() {
    free_recorded(context_.device, recorded_);
    for (Handle buffer : buffers_) {
        if (buffer != 0) context_.device.free_buffer(buffer);
    }
    avatar_sort_close(sort_);
}

bool Sorted::make(Resident* first) {
    if (!take_chunks(first)) return false;
    sort_ = avatar_sort_open(chunks_.data, static_cast<uint32_t>(chunks_.size), &context_.allocator);
    if (const char* line = avatar_sort_error(sort_)) {
        context_.errors.set("", "%s", line);
        return false;
    }
    count_ = avatar_sort_count(sort_);
    for (uint32_t i = 0; i < buffer_count; i++) {
        AvatarSceneBuffer declared;
        if (avatar_sort_buffer(sort_, i, &declared) != AVATAR_OK) return false;
        const uint64_t bytes = static_cast<uint64_t>(declared.stride) * declared.count;
        buffers_[i] = context_.device.make_buffer(context_.errors, declared.name, bytes, nullptr, -1);
        if (buffers_[i] == 0) return false;
    }
    return record(context_.device, avatar_sort_passes(sort_), {&Sorted::find, this}, arena_, recorded_);
}

/// Dispatches name a chunk by its number, which is how `find` knows it.
bool Sorted::take_chunks(Resident* first) {
    uint32_t count = 0;
    for (Resident* one = first; one != nullptr; one = one->next) count += one->shown ? one->chunks() : 0;
    chunks_ = arena_.make<AvatarSceneChunk>(count);
    projected_ = arena_.make<Handle>(count);
    if (context_.errors.any()) return false;
    uint32_t at = 0;
    for (Resident* one = first; one != nullptr; one = one->next) {
        for (uint32_t i = 0; one->shown && i < one->chunks(); i++, at++) {
            char name[16];
            std::snprintf(name, sizeof name, "%u", at);
            chunks_[at].struct_size = sizeof(AvatarSceneChunk);
            chunks_[at].buffer = arena_.copy(Text(name)).data;
            if (!one->chunk(i, projected_[at], chunks_[at].count)) return false;
        }
    }
    return !context_.errors.any();
}

Handle Sorted::find(void* user, const AvatarBinding& binding) {
    const Sorted* self = static_cast<const Sorted*>(user);
    if (binding.index >= 0) return self->buffers_[binding.index];
    return self->projected_[static_cast<size_t>(std::strtoul(binding.buffer, nullptr, 10))];
}

void Sorted::run(const Clock& clock) {
    run_all(context_.device, recorded_, clock);
    ran_ = true;
}

}  // namespace avatar
