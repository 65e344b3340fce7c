#include "unreal_passes.h"

namespace avatar_unreal {

BufferUse pack_buffer(const AvatarPack* pack, uint32_t owner, uint32_t index) {
    AvatarBuffer buffer = {};
    avatar_buffer(pack, index, &buffer);
    return {{owner, index}, buffer.bytes, buffer.has_content != 0 ? pack : nullptr};
}

BufferUse sort_buffer(const AvatarSort* sort, uint32_t index) {
    AvatarSceneBuffer buffer = {};
    avatar_sort_buffer(sort, index, &buffer);
    return {{0, index}, buffer.stride * buffer.count, nullptr};
}

/// Takes all dispatches, with the buffers of their bindings.
template <class BufferOf>
void PassList::find(BufferOf buffer_of) {
    AvatarDispatch dispatch;
    for (uint32_t i = 0; avatar_dispatch(passes, i, &dispatch) == AVATAR_OK; ++i) {
        runs.push_back({dispatch, {}});
        AvatarBinding binding;
        for (uint32_t b = 0; avatar_binding(passes, i, b, &binding) == AVATAR_OK; ++b) {
            runs.back().bound.push_back({binding, buffer_of(binding)});
        }
    }
}

PassList::PassList(const Pack& pack, uint32_t owner, uint32_t level, uint32_t list)
    : owned(avatar_passes_open(pack.get(), level, list, nullptr)), passes(owned) {
    find([&](const AvatarBinding& one) { return pack_buffer(pack.get(), owner, static_cast<uint32_t>(one.index)); });
}

PassList::PassList(const AvatarSort* sort, const std::map<std::string, BufferUse>& others)
    : owned(nullptr), passes(avatar_sort_passes(sort)) {
    find([&](const AvatarBinding& one) {
        return one.index < 0 ? others.at(one.buffer) : sort_buffer(sort, static_cast<uint32_t>(one.index));
    });
}

PassList::~PassList() {
    if (owned != nullptr) avatar_passes_close(owned);
}

void PassList::run(Device& device) const {
    size_t bytes = 0;
    const auto* blocks = static_cast<const uint8_t*>(avatar_passes_blocks(passes, &bytes));
    for (const Run& one : runs) device.run(one.dispatch, blocks + one.dispatch.block_offset, one.bound);
}

}  // namespace avatar_unreal
