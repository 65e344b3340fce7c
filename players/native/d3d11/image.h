#pragma once
#include "../scene/draw_blocks.h"
#include "avatar_d3d11.h"
#include "compiler.h"

namespace avatar {

/// The image into which quads are blended, and how it gets onto a render target. What returns false sets the error.
class D3d11Image {
public:
    /// Takes a device and compiles the shaders. Before it, nothing else may be called but `release`.
    bool make(Errors& errors, ID3D11Device* device, ID3D11DeviceContext* context, Compiler& compiler);

    /// The kind of the image from now on: AVATAR_D3D11_RGBA32F ..
    void set_kind(uint32_t kind);
    uint32_t kind() const { return kind_; }
    bool can_blend(uint32_t kind) const;

    /// Binds the image of that size, cleared, with the depth if there is one.
    bool begin(Errors& errors, int32_t width, int32_t height, const AvatarD3d11Depth* depth);

    /// Draws quads over each other into what `begin` bound, and unbinds it.
    void quads(ID3D11ShaderResourceView* from, uint32_t count);

    /// Puts the image onto a render target. Fails where nothing was drawn yet.
    bool composite(Errors& errors, ID3D11RenderTargetView* target, const float* background, bool linear);

    /// The image as floats [height, width, 4].
    bool read(Errors& errors, float* rgba);

    void release();

private:
    enum { depth_off, depth_normal, depth_reversed, depth_states };

    bool make_shaders(Errors& errors, Compiler& compiler);
    bool make_states();
    bool resize(Errors& errors, int32_t width, int32_t height);
    bool make_image();
    void release_image();
    bool is_depth(Errors& errors, const AvatarD3d11Depth& depth, int32_t width, int32_t height) const;
    bool is_target(Errors& errors, ID3D11RenderTargetView* target) const;
    bool is_own(ID3D11DeviceChild* one) const;
    void set_states(ID3D11RenderTargetView* target, ID3D11DepthStencilView* depth, uint32_t depth_state);
    bool has_image(Errors& errors) const;

    ID3D11Device* device_ = nullptr;  // the caller holds both
    ID3D11DeviceContext* context_ = nullptr;
    ID3D11VertexShader *splats_ = nullptr, *whole_ = nullptr;
    ID3D11PixelShader *splat_ = nullptr, *compositor_ = nullptr;
    ID3D11Buffer *raster_ = nullptr, *composite_ = nullptr;  // constants
    ID3D11BlendState* over_ = nullptr;
    ID3D11RasterizerState* raster_state_ = nullptr;
    ID3D11DepthStencilState* depth_states_[depth_states] = {};
    ID3D11Texture2D* texture_ = nullptr;
    ID3D11RenderTargetView* drawn_ = nullptr;
    ID3D11ShaderResourceView* seen_ = nullptr;
    uint32_t kind_ = AVATAR_D3D11_RGBA32F;
    int32_t width_ = 0, height_ = 0;
};

}  // namespace avatar
