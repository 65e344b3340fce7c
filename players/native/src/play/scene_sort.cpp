#include "scene_sort.h"

#include <initializer_list>

#include "../made/constants.h"

namespace avatar {

static constexpr uint32_t digit_bits = 4, turns = 8;     // 8 digits of 4 bits: a key of 32 bits
static constexpr double most_splats = 65535.0 * 64;      // groups of one dispatch, threads of a gather

/// A pass of the sort, with its names in the arena.
Pass SceneSort::pass(const char* entry, const NamePair* bound, size_t buffer_count, const Given* given, size_t given_count,
                     Arena& arena) {
    Pass made = {};
    made.entry = entry;
    made.buffers = arena.make<Bound>(buffer_count);
    made.constants = arena.make<Constant>(given_count);
    if (arena.errors().any()) return made;
    for (size_t i = 0; i < buffer_count; i++) made.buffers[i] = {bound[i].first, bound[i].second, 0};
    for (size_t i = 0; i < given_count; i++) {
        made.constants[i].name = given[i].name;
        made.constants[i].number = given[i].value;
    }
    return made;
}

void SceneSort::add(Pass made, uint32_t groups, Arena& arena) {
    Span<Pass> kept = arena.copy(&made, 1);
    if (!kept.empty()) list_[added_++] = {kept.data, groups};
}

void SceneSort::make(Span<AvatarSceneChunk> chunks, Arena& arena) {
    const uint32_t chunk_count = static_cast<uint32_t>(chunks.size);
    Errors& errors = arena.errors();
    double total = 0;
    for (uint32_t i = 0; i < chunk_count; i++) total += chunks[i].count;
    if (total > most_splats) {
        errors.set("", "has %.0f splats; one sort takes %.0f", total, most_splats);
        return;
    }
    count = static_cast<uint32_t>(total);
    const uint32_t needed = groups_of(count, sort_block), blocks = needed > 0 ? needed : 1;
    const uint32_t most = count > 0 ? count : 1;
    constexpr uint32_t size = sizeof(AvatarSceneBuffer);
    const AvatarSceneBuffer made[] = {
        {size, "Pairs", 8, most}, {size, "PairsOut", 8, most}, {size, "Counts", 4, sort_digits * blocks}, {size, "Quads", 16, 3 * most}};
    std::memcpy(static_cast<void*>(buffers), made, sizeof(made));
    if (count == 0) return;
    list_ = arena.make<Dispatched>(2 * static_cast<size_t>(chunk_count) + 3 * turns);
    Names scene;
    if (errors.any() || !scene.make(arena, 4)) return;
    for (uint32_t i = 0; i < 4; i++) scene.add(buffers[i].name, i);
    Span<const char*> names = arena.make<const char*>(chunk_count);
    if (errors.any()) return;
    uint32_t first = 0;
    for (uint32_t i = 0; i < chunk_count; i++) {
        names[i] = arena.copy(Text(chunks[i].buffer)).data;
        const NamePair bound[] = {{"Projected", names[i]}, {"Pairs", "Pairs"}};
        const Given given[] = {{"count", chunks[i].count}, {"first", first}};
        add(pass("sort_keys", bound, 2, given, 2, arena), groups_of(chunks[i].count, threads), arena);
        first += chunks[i].count;
    }
    for (uint32_t turn = 0; turn < turns; turn++) {  // an even number of turns ends where it began
        const char *here = turn % 2 == 0 ? "Pairs" : "PairsOut", *there = turn % 2 == 0 ? "PairsOut" : "Pairs";
        for (const char* entry : {"sort_count", "sort_scan", "sort_scatter"}) {
            const NamePair bound[] = {{"Pairs", here}, {"PairsOut", there}, {"Counts", "Counts"}};
            const Given given[] = {
                {"count", count}, {"groups", blocks}, {"shift", digit_bits * turn}, {"total", sort_digits * blocks}};
            add(pass(entry, bound, 3, given, 4, arena), Text(entry) == "sort_scan" ? 1 : blocks, arena);
        }
    }
    sort_dispatches = static_cast<uint32_t>(added_);
    first = 0;
    for (uint32_t i = 0; i < chunk_count; i++) {
        const NamePair bound[] = {{"Projected", names[i]}, {"Pairs", "Pairs"}, {"Quads", "Quads"}};
        const Given given[] = {{"count", count}, {"begin", 0},        {"piece_count", count},
                               {"first", first}, {"chunk_count", chunks[i].count}, {"reverse", 1}};
        add(pass("raster_gather", bound, 3, given, 6, arena), groups_of(count, threads), arena);
        first += chunks[i].count;
    }
    list_.size = added_;
    if (!errors.any()) passes.make(list_, nullptr, &scene, arena);
}

}  // namespace avatar
