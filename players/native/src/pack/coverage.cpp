// What the passes of a list do together: no vertex, no row and no chunk is left out, or served twice.
#include <cstdio>

#include "access.h"

namespace avatar {

static constexpr double most_rows = 65535 * 64;  // thread groups of one dispatch, threads of one group

void check_mesh(const Program& program, bool has_joints, Errors& errors) {
    const Span<Pass> mesh = program.mesh;
    const char* const stages[] = {"morph", "skin"};
    const int expected = mesh.empty() ? 0 : has_joints ? 2 : 1;
    const double vertices = mesh.empty() ? 0 : mesh[0].constant("vertices")->number;
    double at = vertices;
    int stage = -1;
    bool sound = true;
    for (const Pass& one : mesh) {
        if (at == vertices) {
            stage++;
            at = 0;
        }
        sound = sound && stage < expected && one.entry == stages[stage] && one.constant("first")->number == at;
        at += one.constant("count")->number;
    }
    if (!sound || at != vertices || stage + 1 != expected) errors.set("mesh", "passes do not move every vertex once a stage");
}

void check_chunks(const char* place, const Level& level, Errors& errors) {
    double first = 0;
    for (size_t index = 0; index < level.chunks.size; index++) {
        const Run& run = level.chunks[index];
        char field[64];
        std::snprintf(field, sizeof(field), "%s, chunk %zu", place, index);
        if (run.first != first) errors.set(field, "begins at row %d, not %.0f", run.first, first);
        if (run.count < 1 || run.count > most_rows) {
            errors.set(field, "has %d rows; 1 to %.0f are taken", run.count, most_rows);
        }
        first += run.count;
    }
    if (first < 1 || first > 2147483647.0) errors.set(place, "has %.0f rows", first);
}

ListName::ListName(const char* place, const char* list) { std::snprintf(data, sizeof(data), "%s, %s", place, list); }

/// How many passes write the projected splats of each chunk.
static Span<uint32_t> writers_of(const Level& level, Span<Pass> passes, Arena& scratch) {
    Span<uint32_t> times = scratch.make<uint32_t>(level.chunks.size);
    for (const Pass& one : passes) {
        const Bound* bound = one.buffer("Projected");
        const int64_t chunk = bound == nullptr || times.empty() ? -1 : chunk_index(level, "Projected", bound->buffer);
        if (chunk >= 0) times[static_cast<size_t>(chunk)]++;
    }
    return times;
}

void check_projected(const char* place, const Level& level, Arena& scratch) {
    Errors& errors = scratch.errors();
    const Span<uint32_t> projected = writers_of(level, level.view, scratch), lit = writers_of(level, level.light, scratch);
    for (size_t chunk = 0; chunk < projected.size && !errors.any(); chunk++) {
        const bool of_view = projected[chunk] != 1;
        if (!of_view && (level.light.empty() || lit[chunk] == 1)) continue;
        const ChunkName name(level, "Projected", static_cast<uint32_t>(chunk));
        errors.set(ListName(place, of_view ? "view" : "light").data, "%u passes write %s; one is needed",
                   of_view ? projected[chunk] : lit[chunk], Cut(Text(name), 80).data);
    }
}

void check_placed(const char* place, const Level& level, bool reads_mesh, Arena& scratch) {
    Errors& errors = scratch.errors();
    struct Placed {
        size_t blended, embedded, skinned;
        Text skin;
    };
    Span<Placed> placed = scratch.make<Placed>(level.chunks.size);
    for (const Pass& one : level.deform) {
        const Bound* bound = one.buffer("Splats");
        const int64_t chunk = bound == nullptr || errors.any() ? -1 : chunk_index(level, "Splats", bound->buffer);
        if (chunk < 0) continue;
        Placed& of = placed[static_cast<size_t>(chunk)];
        of.blended += one.buffer("BlendStatic") != nullptr;
        of.embedded += one.buffer("EmbedStatic") != nullptr;
        const Bound* skin = one.buffer("BindStatic");
        if (skin == nullptr || (of.skinned > 0 && of.skin == skin->buffer)) continue;
        of.skinned++;  // by one buffer more; of three, the first and the third may be the same
        of.skin = skin->buffer;
    }
    for (uint32_t chunk = 0; chunk < placed.size && !errors.any(); chunk++) {
        const Placed& of = placed[chunk];
        if (of.blended == 1 && of.embedded == reads_mesh && of.skinned == !reads_mesh) continue;
        const Cut name(Text(ChunkName(level, "Splats", chunk)), 80);
        errors.set(ListName(place, "deform").data, "%s is not blended once and placed", name.data);
    }
}

}  // namespace avatar
