// The functions of avatar_player.h that read a pack.
#include "../formats/sized.h"
#include "../play/levels.h"
#include "handles.h"
#include "shader_texts.h"

using namespace avatar;

uint32_t avatar_player_version(void) { return AVATAR_PLAYER_VERSION; }

AvatarPack* avatar_load(const void* file, size_t bytes, const char* name, const AvatarAllocator* allocator) {
    AvatarPack* pack = open_handle<AvatarPack>(allocator);
    if (pack == nullptr) return nullptr;
    pack->errors.set_owner(name != nullptr ? Text(name) : Text("the pack"));
    pack->unusable = !read_pack(static_cast<const uint8_t*>(file), file != nullptr ? bytes : 0, pack->avatar, pack->arena);
    return pack;
}

void avatar_close(AvatarPack* pack) { close_handle(pack); }

const char* avatar_error(const AvatarPack* pack) { return line_of(pack); }

/// The avatar of a sound pack; else null.
static const Avatar* sound(const AvatarPack* pack) { return pack == nullptr || pack->unusable ? nullptr : &pack->avatar; }

int avatar_facts(const AvatarPack* pack, AvatarFacts* out) {
    const Avatar* of = sound(pack);
    if (of == nullptr) return refuse(out);
    AvatarFacts made = {};
    made.name = of->name.data;
    made.license = or_null(of->license);
    made.consent = or_null(of->consent);
    made.left_handed = of->left_handed;
    made.expressions = static_cast<uint32_t>(of->expressions.size);
    made.eyelids = static_cast<uint32_t>(of->late_morphs.size);
    made.joints = static_cast<uint32_t>(of->skeleton.names.size);
    made.groups = static_cast<uint32_t>(of->groups.size);
    made.clips = static_cast<uint32_t>(of->clips.size);
    made.levels = static_cast<uint32_t>(of->levels.size);
    made.buffers = static_cast<uint32_t>(of->program.buffers.size);
    made.anchors = static_cast<uint32_t>(of->skeleton.anchor_vertices.size);
    made.drivable = of->has_driving;
    made.bounds_low = of->bounds_low;
    made.bounds_high = of->bounds_high;
    made.background = of->has_background ? of->background : nullptr;
    made.up = of->framing.up;
    made.front = of->framing.front;
    made.whole_target = of->framing.whole.target;
    made.whole_size = of->framing.whole.size;
    made.head_target = of->framing.head.given ? of->framing.head.target : nullptr;
    made.head_size = of->framing.head.given ? of->framing.head.size : nullptr;
    made.preview = of->preview.size > 0 ? of->preview.data : nullptr;
    made.preview_bytes = of->preview.size;
    made.file_bytes = of->file_bytes;
    made.relit = of->relight.given;
    return give(made, out);
}

static const char* name_at(Span<Text> names, uint32_t index) { return index < names.size ? names[index].data : nullptr; }

const char* avatar_expression_name(const AvatarPack* pack, uint32_t index) {
    const Avatar* of = sound(pack);
    return of != nullptr && index < of->expressions.size ? of->expressions[index].name.data : nullptr;
}

const char* avatar_expression_alias(const AvatarPack* pack, uint32_t expression, uint32_t index) {
    const Avatar* of = sound(pack);
    return of != nullptr && expression < of->expressions.size ? name_at(of->expressions[expression].aliases, index) : nullptr;
}

const char* avatar_eyelid_name(const AvatarPack* pack, uint32_t index) {
    const Avatar* of = sound(pack);
    return of != nullptr ? name_at(of->late_morphs, index) : nullptr;
}

const char* avatar_joint_name(const AvatarPack* pack, uint32_t index) {
    const Avatar* of = sound(pack);
    return of != nullptr ? name_at(of->skeleton.names, index) : nullptr;
}

static int32_t index_of(const Names& names, const char* name) {
    return name != nullptr ? static_cast<int32_t>(names.find(name)) : -1;
}

int32_t avatar_expression_index(const AvatarPack* pack, const char* name) {
    const Avatar* of = sound(pack);
    return of != nullptr ? index_of(of->expression_names, name) : -1;
}

int32_t avatar_eyelid_index(const AvatarPack* pack, const char* name) {
    const Avatar* of = sound(pack);
    return of != nullptr ? index_of(of->late_names, name) : -1;
}

int32_t avatar_joint_index(const AvatarPack* pack, const char* name) {
    const Avatar* of = sound(pack);
    return of != nullptr ? index_of(of->joint_names, name) : -1;
}

void avatar_expression_range(const AvatarPack* pack, uint32_t index, double* low, double* high) {
    const Avatar* of = sound(pack);
    const bool has = of != nullptr && index < of->expressions.size;
    if (low != nullptr) *low = has ? of->expressions[index].low : 0;
    if (high != nullptr) *high = has ? of->expressions[index].high : 0;
}

const int32_t* avatar_joint_parents(const AvatarPack* pack) {
    const Avatar* of = sound(pack);
    return of != nullptr && of->has_skeleton ? of->skeleton.parents.data : nullptr;
}

const double* avatar_rest_local(const AvatarPack* pack) {
    const Avatar* of = sound(pack);
    return of != nullptr && of->has_skeleton ? of->skeleton.rest_local.data : nullptr;
}

