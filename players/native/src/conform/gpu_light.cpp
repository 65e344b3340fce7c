// Stages shadow and light of a GPU.
#include "../made/constants.h"
#include "gpu_stages.h"

namespace avatar {

static constexpr size_t map_texels = size_t{shadow_size} * shadow_size;

/// The numbers of the light; arrays that are not given are 0. False for one of another length.
bool GpuStages::put_light(const Step& step) {
    LightRows rows = {};
    const struct {
        const char* name;
        float* to;
        size_t count;
    } parts[] = {{"light_ambient", rows.ambient[0], 36},
                 {"light_place", rows.place[0], 16},
                 {"light_colour", rows.colour[0], 16},
                 {"light_turn", rows.turn[0], 12},
                 {"shadow_row", rows.shadow_row[0], 16},
                 {"shadow_offset", rows.shadow_offset, 4}};
    for (const auto& one : parts) {
        const Named* given = step.inputs.find(one.name);
        if (given == nullptr) continue;
        if (given->values.size != one.count) return false;
        for (size_t i = 0; i < one.count; i++) one.to[i] = static_cast<float>(given->values[i]);
    }
    values_.set_light(rows);
    const Named* world = step.inputs.find("world_from_avatar");
    if (world != nullptr && world->values.size == 16) values_.set_world(world->values.data);
    return world == nullptr || world->values.size == 16;
}

bool GpuStages::shadow(const Step& step, Arena& arena, Arrays& out) {
    const bool casts = step.inputs.find("posed_vertices") != nullptr;
    if (!put_light(step) || !put(step, false, arena) || (casts && !put_mesh(step, "posed_vertices", arena))) return false;
    Span<float> map = arena.make<float>(map_texels);
    Span<double> found = arena.make<double>(map_texels);
    if (arena.errors().any() || !run_stage("shadow") || !read("Shadow", map.data, map_texels * sizeof(float))) return false;
    for (size_t i = 0; i < map_texels; i++) found[i] = static_cast<double>(map[i]);
    out.add("shadow", found);
    return true;
}

bool GpuStages::light(const Step& step, Arena& arena, Arrays& out) {
    static const char* const names[] = {"rgb"};
    const bool turned = step.inputs.find("posed_vertices") != nullptr;
    if (!put_light(step) || (turned && !(put_mesh(step, "posed_vertices", arena) && run_stage("bind")))) return false;
    if (!put(step, false, arena) || !put(step, true, arena)) return false;
    if (const Named* given = step.inputs.find("shadow")) {
        Span<float> map = arena.make<float>(map_texels);
        if (given->values.size != map_texels || map.size != map_texels) return false;
        for (size_t i = 0; i < map_texels; i++) map[i] = static_cast<float>(given->values[i]);
        if (!write("Shadow", map.data, map_texels * sizeof(float))) return false;
    }
    return run_stage("light") && take(names, 1, true, arena, out);
}

}  // namespace avatar
