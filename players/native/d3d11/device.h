#pragma once
#include "../scene/device.h"
#include "compiler.h"
#include "image.h"

namespace avatar {

/// A device of Direct3D 11: its immediate context, its kernels, and the image.
class D3d11Device final : public Device {
public:
    explicit D3d11Device(const AvatarAllocator& allocator) : allocator_(allocator) {}
    ~D3d11Device() { release(); }

    /// Takes a device, and compiles what draws.
    bool load(Errors& errors, ID3D11Device* given);

    Handle make_buffer(Errors& errors, const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content) override;
    void write_buffer(Handle buffer, const void* bytes, size_t size) override;
    bool read_buffer(Errors& errors, Handle buffer, void* bytes, size_t size) override;
    void free_buffer(Handle buffer) override;
    bool make_list(Errors& errors, RecordedList& list) override;
    void upload(const RecordedList& list) override;
    void run(const RecordedList& list, uint32_t first, uint32_t end, const Clock& clock) override;
    void free_list(RecordedList& list) override;
    bool draw(Errors& errors, Handle quads, uint32_t count, int32_t width, int32_t height, float* rgba) override;
    void finish() override;

    /// Draws quads of a buffer into the image that was begun.
    void draw_quads(Handle quads, uint32_t count);

    /// Releases all that is on the device, and the device. What was compiled stays.
    void release();

    Compiler compiler;
    D3d11Image image;
    char renderer[128] = "";

private:
    static constexpr uint32_t most_kernels = 32;
    static constexpr UINT most_views = RecordedStep::most_bindings;
    static constexpr uint32_t unbound = UINT32_MAX;  // a binding that the compiled kernel does not have

    /// A storage buffer. The first list that binds it says what its elements are; until then `staging` holds its bytes.
    struct Buffer {
        UINT bytes, stride;
        ID3D11Buffer *staging, *buffer;
        ID3D11ShaderResourceView* read;
        ID3D11UnorderedAccessView* write;
    };
    struct Kernel {
        const char* entry;
        ID3D11ComputeShader* shader;
        ID3D11ShaderReflection* binds;
    };

    static Buffer& buffer_of(Handle handle) { return *reinterpret_cast<Buffer*>(handle); }
    ID3D11Buffer* plain_buffer(UINT bytes, D3D11_USAGE usage, UINT bind, UINT access) const;
    bool fill(Buffer& buffer, const AvatarPack* pack, int64_t content);
    bool give_elements(Errors& errors, const char* name, Buffer& buffer, UINT stride);
    const Kernel* kernel(Errors& errors, const char* entry);
    bool bind(Errors& errors, const AvatarBinding& binding, const Kernel& kernel, RecordedStep::Bound& bound);
    void dispatch(const RecordedStep& step);
    void take_name();

    const AvatarAllocator allocator_;
    ID3D11Device* device_ = nullptr;
    ID3D11DeviceContext* context_ = nullptr;
    ID3D11Query* finished_ = nullptr;
    Kernel kernels_[most_kernels] = {};
    uint32_t kernel_count_ = 0;
};

}  // namespace avatar
