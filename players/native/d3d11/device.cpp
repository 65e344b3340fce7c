#include "device.h"

#include <dxgi.h>

#include <cstdio>

namespace avatar {

bool D3d11Device::load(Errors& errors, ID3D11Device* given) {
    if (given == nullptr) {
        errors.set("device", "is NULL: give one of Direct3D 11");
        return false;
    }
    if (given->GetFeatureLevel() < D3D_FEATURE_LEVEL_11_0) {
        errors.set("device", "has feature level %x; kernels need 11_0, %x", static_cast<unsigned>(given->GetFeatureLevel()),
                   static_cast<unsigned>(D3D_FEATURE_LEVEL_11_0));
        return false;
    }
    if (!compiler.load(errors)) return false;
    device_ = given;
    device_->AddRef();
    device_->GetImmediateContext(&context_);
    const D3D11_QUERY_DESC event = {D3D11_QUERY_EVENT, 0};
    if (FAILED(device_->CreateQuery(&event, &finished_))) errors.set("Direct3D", "the device makes no query: was it removed?");
    take_name();
    return !errors.any() && image.make(errors, device_, context_, compiler);
}

void D3d11Device::take_name() {
    static const IID id = {0x54ec77fa, 0x1377, 0x44e6, {0x8c, 0x32, 0x88, 0xfd, 0x5f, 0x44, 0xc8, 0x4c}};  // IID_IDXGIDevice
    void* made = nullptr;
    if (FAILED(device_->QueryInterface(id, &made))) return;
    IDXGIDevice* dxgi = static_cast<IDXGIDevice*>(made);
    IDXGIAdapter* adapter = nullptr;
    DXGI_ADAPTER_DESC told = {};
    if (SUCCEEDED(dxgi->GetAdapter(&adapter)) && SUCCEEDED(adapter->GetDesc(&told))) {
        WideCharToMultiByte(CP_UTF8, 0, told.Description, -1, renderer, sizeof renderer - 1, nullptr, nullptr);
    }
    drop(adapter);
    drop(dxgi);
}

ID3D11Buffer* D3d11Device::plain_buffer(UINT bytes, D3D11_USAGE usage, UINT bind, UINT access) const {
    const D3D11_BUFFER_DESC wanted = {bytes, usage, bind, access, 0, 0};
    ID3D11Buffer* made = nullptr;
    return SUCCEEDED(device_->CreateBuffer(&wanted, nullptr, &made)) ? made : nullptr;
}

/// A whole number of float4.
static uint64_t padded(uint64_t bytes) { return bytes < 16 ? 16 : (bytes + 15) / 16 * 16; }

Handle D3d11Device::make_buffer(Errors& errors, const char* name, uint64_t bytes, const AvatarPack* pack, int64_t content) {
    void* memory = allocator_.allocate(allocator_.user, sizeof(Buffer));
    if (memory == nullptr) {
        errors.set_memory();
        return 0;
    }
    Buffer& made = *static_cast<Buffer*>(memory) = {};
    const uint64_t size = padded(bytes);
    made.bytes = size <= UINT32_MAX - 15 ? static_cast<UINT>(size) : 0;
    if (made.bytes > 0) made.staging = plain_buffer(made.bytes, D3D11_USAGE_STAGING, 0, D3D11_CPU_ACCESS_WRITE | D3D11_CPU_ACCESS_READ);
    const Handle handle = reinterpret_cast<Handle>(memory);
    if (made.staging != nullptr && fill(made, pack, content)) return handle;
    free_buffer(handle);
    errors.set("Direct3D", "buffer %s: the GPU has no room for %llu bytes, or was removed. A coarser level of detail takes less.",
               name, static_cast<unsigned long long>(bytes));
    return 0;
}

bool D3d11Device::fill(Buffer& buffer, const AvatarPack* pack, int64_t content) {
    D3D11_MAPPED_SUBRESOURCE mapped;
    if (FAILED(context_->Map(buffer.staging, 0, D3D11_MAP_WRITE, 0, &mapped))) return false;
    std::memset(mapped.pData, 0, buffer.bytes);
    const bool good = content < 0 || avatar_buffer_content(pack, static_cast<uint32_t>(content), mapped.pData) == AVATAR_OK;
    context_->Unmap(buffer.staging, 0);
    return good;
}

/// Makes the buffer as kernels read it: elements of `stride` bytes. Sets the error.
bool D3d11Device::give_elements(Errors& errors, const char* name, Buffer& buffer, UINT stride) {
    if (buffer.stride == stride) return true;
    if (buffer.stride != 0 || stride == 0 || buffer.bytes % stride != 0) {
        errors.set("Direct3D", "buffer %s is bound with elements of %u bytes and of %u", name, buffer.stride, stride);
        return false;
    }
    const UINT bind = D3D11_BIND_SHADER_RESOURCE | D3D11_BIND_UNORDERED_ACCESS;
    const D3D11_BUFFER_DESC wanted = {buffer.bytes, D3D11_USAGE_DEFAULT, bind, 0, D3D11_RESOURCE_MISC_BUFFER_STRUCTURED, stride};
    const bool good = SUCCEEDED(device_->CreateBuffer(&wanted, nullptr, &buffer.buffer)) &&
                      SUCCEEDED(device_->CreateShaderResourceView(buffer.buffer, nullptr, &buffer.read)) &&
                      SUCCEEDED(device_->CreateUnorderedAccessView(buffer.buffer, nullptr, &buffer.write));
    if (!good) {
        errors.set("Direct3D", "buffer %s: the GPU has no room for %u bytes, or was removed. A coarser level of detail takes less.",
                   name, buffer.bytes);
        return false;
    }
    context_->CopyResource(buffer.buffer, buffer.staging);
    drop(buffer.staging);
    buffer.stride = stride;
    return true;
}

void D3d11Device::write_buffer(Handle handle, const void* bytes, size_t size) {
    const Buffer& buffer = buffer_of(handle);
    if (size == 0) return;
    D3D11_MAPPED_SUBRESOURCE mapped;
    if (buffer.buffer != nullptr) {
        const D3D11_BOX box = {0, 0, 0, static_cast<UINT>(size), 1, 1};
        context_->UpdateSubresource(buffer.buffer, 0, &box, bytes, 0, 0);
    } else if (SUCCEEDED(context_->Map(buffer.staging, 0, D3D11_MAP_WRITE, 0, &mapped))) {
        std::memcpy(mapped.pData, bytes, size);
        context_->Unmap(buffer.staging, 0);
    }
}

bool D3d11Device::read_buffer(Errors& errors, Handle handle, void* bytes, size_t size) {
    if (size == 0) return true;
    const Buffer& buffer = buffer_of(handle);
    ID3D11Buffer* own = buffer.buffer == nullptr ? nullptr : plain_buffer(buffer.bytes, D3D11_USAGE_STAGING, 0, D3D11_CPU_ACCESS_READ);
    if (own != nullptr) context_->CopyResource(own, buffer.buffer);
    ID3D11Buffer* from = own != nullptr ? own : buffer.staging;
    D3D11_MAPPED_SUBRESOURCE mapped;
    const bool good = from != nullptr && SUCCEEDED(context_->Map(from, 0, D3D11_MAP_READ, 0, &mapped));
    if (good) std::memcpy(bytes, mapped.pData, size);
    if (good) context_->Unmap(from, 0);
    drop(own);
    if (!good) errors.set("Direct3D", "a buffer cannot be read: was the device removed?");
    return good;
}

void D3d11Device::free_buffer(Handle handle) {
    Buffer& buffer = buffer_of(handle);
    drop(buffer.read);
    drop(buffer.write);
    drop(buffer.staging);
    drop(buffer.buffer);
    allocator_.release(allocator_.user, &buffer, sizeof buffer);
}

const D3d11Device::Kernel* D3d11Device::kernel(Errors& errors, const char* entry) {
    for (uint32_t i = 0; i < kernel_count_; i++) {
        if (std::strcmp(kernels_[i].entry, entry) == 0) return &kernels_[i];
    }
    char file[64];
    std::snprintf(file, sizeof file, "%s.hlsl", entry);
    ID3DBlob* code = compiler.compiled(errors, file, entry, "cs_5_0");
    if (code == nullptr || kernel_count_ == most_kernels) return nullptr;
    Kernel made = {entry, nullptr, compiler.reflected(errors, entry, code)};
    if (made.binds == nullptr) return nullptr;
    if (FAILED(device_->CreateComputeShader(code->GetBufferPointer(), code->GetBufferSize(), nullptr, &made.shader))) {
        errors.set(entry, "the driver does not take this shader");
        drop(made.binds);
        return nullptr;
    }
    return &(kernels_[kernel_count_++] = made);
}

/// Finds the register of a binding by its name, and gives its buffer the elements that the kernel has.
bool D3d11Device::bind(Errors& errors, const AvatarBinding& binding, const Kernel& kernel, RecordedStep::Bound& bound) {
    D3D11_SHADER_INPUT_BIND_DESC found;
    bound.binding = unbound;
    if (FAILED(kernel.binds->GetResourceBindingDescByName(binding.name, &found))) return true;
    const bool written = found.Type == D3D_SIT_UAV_RWSTRUCTURED;
    if ((!written && found.Type != D3D_SIT_STRUCTURED) || written == bound.read_only || found.BindPoint >= most_views) {
        errors.set(kernel.entry, "binds %s otherwise than this player knows it", binding.name);
        return false;
    }
    bound.binding = found.BindPoint;
    return give_elements(errors, binding.buffer, buffer_of(bound.buffer), found.NumSamples);
}

bool D3d11Device::make_list(Errors& errors, RecordedList& list) {
    for (uint32_t i = 0; i < list.steps.size; i++) {
        RecordedStep& step = list.steps[i];
        const Kernel* found = kernel(errors, step.dispatch.entry);
        if (found == nullptr) return false;
        step.kernel = reinterpret_cast<Handle>(found->shader);
        for (uint32_t b = 0; b < step.count; b++) {
            AvatarBinding one;
            avatar_binding(list.passes, i, b, &one);
            if (!bind(errors, one, *found, step.bound[b])) return false;
        }
        const UINT bytes = static_cast<UINT>(padded(step.dispatch.block_bytes));
        step.block = reinterpret_cast<Handle>(plain_buffer(bytes, D3D11_USAGE_DEFAULT, D3D11_BIND_CONSTANT_BUFFER, 0));
        if (step.block == 0) errors.set("Direct3D", "the GPU has no room for constants, or was removed");
        if (step.block == 0) return false;
    }
    return true;
}

void D3d11Device::upload(const RecordedList& list) {
    size_t bytes = 0;
    const uint8_t* blocks = static_cast<const uint8_t*>(avatar_passes_blocks(list.passes, &bytes));
    for (const RecordedStep& step : list.steps) {
        context_->UpdateSubresource(reinterpret_cast<ID3D11Buffer*>(step.block), 0, nullptr, blocks + step.dispatch.block_offset, 0, 0);
    }
}

void D3d11Device::dispatch(const RecordedStep& step) {
    ID3D11ShaderResourceView* read[most_views] = {};
    ID3D11UnorderedAccessView* write[most_views] = {};
    for (uint32_t b = 0; b < step.count; b++) {
        const RecordedStep::Bound& bound = step.bound[b];
        if (bound.binding == unbound) continue;
        if (bound.read_only) read[bound.binding] = buffer_of(bound.buffer).read;
        else write[bound.binding] = buffer_of(bound.buffer).write;
    }
    ID3D11Buffer* const block = reinterpret_cast<ID3D11Buffer*>(step.block);
    ID3D11ShaderResourceView* const none[most_views] = {};
    context_->CSSetShaderResources(0, most_views, none);  // what is bound for reading is not bound for writing
    context_->CSSetUnorderedAccessViews(0, most_views, write, nullptr);
    context_->CSSetShaderResources(0, most_views, read);
    context_->CSSetConstantBuffers(0, 1, &block);
    context_->CSSetShader(reinterpret_cast<ID3D11ComputeShader*>(step.kernel), nullptr, 0);
    context_->Dispatch(step.dispatch.groups, 1, 1);
}

void D3d11Device::run(const RecordedList& list, uint32_t first, uint32_t end, const Clock& clock) {
    for (uint32_t i = first; i < end; i++) {
        dispatch(list.steps[i]);
        const char* stage = list.steps[i].dispatch.stage;
        const bool last = i + 1 == end || std::strcmp(list.steps[i + 1].dispatch.stage, stage) != 0;
        if (last) clock.end(*this, stage);
    }
    ID3D11ShaderResourceView* const none[most_views] = {};
    ID3D11UnorderedAccessView* const unwritten[most_views] = {};
    context_->CSSetShaderResources(0, most_views, none);
    context_->CSSetUnorderedAccessViews(0, most_views, unwritten, nullptr);
}

void D3d11Device::free_list(RecordedList& list) {
    for (RecordedStep& step : list.steps) {
        ID3D11Buffer* block = reinterpret_cast<ID3D11Buffer*>(step.block);
        drop(block);
        step.block = 0;
    }
}

void D3d11Device::draw_quads(Handle quads, uint32_t count) {
    image.quads(quads == 0 ? nullptr : buffer_of(quads).read, count);
}

bool D3d11Device::draw(Errors& errors, Handle quads, uint32_t count, int32_t width, int32_t height, float* rgba) {
    if (!image.begin(errors, width, height, nullptr)) return false;
    draw_quads(quads, count);
    return image.read(errors, rgba);
}

void D3d11Device::finish() {
    context_->End(finished_);
    BOOL done = FALSE;
    while (context_->GetData(finished_, &done, sizeof done, 0) == S_FALSE) {
    }
}

void D3d11Device::release() {
    image.release();
    for (uint32_t i = 0; i < kernel_count_; i++) {
        drop(kernels_[i].shader);
        drop(kernels_[i].binds);
    }
    kernel_count_ = 0;
    drop(finished_);
    drop(context_);
    drop(device_);
}

}  // namespace avatar
