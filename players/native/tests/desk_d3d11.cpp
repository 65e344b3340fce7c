// A screen of Direct3D 11: a device without a window.
#include <vector>

#include "../d3d11/compiler.h"
#include "desk.h"

#include <psapi.h>

namespace {

ID3D11Device* device = nullptr;
ID3D11DeviceContext* context = nullptr;
ID3D11RenderTargetView* shown = nullptr;

using avatar::drop;

ID3D11Device* make_device() {
    const D3D_FEATURE_LEVEL wanted = D3D_FEATURE_LEVEL_11_0;
    ID3D11Device* made = nullptr;
    const HRESULT result = D3D11CreateDevice(nullptr, D3D_DRIVER_TYPE_HARDWARE, nullptr, 0, &wanted, 1, D3D11_SDK_VERSION, &made, nullptr, nullptr);
    return SUCCEEDED(result) ? made : nullptr;
}

ID3D11Texture2D* texture_of(DXGI_FORMAT format, int width, int height, UINT samples, UINT bind, const float* data = nullptr) {
    D3D11_TEXTURE2D_DESC wanted = {};
    wanted.Width = static_cast<UINT>(width);
    wanted.Height = static_cast<UINT>(height);
    wanted.MipLevels = wanted.ArraySize = 1;
    wanted.SampleDesc.Count = samples;
    wanted.Format = format;
    wanted.BindFlags = bind;
    if (bind == 0) wanted.Usage = D3D11_USAGE_STAGING, wanted.CPUAccessFlags = D3D11_CPU_ACCESS_READ;
    const D3D11_SUBRESOURCE_DATA first = {data, 4 * wanted.Width, 0};
    ID3D11Texture2D* made = nullptr;
    device->CreateTexture2D(&wanted, data == nullptr ? nullptr : &first, &made);
    return made;
}

ID3D11RenderTargetView* target_of(DXGI_FORMAT format, int width, int height, UINT samples) {
    ID3D11Texture2D* texture = texture_of(format, width, height, samples, D3D11_BIND_RENDER_TARGET);
    ID3D11RenderTargetView* view = nullptr;
    if (texture != nullptr) device->CreateRenderTargetView(texture, nullptr, &view);
    drop(texture);
    return view;
}

ID3D11DepthStencilView* depth_of(int width, int height, UINT samples, const float* depths) {
    ID3D11Texture2D* texture = texture_of(DXGI_FORMAT_D32_FLOAT, width, height, samples, D3D11_BIND_DEPTH_STENCIL, depths);
    ID3D11DepthStencilView* view = nullptr;
    if (texture != nullptr) device->CreateDepthStencilView(texture, nullptr, &view);
    drop(texture);
    return view;
}

void read_bytes(ID3D11RenderTargetView* target, int width, int height, UINT samples, Bytes& into) {
    ID3D11Resource* drawn = nullptr;
    target->GetResource(&drawn);
    ID3D11Texture2D* resolved = texture_of(DXGI_FORMAT_R8G8B8A8_UNORM, width, height, 1, D3D11_BIND_RENDER_TARGET);
    ID3D11Texture2D* read = texture_of(DXGI_FORMAT_R8G8B8A8_UNORM, width, height, 1, 0);
    if (samples > 1) context->ResolveSubresource(resolved, 0, drawn, 0, DXGI_FORMAT_R8G8B8A8_UNORM);
    else context->CopyResource(resolved, drawn);
    context->CopyResource(read, resolved);
    D3D11_MAPPED_SUBRESOURCE mapped;
    const size_t row = 4 * static_cast<size_t>(width);
    if (SUCCEEDED(context->Map(read, 0, D3D11_MAP_READ, 0, &mapped))) {
        for (int y = 0; y < height; y++) {
            const uint8_t* from = static_cast<const uint8_t*>(mapped.pData) + size_t{mapped.RowPitch} * static_cast<size_t>(y);
            into.insert(into.end(), from, from + row);
        }
        context->Unmap(read, 0);
    }
    drop(read);
    drop(resolved);
    drop(drawn);
}

}  // namespace

const char* open_screen(const std::string&, int width, int height) {
    device = make_device();
    if (device == nullptr) return "there is no device of Direct3D 11, feature level 11_0";
    device->GetImmediateContext(&context);
    shown = target_of(DXGI_FORMAT_R8G8B8A8_UNORM, width, height, 1);
    return shown != nullptr ? nullptr : "the device makes no render target";
}

void close_screen() {
    drop(shown);
    drop(context);
    drop(device);
}

void finish_screen() {
    const D3D11_QUERY_DESC event = {D3D11_QUERY_EVENT, 0};
    ID3D11Query* query = nullptr;
    if (FAILED(device->CreateQuery(&event, &query))) return;
    context->End(query);
    BOOL done = FALSE;
    while (context->GetData(query, &done, sizeof done, 0) == S_FALSE) {
    }
    drop(query);
}