const double* avatar_inverse_bind(const AvatarPack* pack) {
    const Avatar* of = sound(pack);
    return of != nullptr && of->has_skeleton ? of->skeleton.inverse_bind.data : nullptr;
}

int avatar_group(const AvatarPack* pack, uint32_t index, AvatarGroup* out) {
    static const char* const names[] = {"skin", "anchor", "joint_mix", "surface", "none"};
    const Avatar* of = sound(pack);
    if (of == nullptr || index >= of->groups.size) return refuse(out);
    const Group& group = of->groups[index];
    return give(AvatarGroup{sizeof(AvatarGroup), group.name.data, static_cast<uint32_t>(group.first), static_cast<uint32_t>(group.count),
            names[static_cast<int>(group.binding)]}, out);
}

int avatar_clip(const AvatarPack* pack, uint32_t index, AvatarClip* out) {
    const Avatar* of = sound(pack);
    if (of == nullptr || index >= of->clips.size) return refuse(out);
    const ClipData& clip = of->clips[index];
    return give(AvatarClip{sizeof(AvatarClip), clip.name.data,
            clip.fps,
            (clip.frames - 1) / clip.fps,
            static_cast<uint32_t>(clip.frames),
            clip.expression_weights.data,
            clip.late_weights.data,
            clip.joint_delta.data,
            clip.world_from_avatar.data}, out);
}

int avatar_level(const AvatarPack* pack, uint32_t index, AvatarLevel* out) {
    const Avatar* of = sound(pack);
    if (of == nullptr || index >= of->levels.size) return refuse(out);
    const LevelInfo& level = of->levels[index];
    const uint32_t chunks = static_cast<uint32_t>(of->program.levels[index].chunks.size);
    return give(AvatarLevel{sizeof(AvatarLevel), static_cast<uint32_t>(level.count), chunks, level.height_px, level.psnr_db}, out);
}

uint32_t avatar_level_for(const AvatarPack* pack, double height_px) {
    const Avatar* of = sound(pack);
    return of != nullptr ? level_for(of->levels, height_px) : 0;
}

uint32_t avatar_next_level(const AvatarPack* pack, double height_px, uint32_t level) {
    const Avatar* of = sound(pack);
    return of != nullptr ? next_level(of->levels, height_px, level) : 0;
}

int avatar_chunk(const AvatarPack* pack, uint32_t level, uint32_t chunk, AvatarChunk* out) {
    const Avatar* of = sound(pack);
    if (of == nullptr || level >= of->levels.size || chunk >= of->program.levels[level].chunks.size) return refuse(out);
    const Level& held = of->program.levels[level];
    const Run run = held.chunks[chunk];
    const int64_t buffer = of->program.buffer_names.find(ChunkName(held, "Projected", chunk));
    return give(AvatarChunk{sizeof(AvatarChunk), static_cast<uint32_t>(run.first), static_cast<uint32_t>(run.count), static_cast<uint32_t>(buffer)}, out);
}

int avatar_buffer(const AvatarPack* pack, uint32_t index, AvatarBuffer* out) {
    const Avatar* of = sound(pack);
    if (of == nullptr || index >= of->program.buffers.size) return refuse(out);
    const Buffer& buffer = of->program.buffers[index];
    return give(AvatarBuffer{sizeof(AvatarBuffer), buffer.name.data, static_cast<uint32_t>(buffer.bytes), !buffer.sections.empty()}, out);
}

int32_t avatar_buffer_index(const AvatarPack* pack, const char* name) {
    const Avatar* of = sound(pack);
    return of != nullptr ? index_of(of->program.buffer_names, name) : -1;
}

int avatar_buffer_content(const AvatarPack* pack, uint32_t index, void* into) {
    const Avatar* of = sound(pack);
    if (of == nullptr || into == nullptr || index >= of->program.buffers.size ||
        of->program.buffers[index].sections.empty()) {
        return AVATAR_FAILED;
    }
    uint8_t* to = static_cast<uint8_t*>(into);
    for (const Section& one : of->program.buffers[index].sections) {
        const size_t bytes = one.elements.bytes(), whole = 4 * static_cast<size_t>(one.elements.words());
        if (bytes > 0) std::memcpy(to, one.elements.data, bytes);
        std::memset(to + bytes, 0, whole - bytes);
        to += whole;
    }
    return AVATAR_OK;
}

const uint32_t* avatar_triangles(const AvatarPack* pack, uint32_t* count) {
    const Avatar* of = sound(pack);
    const size_t found = of != nullptr ? of->triangles.size / 3 : 0;
    if (count != nullptr) *count = static_cast<uint32_t>(found);
    return found > 0 ? of->triangles.data : nullptr;
}

const char* avatar_shader_at(uint32_t language, uint32_t index, const char** entry) {
    for (const ShaderText* one = shader_texts; one->entry != nullptr; one++) {
        if (one->language != language || index-- > 0) continue;
        if (entry != nullptr) *entry = one->entry;
        return one->text;
    }
    return nullptr;
}

const char* avatar_shader(uint32_t language, const char* entry) {
    for (const ShaderText* one = shader_texts; entry != nullptr && one->entry != nullptr; one++) {
        if (one->language == language && Text(one->entry) == entry) return one->text;
    }
    return nullptr;
}
