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

PassList::PassList(const Pack& pack, uint32_t owner, uint32_t level, uint32_t list)
    : owned(avatar_passes_open(pack.get(), level, list, nullptr)), passes(owned) {
    for (uint32_t i = 0; error() == nullptr && i < avatar_passes_count(passes); ++i) {
        const AvatarDispatch& dispatch = *avatar_dispatch(passes, i);
        uses.emplace_back();
        for (uint32_t b = 0; b < dispatch.binding_count; ++b) {
            uses.back().push_back(pack_buffer(pack.get(), owner, static_cast<uint32_t>(dispatch.bindings[b].index)));
        }
    }
}

PassList::PassList(const AvatarSort* sort, const std::map<std::string, BufferUse>& others)
    : owned(nullptr), passes(avatar_sort_passes(sort)) {
    for (uint32_t i = 0; i < avatar_passes_count(passes); ++i) {
        const AvatarDispatch& dispatch = *avatar_dispatch(passes, i);
        uses.emplace_back();
        for (uint32_t b = 0; b < dispatch.binding_count; ++b) {
            const AvatarBinding& binding = dispatch.bindings[b];
            uses.back().push_back(binding.index < 0 ? others.at(binding.buffer)
                                                    : sort_buffer(sort, static_cast<uint32_t>(binding.index)));
        }
    }
}

PassList::~PassList() {
    if (owned != nullptr) avatar_passes_close(owned);
}

void PassList::run(Device& device) const {
    size_t bytes = 0;
    const auto* blocks = static_cast<const uint8_t*>(avatar_passes_blocks(passes, &bytes));
    for (uint32_t i = 0; i < uses.size(); ++i) {
        const AvatarDispatch& dispatch = *avatar_dispatch(passes, i);
        device.run(dispatch, blocks + dispatch.block_offset, uses[i].data());
    }
}

}  // namespace avatar_unreal