void alter_screen(const std::string& folder) {
    static std::vector<avatar::HlslText> altered;
    static std::vector<std::string> texts;  // that those point into
    static const avatar::HlslText* const own = avatar::hlsl_texts;
    avatar::hlsl_texts = own;
    if (folder.empty()) return;
    texts.clear();
    altered.clear();
    for (const avatar::HlslText* one = own; one->name != nullptr; one++) {
        const Bytes file = read_file(folder + "/" + one->name);
        texts.emplace_back(file.begin(), file.end());
    }
    for (size_t i = 0; i < texts.size(); i++) altered.push_back({own[i].name, texts[i].c_str()});
    altered.push_back({nullptr, nullptr});
    avatar::hlsl_texts = altered.data();
}

AvatarD3d11* open_scene(const AvatarAllocator& allocator) {
    AvatarD3d11* made = avatar_d3d11_open(device, &allocator);
    std::printf("compiler %s\n", avatar_d3d11_compiler(made));
    return made;
}

int restore_scene(AvatarD3d11* scene) { return avatar_d3d11_restore(scene, device); }

int draw_behind(AvatarD3d11* scene, const AvatarCamera& camera, const float* depths, int reversed) {
    AvatarD3d11Depth depth = {sizeof(AvatarD3d11Depth), reversed, depth_of(camera.width, camera.height, 1, depths)};
    const int good = avatar_d3d11_draw(scene, &camera, &depth);
    drop(depth.view);
    return good;
}

int show_scene(AvatarD3d11* scene) { return avatar_d3d11_composite(scene, shown, nullptr, 0); }

int composite_scene(AvatarD3d11* scene, const AvatarCamera& camera, const float* background, int linear, int samples, Bytes& into) {
    ID3D11RenderTargetView* target = target_of(DXGI_FORMAT_R8G8B8A8_UNORM, camera.width, camera.height, static_cast<UINT>(samples));
    const float grey[] = {0.5f, 0.5f, 0.5f, 1};
    if (target != nullptr) context->ClearRenderTargetView(target, grey);
    const int good = avatar_d3d11_composite(scene, target, background, linear);
    if (good != 0) read_bytes(target, camera.width, camera.height, static_cast<UINT>(samples), into);
    drop(target);
    return good;
}

long resident_pages() {
    PROCESS_MEMORY_COUNTERS held = {};
    K32GetProcessMemoryInfo(GetCurrentProcess(), &held, sizeof held);
    return static_cast<long>(held.WorkingSetSize / 4096);
}

double cpu_seconds() {
    FILETIME begun, ended, spent[2];
    double sum = 0;
    GetProcessTimes(GetCurrentProcess(), &begun, &ended, &spent[0], &spent[1]);
    for (const FILETIME& one : spent) sum += 1e-7 * (4294967296.0 * one.dwHighDateTime + one.dwLowDateTime);
    return sum;
}

void refused_scenes() {
    refused_all(nullptr, "NULL");
    refused_all(avatar_d3d11_open(nullptr, nullptr), "device: is NULL");
    const D3D_FEATURE_LEVEL old = D3D_FEATURE_LEVEL_10_0;
    ID3D11Device* less = nullptr;
    D3D11CreateDevice(nullptr, D3D_DRIVER_TYPE_HARDWARE, nullptr, 0, &old, 1, D3D11_SDK_VERSION, &less, nullptr, nullptr);
    refused_all(avatar_d3d11_open(less, nullptr), "device: has feature level a000");
    drop(less);
}

void refused_views(AvatarD3d11* scene, const AvatarCamera& camera) {
    const auto depth = [&](ID3D11DepthStencilView* view, const char* words, uint32_t size = sizeof(AvatarD3d11Depth)) {
        const AvatarD3d11Depth given = {size, 0, view};
        row("draw depth", avatar_d3d11_draw(scene, &camera, &given) == 0, avatar_d3d11_error(scene), words);
        drop(view);
    };
    const auto target = [&](ID3D11RenderTargetView* view, const char* words) {
        row("composite target", avatar_d3d11_composite(scene, view, nullptr, 0) == 0, avatar_d3d11_error(scene), words);
        drop(view);
    };
    depth(nullptr, "depth: its view is NULL");
    depth(depth_of(3, 2, 1, nullptr), "depth: struct_size", 0);
    depth(depth_of(3, 2, 1, nullptr), "depth: has 3x2 pixels");
    depth(depth_of(camera.width, camera.height, 4, nullptr), "depth: has 4 samples a pixel");
    target(nullptr, "target: is NULL");
    ID3D11Device* const own = device;
    device = make_device();
    ID3D11RenderTargetView* const elsewhere = target_of(DXGI_FORMAT_R8G8B8A8_UNORM, 3, 2, 1);
    ID3D11DepthStencilView* const depth_elsewhere = depth_of(camera.width, camera.height, 1, nullptr);
    depth(depth_elsewhere, "depth: is a view of another device");
    target(elsewhere, "target: is a view of another device");
    drop(device);
    device = own;
}
