// Direct3D 11, without a window: how a host plays avatars with avatar_d3d11.h.
#include "screen.h"

#if !defined(_WIN32)

std::unique_ptr<PlayScreen> make_d3d11_screen() { return nullptr; }

#else

#define NOMINMAX
#include <d3d11.h>

#include "../d3d11/avatar_d3d11.h"

namespace {

template <class T>
void drop(T*& one) {
    if (one != nullptr) one->Release();
    one = nullptr;
}

class D3d11Screen final : public PlayScreen {
public:
    ~D3d11Screen() override {
        avatar_d3d11_close(scene_);
        drop(view_);
        drop(drawn_);
        drop(read_);
        drop(context_);
        drop(device_);
    }

    const char* open(const Options& options) override {
        if (options.window) return "--window: not together with --api d3d11";
        const D3D_FEATURE_LEVEL wanted = D3D_FEATURE_LEVEL_11_0;
        const HRESULT made = D3D11CreateDevice(nullptr, D3D_DRIVER_TYPE_HARDWARE, nullptr, 0, &wanted, 1, D3D11_SDK_VERSION, &device_,
                                               nullptr, &context_);
        if (FAILED(made)) return "Direct3D makes no device of feature level 11_0: is a driver of the GPU installed?";
        const bool good = make_texture(options, D3D11_BIND_RENDER_TARGET, &drawn_) && make_texture(options, 0, &read_) &&
                          SUCCEEDED(device_->CreateRenderTargetView(drawn_, nullptr, &view_));
        if (!good) return "Direct3D makes no image of this size";
        scene_ = avatar_d3d11_open(device_, nullptr);
        if (error() == nullptr && options.target >= 0) avatar_d3d11_set_target(scene_, static_cast<uint32_t>(options.target));
        return error();
    }

    const char* error() const override { return avatar_d3d11_error(scene_); }

    bool add(const AvatarPack* pack, AvatarInstance* instance) override { return avatar_d3d11_add(scene_, pack, instance) != 0; }

    bool draw(const AvatarCamera& camera, const float* behind) override {
        return avatar_d3d11_pose(scene_) && avatar_d3d11_draw(scene_, &camera, nullptr) &&
               avatar_d3d11_composite(scene_, view_, behind, 0);
    }

    bool read(std::vector<uint8_t>& rgba) override {
        D3D11_TEXTURE2D_DESC size;
        D3D11_MAPPED_SUBRESOURCE mapped;
        read_->GetDesc(&size);
        context_->CopyResource(read_, drawn_);
        if (FAILED(context_->Map(read_, 0, D3D11_MAP_READ, 0, &mapped))) return false;
        rgba.clear();
        for (size_t y = 0; y < size.Height; y++) {
            const uint8_t* row = static_cast<const uint8_t*>(mapped.pData) + mapped.RowPitch * y;
            rgba.insert(rgba.end(), row, row + 4 * size_t{size.Width});
        }
        context_->Unmap(read_, 0);
        return true;
    }

    const char* renderer() const override { return avatar_d3d11_renderer(scene_); }
    uint32_t target() const override { return avatar_d3d11_target(scene_); }
    void set_clock(void (*ended)(void*, const char*), void* user) override { avatar_d3d11_set_clock(scene_, ended, user); }

private:
    /// A target, or with `bind` 0 what the CPU reads.
    bool make_texture(const Options& options, UINT bind, ID3D11Texture2D** made) {
        D3D11_TEXTURE2D_DESC wanted = {};
        wanted.Width = static_cast<UINT>(options.width);
        wanted.Height = static_cast<UINT>(options.height);
        wanted.MipLevels = wanted.ArraySize = wanted.SampleDesc.Count = 1;
        wanted.Format = DXGI_FORMAT_R8G8B8A8_UNORM;
        wanted.BindFlags = bind;
        if (bind == 0) wanted.Usage = D3D11_USAGE_STAGING, wanted.CPUAccessFlags = D3D11_CPU_ACCESS_READ;
        return SUCCEEDED(device_->CreateTexture2D(&wanted, nullptr, made));
    }

    ID3D11Device* device_ = nullptr;
    ID3D11DeviceContext* context_ = nullptr;
    ID3D11Texture2D *drawn_ = nullptr, *read_ = nullptr;
    ID3D11RenderTargetView* view_ = nullptr;
    AvatarD3d11* scene_ = nullptr;
};

}  // namespace

std::unique_ptr<PlayScreen> make_d3d11_screen() { return std::make_unique<D3d11Screen>(); }

#endif
