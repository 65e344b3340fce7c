#include "rendering_device.h"

#include "../../../native/scene/draw_blocks.h"
#include "draw.h"
#include "shaders.h"

namespace godot {

RdDevice::RdDevice(GDExtensionObjectPtr of, bool is_local, const AvatarAllocator& allocator)
    : rd(Value::object(of)), object(of), is_local_(is_local), allocator_(allocator) {}

RdDevice::~RdDevice() {
    for (uint32_t i = 0; i < kernel_count_; i++) free(kernels_[i].shader);  // pipelines go with their shader
    if (is_local_) engine.object_destroy(object);
}

void RdDevice::free(Rid id) {
    if (id.id != 0) methods.free_rid.run(object, id);
}

/// A whole number of float4: kernels declare arrays of them.
static uint64_t padded(uint64_t bytes) { return bytes < 16 ? 16 : (bytes + 15) / 16 * 16; }

Handle RdDevice::make_buffer(Errors& errors, const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content) {
    const uint64_t size = padded(bytes);
    if (size > UINT32_MAX) {
        errors.set("the GPU", "buffer %s takes %llu bytes; Godot takes %u in one buffer. Use a coarser level of detail.", name,
                   static_cast<unsigned long long>(bytes), UINT32_MAX);
        return 0;
    }
    const Value data = Value::bytes(size);
    const bool good = content < 0 || avatar_buffer_content(pack, static_cast<uint32_t>(content), data.bytes_data()) == AVATAR_OK;
    const Rid made = good ? rd.call("storage_buffer_create", {static_cast<int64_t>(size), data}).to_rid() : Rid{};
    if (made.id == 0) {
        errors.set("the GPU", "buffer %s: the GPU has no %llu bytes left", name, static_cast<unsigned long long>(bytes));
    }
    return made.id;
}

void RdDevice::write_buffer(Handle buffer, const void* bytes, size_t size) { update(Rid{buffer}, bytes, size); }

/// Allocates only where more is written at once than ever before.
void RdDevice::update(Rid buffer, const void* bytes, size_t size) {
    if (size == 0) return;
    if (size > staging_size_) {
        staging_ = Value::bytes(size);
        staging_data_ = staging_.bytes_data();
        staging_size_ = size;
    }
    std::memcpy(staging_data_, bytes, size);
    const int64_t offset = 0, count = static_cast<int64_t>(size);
    const void* arguments[] = {&buffer, &offset, &count, staging_.inner()};
    int64_t result = 0;
    engine.object_method_bind_ptrcall(methods.buffer_update.bind(), object, arguments, &result);
}

bool RdDevice::read_buffer(Errors& errors, Handle buffer, void* bytes, size_t size) {
    if (size == 0) return true;
    finish();
    const Value read = rd.call("buffer_get_data", {Rid{buffer}, 0, static_cast<int64_t>(size)});
    if (read.size() != size) {
        errors.set("the GPU", "a buffer cannot be read");
        return false;
    }
    std::memcpy(bytes, read.bytes_data(), size);
    return true;
}

void RdDevice::finish() {
    if (!is_local_) return;  // the engine waits for itself where something is read
    rd.call("submit");
    rd.call("sync");
}

Rid RdDevice::shader(Errors& errors, const char* entry, const char* pixel) {
    const Value texts = construct("RDShaderSPIRV");
    const char* const names[] = {entry, pixel};
    for (int i = 0; i < (pixel == nullptr ? 1 : 2); i++) {
        const SpirvText* text = spirv_of(names[i]);
        if (text == nullptr) {
            errors.set(names[i], "is no shader of this add-on");
            return {};
        }
        const int64_t stage = pixel == nullptr ? RenderingDevice_SHADER_STAGE_COMPUTE
                              : i == 0         ? RenderingDevice_SHADER_STAGE_VERTEX
                                               : RenderingDevice_SHADER_STAGE_FRAGMENT;
        texts.call("set_stage_bytecode", {stage, Value::bytes(4 * text->count, text->words)});
    }
    const Rid made = rd.call("shader_create_from_spirv", {texts, entry}).to_rid();
    if (made.id == 0) errors.set(entry, "the driver does not take this shader");
    return made;
}

const RdDevice::Kernel* RdDevice::kernel(Errors& errors, const char* entry, Handle& handle) {
    for (uint32_t i = 0; i < kernel_count_; i++) {
        if (std::strcmp(kernels_[i].entry, entry) == 0) {
            handle = kernels_[i].pipeline.id;
            return &kernels_[i];
        }
    }
    if (kernel_count_ == most_kernels) {
        errors.set(entry, "is one kernel too many");
        return nullptr;
    }
    Kernel& made = kernels_[kernel_count_];
    const SpirvText* text = spirv_of(entry);
    made = {text == nullptr ? nullptr : text->entry, shader(errors, entry), {}};
    if (made.shader.id == 0) return nullptr;
    made.pipeline = rd.call("compute_pipeline_create", {made.shader}).to_rid();
    handle = made.pipeline.id;
    if (handle == 0) {
        errors.set(entry, "the driver makes no pipeline of this shader");
        free(made.shader);
        return nullptr;
    }
    kernel_count_++;
    return &made;
}

Rid RdDevice::uniform_buffer(size_t bytes) {
    return rd.call("uniform_buffer_create", {static_cast<int64_t>(padded(bytes)), Value::bytes(padded(bytes))}).to_rid();
}

Rid RdDevice::uniform_set(Rid shader, const Bound* bound, size_t count) {
    const Value uniforms = Value::array();
    for (size_t i = 0; i < count; i++) {
        const Value one = construct("RDUniform");
        one.call("set_uniform_type", {bound[i].kind});
        one.call("set_binding", {bound[i].binding});
        one.call("add_id", {bound[i].id});
        uniforms.append(one);
    }
    return rd.call("uniform_set_create", {uniforms, shader, 0}).to_rid();
}

bool RdDevice::make_list(Errors& errors, RecordedList& list) {
    size_t bytes = 0;
    avatar_passes_blocks(list.passes, &bytes);
    if (list.blocks == 0) {
        void* memory = allocator_.allocate(allocator_.user, sizeof(Mirror) + bytes);
        if (memory == nullptr) errors.set_memory();
        if (memory == nullptr) return false;
        Mirror* mirror = static_cast<Mirror*>(memory);
        *mirror = {static_cast<uint8_t*>(memory) + sizeof(Mirror), bytes};
        std::memset(mirror->bytes, 0, bytes);
        list.blocks = reinterpret_cast<Handle>(mirror);
    }
    for (avatar::RecordedStep& step : list.steps) {
        const Kernel* found = kernel(errors, step.dispatch.entry, step.kernel);
        if (found == nullptr) return false;
        Bound bound[avatar::RecordedStep::most_bindings + 1];
        uint32_t count = 0;
        for (; count < step.count; count++) {
            bound[count] = {RenderingDevice_UNIFORM_TYPE_STORAGE_BUFFER, step.bound[count].binding, Rid{step.bound[count].buffer}};
        }
        if (step.dispatch.block_bytes > 0) {
            step.block = uniform_buffer(step.dispatch.block_bytes).id;
            bound[count++] = {RenderingDevice_UNIFORM_TYPE_UNIFORM_BUFFER, avatar::constants_binding, Rid{step.block}};
        }
        step.bindings = uniform_set(found->shader, bound, count).id;
        if (step.bindings == 0) errors.set(step.dispatch.entry, "the driver does not bind its buffers");
        if (step.bindings == 0) return false;
    }
    return true;
}

void RdDevice::upload(const RecordedList& list) {
    size_t bytes = 0;
    const uint8_t* blocks = static_cast<const uint8_t*>(avatar_passes_blocks(list.passes, &bytes));
    Mirror& mirror = *reinterpret_cast<Mirror*>(list.blocks);
    for (const avatar::RecordedStep& step : list.steps) {
        const size_t size = step.dispatch.block_bytes, at = step.dispatch.block_offset;
        if (size == 0 || at + size > bytes || std::memcmp(mirror.bytes + at, blocks + at, size) == 0) continue;
        std::memcpy(mirror.bytes + at, blocks + at, size);
        update(Rid{step.block}, blocks + at, size);
    }
}

void RdDevice::run(const RecordedList& list, uint32_t first, uint32_t end, const avatar::Clock& clock) {
    const int64_t compute = methods.compute_list_begin.call<int64_t>(object);
    const int64_t zero = 0, one = 1;
    for (uint32_t i = first; i < end; i++) {
        const avatar::RecordedStep& step = list.steps[i];
        if (step.waits && i > first) methods.compute_list_add_barrier.run(object, compute);
        methods.compute_list_bind_compute_pipeline.run(object, compute, step.kernel);
        methods.compute_list_bind_uniform_set.run(object, compute, step.bindings, zero);
        methods.compute_list_dispatch.run(object, compute, static_cast<int64_t>(step.dispatch.groups), one, one);
    }
    methods.compute_list_end.run(object);
    if (end > first) clock.end(*this, list.steps[end - 1].dispatch.stage);
}

void RdDevice::free_list(RecordedList& list) {
    for (avatar::RecordedStep& step : list.steps) {
        const Rid set{step.bindings};
        // A set goes with a buffer that it binds.
        if (set.id != 0 && methods.uniform_set_is_valid.call<uint8_t>(object, set) != 0) free(set);
        free(Rid{step.block});
        step.bindings = step.block = 0;
    }
    if (list.blocks != 0) {
        Mirror* mirror = reinterpret_cast<Mirror*>(list.blocks);
        allocator_.release(allocator_.user, mirror, sizeof(Mirror) + mirror->size);
    }
    list.blocks = 0;
}

bool RdDevice::draw(Errors& errors, Handle quads, uint32_t count, int32_t width, int32_t height, float* rgba) {
    Draw one(*this);
    return one.make(errors) && one.quads(errors, Rid{quads}, count, {width, height}, Rid{}) && one.read(errors, rgba);
}

}  // namespace godot
