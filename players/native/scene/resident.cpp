#include "resident.h"

namespace avatar {

SharedBuffers::SharedBuffers(Context given, const AvatarPack* of) : pack(of), arena_(given.allocator, given.errors) {
    AvatarFacts facts;
    avatar_facts(of, &facts);
    buffers_ = arena_.make<Handle>(facts.buffers);
}

Handle SharedBuffers::get(const Context& context, uint32_t index, const AvatarBuffer& declared) {
    if (index >= buffers_.size) return 0;  // its memory was not given, and the error is set
    Handle& buffer = buffers_[index];
    if (buffer == 0) buffer = context.device.make_buffer(context.errors, declared.name, declared.bytes, pack, index);
    return buffer;
}

static void release_all(Device& device, Span<Handle> buffers) {
    for (Handle& buffer : buffers) {
        if (buffer != 0) device.free_buffer(buffer);
        buffer = 0;
    }
}

void SharedBuffers::release(Device& device) { release_all(device, buffers_); }

Resident::Resident(Context context, SharedBuffers* of, AvatarInstance* played)
    : instance(played), shared(of), level(avatar_instance_level(played)), context_(context),
      arena_(context.allocator, context.errors) {
    AvatarFacts facts;
    avatar_facts(of->pack, &facts);
    own_ = arena_.make<Handle>(facts.buffers);
}

Resident::~Resident() {
    release();
    for (AvatarPasses* passes : passes_) avatar_passes_close(passes);
}

bool Resident::make() {
    for (uint32_t list = 0; list <= AVATAR_VIEW; list++) {
        if (!make_list(list)) return false;
    }
    reads_mesh_ = binds(recorded_[AVATAR_DEFORM], "Mesh");
    const int32_t index = avatar_buffer_index(shared->pack, "Pose");
    pose_buffer_ = index < 0 || own_.empty() ? 0 : own_[static_cast<size_t>(index)];
    uint32_t floats = 0;
    avatar_pose_floats(instance, &floats);
    last_pose_ = arena_.make<float>(floats);  // zeros, as the new buffer
    return !context_.errors.any();
}

bool Resident::make_list(uint32_t list) {
    if (passes_[list] != nullptr) return true;
    passes_[list] = avatar_passes_open(shared->pack, level, list, &context_.allocator);
    const char* line = avatar_passes_error(passes_[list]);
    const bool good = line == nullptr && record(context_.device, passes_[list], {&Resident::find, this}, arena_, recorded_[list]);
    if (good) return true;
    if (line != nullptr) take_error(line);
    free_recorded(context_.device, recorded_[list]);
    avatar_passes_close(passes_[list]);
    passes_[list] = nullptr;
    return false;
}

bool Resident::pose(const Clock& clock) {
    if (avatar_update_pose(instance) != AVATAR_OK) return take_error(avatar_instance_error(instance));
    clock.end(context_.device, "joints");
    bool changed = upload_pose() || !ran_;
    const bool lasting = ran_ && avatar_passes_keep_lasting(passes_[AVATAR_DEFORM]) != 0;
    bool mesh = changed;
    set(AVATAR_MESH, mesh);
    set(AVATAR_DEFORM, changed);
    if (lasting) context_.device.upload(recorded_[AVATAR_DEFORM]);
    if (mesh && reads_mesh_) run_all(context_.device, recorded_[AVATAR_MESH], clock);
    if (changed || mesh) run_all(context_.device, recorded_[AVATAR_DEFORM], clock);
    deformed_ = deformed_ || changed || mesh;
    moved_ = moved_ || changed || mesh;
    ran_ = true;
    return true;
}

bool Resident::view(const AvatarCamera& camera, const Clock& clock, bool& projected) {
    if (!ran_ && !pose(clock)) return false;
    if (avatar_update_camera(instance, &camera) != AVATAR_OK) return take_error(avatar_instance_error(instance));
    bool changed = deformed_;
    set(AVATAR_VIEW, changed);
    if (!take_light(clock, changed)) return false;
    if (changed) run_all(context_.device, recorded_[AVATAR_VIEW], clock);
    if (changed && lighting_ != AVATAR_UNLIT) run_all(context_.device, recorded_[AVATAR_LIGHT], clock);
    projected = projected || changed;
    deformed_ = false;
    return true;
}

/// The constants of the light, and its shadow. Stage light multiplies colours that stage project wrote: what changes it changes
/// the view.
bool Resident::take_light(const Clock& clock, bool& changed) {
    const int lighting = avatar_lighting(instance);
    if (lighting != AVATAR_UNLIT && !make_list(AVATAR_LIGHT)) return false;
    if (lighting == AVATAR_SHADOWED && !cast_shadow(clock, changed)) return false;
    if (lighting != AVATAR_UNLIT) set(AVATAR_LIGHT, changed);
    changed = changed || lighting != lighting_;
    lighting_ = lighting;
    return true;
}

bool Resident::cast_shadow(const Clock& clock, bool& changed) {
    if (!make_list(AVATAR_SHADOW)) return false;
    set(AVATAR_SHADOW, moved_);
    if (!moved_) return true;
    const bool needs_mesh = binds(recorded_[AVATAR_SHADOW], "Mesh") && !reads_mesh_;
    if (needs_mesh) run_all(context_.device, recorded_[AVATAR_MESH], clock);
    run_all(context_.device, recorded_[AVATAR_SHADOW], clock);
    moved_ = false;
    changed = true;
    return true;
}

/// Uploads the constants of a list if the frame changed them.
void Resident::set(uint32_t list, bool& changed) {
    if (avatar_passes_set(passes_[list], instance) == 0) return;
    context_.device.upload(recorded_[list]);
    changed = true;
}

/// Uploads the pose if it is another one.
bool Resident::upload_pose() {
    uint32_t count = 0;
    const float* floats = avatar_pose_floats(instance, &count);
    const size_t bytes = count * sizeof(float);
    if (count == 0 || count != last_pose_.size || std::memcmp(floats, last_pose_.data, bytes) == 0) return false;
    std::memcpy(last_pose_.data, floats, bytes);
    if (pose_buffer_ != 0) context_.device.write_buffer(pose_buffer_, floats, bytes);
    return true;
}

uint32_t Resident::chunks() const {
    AvatarLevel row;
    return avatar_level(shared->pack, level, &row) == AVATAR_OK ? row.chunks : 0;
}

bool Resident::chunk(uint32_t index, Handle& projected, uint32_t& count) {
    AvatarChunk row;
    if (avatar_chunk(shared->pack, level, index, &row) != AVATAR_OK) return false;
    count = row.count;
    projected = buffer(row.projected);
    return projected != 0;
}

Handle Resident::find(void* user, const AvatarBinding& binding) {
    Resident* self = static_cast<Resident*>(user);
    return self->buffer(static_cast<uint32_t>(binding.index));
}

Handle Resident::buffer(uint32_t index) {
    AvatarBuffer declared;
    if (avatar_buffer(shared->pack, index, &declared) != AVATAR_OK || index >= own_.size) return 0;
    if (declared.has_content != 0) return shared->get(context_, index, declared);
    if (own_[index] == 0) own_[index] = context_.device.make_buffer(context_.errors, declared.name, declared.bytes, nullptr, -1);
    return own_[index];
}

bool Resident::take_error(const char* line) {
    context_.errors.set_owner("");  // the line has one
    context_.errors.set("", "%s", line);
    return false;
}

void Resident::release() {
    for (RecordedList& one : recorded_) free_recorded(context_.device, one);
    release_all(context_.device, own_);
}

}  // namespace avatar
