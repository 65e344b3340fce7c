#include "pass_list.h"

#include "../made/constants.h"

namespace avatar {

Span<Dispatched> dispatched(Span<Pass> passes, Arena& arena) {
    Span<Dispatched> made = arena.make<Dispatched>(passes.size);
    for (size_t i = 0; i < made.size; i++) made[i] = {&passes[i], groups_of(passes[i].rows, threads)};
    return made;
}

void PassList::make(Span<Dispatched> passes, const FrameLayout* layout, const Names* scene, Arena& arena) {
    size_t bytes = 0, constants = 0;
    dispatches = arena.make<DispatchRow>(passes.size);
    for (size_t i = 0; i < dispatches.size; i++) {
        const Interface& declared = *interface_of(passes[i].pass->entry);
        AvatarDispatch& one = dispatches[i].dispatch;
        one.entry = declared.entry;
        one.stage = declared.stage;
        one.groups = passes[i].groups;
        one.threads = declared.thread_group;
        one.binding_count = declared.storage.size;
        one.constant_count = declared.members.size;
        one.block_binding = declared.block_binding;
        one.block_bytes = declared.block_bytes;
        one.block_offset = static_cast<uint32_t>(bytes);
        bytes += (declared.block_bytes + AVATAR_BLOCK_ALIGN - 1) / AVATAR_BLOCK_ALIGN * AVATAR_BLOCK_ALIGN;
        constants += declared.members.size;
    }
    blocks = arena.make<uint8_t>(bytes);
    copies_ = arena.make<Copied>(constants);
    lasting_ = arena.make<size_t>(passes.size);
    for (size_t i = 0; i < dispatches.size && !arena.errors().any(); i++) {
        make_dispatch(i, passes[i], layout, scene, arena);
    }
    copies_.size = copy_count_;
    lasting_.size = lasting_count_;
}

void PassList::make_dispatch(size_t index, const Dispatched& one, const FrameLayout* layout, const Names* scene,
                             Arena& arena) {
    const Pass& pass = *one.pass;
    const Interface& declared = *interface_of(pass.entry);
    DispatchRow& made = dispatches[index];
    made.bindings = arena.make<AvatarBinding>(declared.storage.size);
    made.constants = arena.make<AvatarConstant>(declared.members.size);
    if (arena.errors().any()) return;
    for (uint32_t i = 0; i < declared.storage.size; i++) {
        const StorageBuffer& storage = declared.storage.data[i];
        const Bound* bound = pass.buffer(storage.name);
        const int64_t in_scene = scene == nullptr ? bound->index : scene->find(bound->buffer);
        made.bindings[i] = {sizeof(AvatarBinding), storage.name, bound->buffer.data, storage.binding, storage.is_read_only,
                            static_cast<int32_t>(in_scene)};
    }
    for (uint32_t i = 0; i < declared.members.size; i++) {
        const Member& member = declared.members.data[i];
        made.constants[i] = {sizeof(AvatarConstant), member.name, static_cast<uint32_t>(member.type), member.offset};
        const Constant* value = pass.constant(member.name);  // none for what fills a gap: it is 0
        if (value != nullptr) set_constant(made.dispatch.block_offset + member.offset, *value, member.type, layout);
    }
    const Constant* width = pass.constant("appearance_sh_width");
    if (pass.entry != "blend" || width == nullptr || width->kind != Constant::Kind::number || width->number != 0) return;
    for (const Member& member : declared.members) {
        if (Text(member.name) == "sh_terms") lasting_[lasting_count_++] = made.dispatch.block_offset + member.offset;
    }
}

void PassList::set_constant(size_t at, const Constant& value, ConstantType type, const FrameLayout* layout) {
    if (type == ConstantType::uint) {
        const uint32_t number = static_cast<uint32_t>(value.number);
        std::memcpy(&blocks[at], &number, 4);
        return;
    }
    const uint32_t floats = static_cast<uint32_t>(type);
    if (value.kind == Constant::Kind::source) {
        Copied one = {0, at, 0};
        one.from = layout->place(value.source, &one.count);
        copies_[copy_count_++] = one;
        return;
    }
    const double* from = value.kind == Constant::Kind::vector ? value.vector : &value.number;
    const uint32_t given = value.kind == Constant::Kind::vector ? value.floats : 1;
    for (uint32_t k = 0; k < floats && k < given; k++) {
        const float number = static_cast<float>(from[k]);
        std::memcpy(&blocks[at + 4 * k], &number, 4);
    }
}

bool PassList::set(const FrameValues& values) {
    bool changed = false;
    for (const Copied& one : copies_) {
        const float* from = &values.floats[one.from];
        for (uint32_t k = 0; k < one.count; k++) {
            float before;
            std::memcpy(&before, &blocks[one.to + 4 * k], 4);
            changed |= !(before == from[k]);  // NaN is always new
        }
        std::memcpy(&blocks[one.to], from, 4 * static_cast<size_t>(one.count));
    }
    return changed;
}

bool PassList::keep_lasting() {
    bool changed = false;
    for (const size_t at : lasting_) {
        uint32_t terms;
        std::memcpy(&terms, &blocks[at], 4);
        changed |= terms != 0;
        terms = 0;
        std::memcpy(&blocks[at], &terms, 4);
    }
    return changed;
}

}  // namespace avatar
