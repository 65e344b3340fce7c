#include "gpu_stages.h"

#include <cmath>

#include "../pose/affine.h"
#include "planes.h"

namespace avatar {

static constexpr uint32_t not_drawn = 0xFFFFFFFF;  // key of a splat without radius; sorts last

GpuStages::GpuStages(const AvatarStageRunner& runner, const AvatarPack& pack, Arena& arena)
    : runner_(runner), avatar_(pack.avatar), level_(pack.avatar.program.levels[0]), values_(pack.avatar.groups.size) {
    values_.floats = arena.make<float>(values_.layout.size());
    Span<AvatarSceneChunk> chunks = arena.make<AvatarSceneChunk>(level_.chunks.size);
    failed = arena.errors().any();
    if (failed) return;
    for (uint32_t i = 0; i <= AVATAR_LIGHT; i++) {
        lists_[i] = avatar_passes_open(&pack, 0, i, &arena.allocator());
        failed |= avatar_passes_error(lists_[i]) != nullptr;
    }
    for (uint32_t i = 0; i < chunks.size; i++) {
        chunks[i].struct_size = sizeof(AvatarSceneChunk);
        chunks[i].buffer = arena.copy(Text(ChunkName(level_, "Projected", i))).data;
        chunks[i].count = static_cast<uint32_t>(level_.chunks[i].count);
        rows_ += chunks[i].count;
    }
    const Constant* terms = level_.deform[0].constant("sh_terms");
    sh_terms_ = terms == nullptr ? 0 : static_cast<size_t>(terms->number);
    sort_ = avatar_sort_open(chunks.data, static_cast<uint32_t>(chunks.size), &arena.allocator());
    failed = failed || avatar_sort_error(sort_) != nullptr || runner_.load(runner_.user, &pack, sort_) != AVATAR_OK;
}

GpuStages::~GpuStages() {
    for (AvatarPasses* list : lists_) avatar_passes_close(list);
    avatar_sort_close(sort_);
}

bool GpuStages::write(const char* buffer, const void* bytes, size_t size) {
    failed = failed || runner_.write(runner_.user, buffer, bytes, size) != AVATAR_OK;
    return !failed;
}

bool GpuStages::read(const char* buffer, void* bytes, size_t size) {
    failed = failed || runner_.read(runner_.user, buffer, bytes, size) != AVATAR_OK;
    return !failed;
}

bool GpuStages::run_stage(const char* stage) {
    for (AvatarPasses* list : lists_) {
        list->list.set(values_);
        for (uint32_t i = 0; i < list->list.dispatches.size; i++) {
            if (Text(list->list.dispatches[i].dispatch.stage) != stage) continue;
            failed = failed || runner_.run(runner_.user, list, i) != AVATAR_OK;
        }
    }
    return !failed;
}

bool GpuStages::run(const Step& step, const Case& of, Arena& arena, Arrays& out) {
    static const char* const blended[] = {"mean", "log_scale", "quat_wxyz", "opacity_logit"};
    static const char* const activated[] = {"scale", "quat_wxyz", "opacity"};
    if (failed || !put_pose(step, arena)) return false;
    const Text stage = step.stage;
    if (stage == "morph") return run_stage("morph") && take_mesh("vertices", arena, out);
    if (stage == "skin") {
        return put_mesh(step, "vertices", arena) && run_stage("skin") && take_mesh("posed_vertices", arena, out);
    }
    if (stage == "blend") return run_stage("blend") && take(blended, 4, false, arena, out) && take_sh(arena, out);
    if (stage == "bind") return bind(step, arena, out);
    if (stage == "activate") {
        return put(step, false, arena) && run_stage("activate") && take(activated, 3, false, arena, out);
    }
    if (stage == "shadow") return shadow(step, arena, out);
    if (stage == "project") return project(step, of, arena, out);
    if (stage == "light") return light(step, arena, out);
    if (stage == "sort") return sort(step, arena, out);
    if (stage == "raster") return raster(step, of, arena, out);
    arena.errors().set("", "there is no stage '%s'", Cut(stage, 40).data);
    return false;
}

/// Buffer Pose; arrays that are not given are 0.
bool GpuStages::put_pose(const Step& step, Arena& arena) {
    const Program& program = avatar_.program;
    Span<float> floats = arena.make<float>(static_cast<size_t>(program.pose_floats));
    if (floats.empty()) return !arena.errors().any();
    const struct {
        const char* name;
        int32_t first, end;
    } sections[] = {{"expression_weights", program.pose.weights, program.pose.features},
                    {"pose_feature", program.pose.features, program.pose.late},
                    {"late_weights", program.pose.late, program.pose.joints}};
    for (const auto& one : sections) {
        const Named* given = step.inputs.find(one.name);
        if (given == nullptr) continue;
        if (given->values.size != static_cast<size_t>(one.end - one.first)) return false;
        float* to = floats.data + one.first;
        for (const double value : given->values) *to++ = static_cast<float>(value);
    }
    const Named* skin = step.inputs.find("skin_matrix");
    if (skin != nullptr && skin->values.size != 16 * avatar_.skeleton.names.size) return false;
    for (size_t i = 0; skin != nullptr && i < skin->values.size; i++) {
        const size_t to = static_cast<size_t>(program.pose.joints) + i / 16 * 12 + i % 16;
        if (i % 16 < 12) floats[to] = static_cast<float>(skin->values[i]);
    }
    return write("Pose", floats.data, floats.size * sizeof(float));
}

static size_t vertices_of_mesh(const Avatar& avatar) {
    const Constant* found = avatar.program.mesh.empty() ? nullptr : avatar.program.mesh[0].constant("vertices");
    return found == nullptr ? 0 : static_cast<size_t>(found->number);
}

bool GpuStages::put_mesh(const Step& step, const char* name, Arena& arena) {
    const Named* vertices = step.inputs.find(name);
    const size_t count = vertices_of_mesh(avatar_);
    if (vertices == nullptr || vertices->values.size != 3 * count) {
        // Of embedded Gaussians the mesh may have no passes: buffer Mesh then takes what it is given.
        if (vertices == nullptr || count > 0 || vertices->values.size % 3 != 0) return false;
    }
    Span<float> floats = arena.make<float>(vertices->values.size / 3 * 4);
    for (size_t i = 0; i < floats.size; i++) {
        floats[i] = i % 4 == 3 ? 1 : static_cast<float>(vertices->values[i / 4 * 3 + i % 4]);
    }
    return !arena.errors().any() && write("Mesh", floats.data, floats.size * sizeof(float));
}

bool GpuStages::take_mesh(const char* name, Arena& arena, Arrays& out) {
    const size_t count = vertices_of_mesh(avatar_);
    Span<float> plane = arena.make<float>(4 * count);
    Span<double> found = arena.make<double>(3 * count);
    if (count == 0 || arena.errors().any() || !read("Mesh", plane.data, plane.size * sizeof(float))) return false;
    for (size_t i = 0; i < found.size; i++) found[i] = static_cast<double>(plane[i / 3 * 4 + i % 3]);
    out.add(name, found);
    return true;
}

bool GpuStages::put(const Step& step, bool projected, Arena& arena) {
    const size_t planes = projected ? projected_planes : splat_planes;
    for (uint32_t i = 0; i < level_.chunks.size; i++) {
        const Run chunk = level_.chunks[i];
        Span<float> floats = arena.make<float>(4 * planes * static_cast<size_t>(chunk.count));
        if (arena.errors().any()) return false;
        for (size_t a = 0; a < step.inputs.size; a++) {
            const Named& one = step.inputs.arrays[a];
            const PlanePlace* place = place_of(one.name, projected);
            if (place == nullptr) continue;
            if (one.values.size != rows_ * place->components) return false;
            put_plane(floats.data, *place, one.values.data, chunk);
        }
        const ChunkName name(level_, projected ? "Projected" : "Splats", i);
        if (!write(name.data, floats.data, floats.size * sizeof(float))) return false;
    }
    return projected || put_sh(step, arena);
}

bool GpuStages::take(const char* const* names, size_t count, bool projected, Arena& arena, Arrays& out) {
    const size_t planes = projected ? projected_planes : splat_planes;
    Span<double> found[8];
    for (size_t a = 0; a < count; a++) {
        found[a] = arena.make<double>(rows_ * place_of(names[a], projected)->components);
        out.add(names[a], found[a]);
    }
    for (uint32_t i = 0; i < level_.chunks.size; i++) {
        const Run chunk = level_.chunks[i];
        Span<float> floats = arena.make<float>(4 * planes * static_cast<size_t>(chunk.count));
        if (arena.errors().any()) return false;
        const ChunkName name(level_, projected ? "Projected" : "Splats", i);
        if (!read(name.data, floats.data, floats.size * sizeof(float))) return false;
        for (size_t a = 0; a < count; a++) take_plane(floats.data, *place_of(names[a], projected), found[a].data, chunk);
    }
    return true;
}

/// Planes 3 k + channel of a chunk; arrays have [N, terms, 3].
bool GpuStages::put_sh(const Step& step, Arena& arena) {
    const Named* sh = step.inputs.find("sh");
    if (sh == nullptr) return true;
    if (sh->values.size != rows_ * 3 * sh_terms_) return false;
    for (uint32_t i = 0; i < level_.chunks.size; i++) {
        const size_t first = static_cast<size_t>(level_.chunks[i].first), rows = static_cast<size_t>(level_.chunks[i].count);
        Span<float> planes = arena.make<float>(3 * sh_terms_ * rows);
        for (size_t at = 0; at < planes.size; at++) {
            planes[at] = static_cast<float>(sh->values[(first + at % rows) * 3 * sh_terms_ + at / rows]);
        }
        const ChunkName name(level_, "Sh", i);
        if (arena.errors().any() || !write(name.data, planes.data, planes.size * sizeof(float))) return false;
    }
    return true;
}

bool GpuStages::take_sh(Arena& arena, Arrays& out) {
    Span<double> found = arena.make<double>(3 * sh_terms_ * rows_);
    for (uint32_t i = 0; i < level_.chunks.size; i++) {
        const size_t first = static_cast<size_t>(level_.chunks[i].first), rows = static_cast<size_t>(level_.chunks[i].count);
        Span<float> planes = arena.make<float>(3 * sh_terms_ * rows);
        const ChunkName name(level_, "Sh", i);
        if (arena.errors().any() || !read(name.data, planes.data, planes.size * sizeof(float))) return false;
        for (size_t at = 0; at < planes.size; at++) {
            found[(first + at % rows) * 3 * sh_terms_ + at / rows] = static_cast<double>(planes[at]);
        }
    }
    out.add("sh", found);
    return true;
}

bool GpuStages::bind(const Step& step, Arena& arena, Arrays& out) {
    static const char* const names[] = {"mean", "log_scale", "quat_wxyz", "sh_rotation"};
    const size_t groups = avatar_.groups.size;
    const Named *matrix = step.inputs.find("group_matrix"), *turned = step.inputs.find("group_rotation");
    const Named* world = step.inputs.find("world_from_avatar");
    if (matrix == nullptr || turned == nullptr || world == nullptr || matrix->values.size != 12 * groups ||
        turned->values.size != 9 * groups || world->values.size != 16 || !put(step, false, arena)) {
        return false;
    }
    Span<float> matrices = arena.make<float>(12 * groups), rotations = arena.make<float>(12 * groups);
    if (arena.errors().any()) return false;
    for (size_t i = 0; i < matrices.size; i++) matrices[i] = static_cast<float>(matrix->values[i]);
    for (size_t i = 0; i < turned->values.size; i++) rotations[i / 3 * 4 + i % 3] = static_cast<float>(turned->values[i]);
    values_.set_posed(matrices.data, rotations.data, world->values.data);
    if (avatar_.program.reads_mesh && !put_mesh(step, "posed_vertices", arena)) return false;
    return run_stage("bind") && take(names, 4, false, arena, out);
}

bool GpuStages::project(const Step& step, const Case& of, Arena& arena, Arrays& out) {
    static const char* const names[] = {"centre", "depth", "opacity", "conic", "radius", "rgb"};
    if (!of.has_camera || !put(step, false, arena)) return false;
    double still[16];
    set_identity(still, 4);
    values_.set_camera(of.camera, still);
    return run_stage("project") && take(names, 6, true, arena, out);
}

bool GpuStages::sort(const Step& step, Arena& arena, Arrays& out) {
    if (!put(step, true, arena)) return false;
    for (uint32_t i = 0; i < sort_->sort.sort_dispatches; i++) {
        failed = failed || runner_.run(runner_.user, &sort_->passes, i) != AVATAR_OK;
    }
    Span<uint32_t> pairs = arena.make<uint32_t>(2 * rows_);
    Span<double> order = arena.make<double>(rows_);
    if (arena.errors().any() || !read("Pairs", pairs.data, pairs.size * sizeof(uint32_t))) return false;
    size_t count = 0;
    for (size_t i = 0; i < pairs.size; i += 2) {
        if (pairs[i] != not_drawn) order[count++] = pairs[i + 1];
    }
    order.size = count;
    out.add("order", order);
    return true;
}

/// The drawn splats in their order, then all others.
bool GpuStages::write_pairs(Span<double> order, Arena& arena) {
    Span<uint32_t> pairs = arena.make<uint32_t>(2 * rows_);
    Span<uint8_t> drawn = arena.make<uint8_t>(rows_);
    if (arena.errors().any() || order.size > rows_) return false;
    size_t at = 0;
    for (const double id : order) {
        if (!(id >= 0 && id < static_cast<double>(rows_)) || drawn[static_cast<size_t>(id)] != 0) return false;
        drawn[static_cast<size_t>(id)] = 1;
        pairs[at + 1] = static_cast<uint32_t>(id);
        at += 2;
    }
    for (uint32_t id = 0; id < rows_; id++) {
        if (drawn[id] != 0) continue;
        pairs[at] = not_drawn;
        pairs[at + 1] = id;
        at += 2;
    }
    return write("Pairs", pairs.data, pairs.size * sizeof(uint32_t));
}

bool GpuStages::raster(const Step& step, const Case& of, Arena& arena, Arrays& out) {
    const Named *order = step.inputs.find("order"), *background = step.inputs.find("background");
    if (order == nullptr || background == nullptr || background->values.size != 3 || !of.has_camera) return false;
    if (!put(step, true, arena) || !write_pairs(order->values, arena)) return false;
    for (uint32_t i = sort_->sort.sort_dispatches; i < sort_->sort.passes.dispatches.size; i++) {
        failed = failed || runner_.run(runner_.user, &sort_->passes, i) != AVATAR_OK;
    }
    const size_t pixels = static_cast<size_t>(of.camera.width) * static_cast<size_t>(of.camera.height);
    const size_t count = step.has_pixels ? step.pixels.size : pixels;
    Span<float> image = arena.make<float>(4 * pixels);
    Span<double> colour = arena.make<double>(3 * count), transmittance = arena.make<double>(count);
    if (arena.errors().any() || failed) return false;
    failed = runner_.draw(runner_.user, sort_->sort.count, of.camera.width, of.camera.height, image.data) != AVATAR_OK;
    for (size_t i = 0; i < count && !failed; i++) {
        const double pixel = step.has_pixels ? step.pixels[i] : static_cast<double>(i);
        if (!(pixel >= 0 && pixel < static_cast<double>(pixels))) return false;
        const float* at = &image[4 * static_cast<size_t>(pixel)];
        transmittance[i] = 1 - static_cast<double>(at[3]);
        for (size_t c = 0; c < 3; c++) {
            colour[3 * i + c] = static_cast<double>(at[c]) + transmittance[i] * background->values[c];
        }
    }
    out.add("colour", colour);
    out.add("transmittance", transmittance);
    return !failed;
}

}  // namespace avatar
