// The engine's RenderingDevice as the device of a scene of avatars.
#pragma once
#include "../../../native/scene/device.h"
#include "../engine/values.h"

namespace godot {

using avatar::Errors;
using avatar::Handle;
using avatar::RecordedList;

/// Methods that frames call, looked up once.
struct RdMethods {
    Method buffer_update = METHOD(RenderingDevice, buffer_update);
    Method compute_list_begin = METHOD(RenderingDevice, compute_list_begin);
    Method compute_list_bind_compute_pipeline = METHOD(RenderingDevice, compute_list_bind_compute_pipeline);
    Method compute_list_bind_uniform_set = METHOD(RenderingDevice, compute_list_bind_uniform_set);
    Method compute_list_dispatch = METHOD(RenderingDevice, compute_list_dispatch);
    Method compute_list_add_barrier = METHOD(RenderingDevice, compute_list_add_barrier);
    Method compute_list_end = METHOD(RenderingDevice, compute_list_end);
    Method draw_list_begin = METHOD(RenderingDevice, draw_list_begin);
    Method draw_list_bind_render_pipeline = METHOD(RenderingDevice, draw_list_bind_render_pipeline);
    Method draw_list_bind_uniform_set = METHOD(RenderingDevice, draw_list_bind_uniform_set);
    Method draw_list_draw = METHOD(RenderingDevice, draw_list_draw);
    Method draw_list_end = METHOD(RenderingDevice, draw_list_end);
    Method framebuffer_is_valid = METHOD(RenderingDevice, framebuffer_is_valid);
    Method uniform_set_is_valid = METHOD(RenderingDevice, uniform_set_is_valid);
    Method free_rid = METHOD(RenderingDevice, free_rid);
};

/// What an entry of a uniform set binds.
struct Bound {
    int64_t kind;  // RenderingDevice.UniformType
    uint32_t binding;
    Rid id;
};

class RdDevice final : public avatar::Device {
public:
    /// Of an object RenderingDevice: the engine's own, or a local one, which waits for what it is given.
    RdDevice(GDExtensionObjectPtr object, bool is_local, const AvatarAllocator& allocator);
    ~RdDevice();
    RdDevice(const RdDevice&) = delete;

    Handle make_buffer(Errors& errors, const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content) override;
    void write_buffer(Handle buffer, const void* bytes, size_t size) override;
    bool read_buffer(Errors& errors, Handle buffer, void* bytes, size_t size) override;
    void free_buffer(Handle buffer) override { free(Rid{buffer}); }
    bool make_list(Errors& errors, RecordedList& list) override;
    void upload(const RecordedList& list) override;
    void run(const RecordedList& list, uint32_t first, uint32_t end, const avatar::Clock& clock) override;
    void free_list(RecordedList& list) override;
    bool draw(Errors& errors, Handle quads, uint32_t count, int32_t width, int32_t height, float* rgba) override;
    void finish() override;

    /// The shader of one compute entry, or of two that draw. An invalid id with the error.
    Rid shader(Errors& errors, const char* entry, const char* pixel = nullptr);
    Rid uniform_set(Rid shader, const Bound* bound, size_t count);
    Rid uniform_buffer(size_t bytes);
    void update(Rid buffer, const void* bytes, size_t size);
    void free(Rid id);

    const Value rd;
    GDExtensionObjectPtr const object;
    const RdMethods methods;

private:
    static constexpr uint32_t most_kernels = 32;

    struct Kernel {
        const char* entry;
        Rid shader, pipeline;
    };
    /// The blocks as they were last uploaded, so that those that stay the same are not sent again.
    struct Mirror {
        uint8_t* bytes;
        size_t size;
    };

    const Kernel* kernel(Errors& errors, const char* entry, Handle& handle);

    const bool is_local_;
    const AvatarAllocator allocator_;
    Kernel kernels_[most_kernels] = {};
    uint32_t kernel_count_ = 0;
    Value staging_;  // what buffer_update takes its bytes from
    uint8_t* staging_data_ = nullptr;
    size_t staging_size_ = 0;
};

}  // namespace godot
