#include "image.h"

#include <cmath>

#include "../src/formats/finite.h"

namespace avatar {

static constexpr float first_row_on_top = 1;
static const DXGI_FORMAT formats[] = {DXGI_FORMAT_R32G32B32A32_FLOAT, DXGI_FORMAT_R16G16B16A16_FLOAT, DXGI_FORMAT_R8G8B8A8_UNORM};

bool D3d11Image::make(Errors& errors, ID3D11Device* device, ID3D11DeviceContext* context, Compiler& compiler) {
    device_ = device;
    context_ = context;
    if (!make_shaders(errors, compiler)) return false;
    if (!make_states()) errors.set("Direct3D", "the device makes no states to draw with: was it removed?");
    return !errors.any();
}

bool D3d11Image::make_shaders(Errors& errors, Compiler& compiler) {
    ID3DBlob* codes[4] = {};
    static const char* const entries[] = {"raster_vertex_fetch", "composite_vertex", "raster_pixel", "composite_pixel"};
    for (int i = 0; i < 4; i++) {
        const char* file = std::strncmp(entries[i], "raster", 6) == 0 ? "raster.hlsl" : "composite.hlsl";
        codes[i] = compiler.compiled(errors, file, entries[i], i < 2 ? "vs_5_0" : "ps_5_0");
        if (codes[i] == nullptr) return false;
    }
    const auto vertex = [&](ID3DBlob* code, ID3D11VertexShader** made) {
        return SUCCEEDED(device_->CreateVertexShader(code->GetBufferPointer(), code->GetBufferSize(), nullptr, made));
    };
    const auto pixel = [&](ID3DBlob* code, ID3D11PixelShader** made) {
        return SUCCEEDED(device_->CreatePixelShader(code->GetBufferPointer(), code->GetBufferSize(), nullptr, made));
    };
    if (vertex(codes[0], &splats_) && vertex(codes[1], &whole_) && pixel(codes[2], &splat_) && pixel(codes[3], &compositor_)) return true;
    errors.set("Direct3D", "the driver does not take the shaders that draw");
    return false;
}

bool D3d11Image::make_states() {
    const D3D11_BUFFER_DESC constants[] = {{sizeof(RasterBlock), D3D11_USAGE_DEFAULT, D3D11_BIND_CONSTANT_BUFFER, 0, 0, 0},
                                           {sizeof(CompositeBlock), D3D11_USAGE_DEFAULT, D3D11_BIND_CONSTANT_BUFFER, 0, 0, 0}};
    bool good = SUCCEEDED(device_->CreateBuffer(&constants[0], nullptr, &raster_));
    good = good && SUCCEEDED(device_->CreateBuffer(&constants[1], nullptr, &composite_));
    D3D11_BLEND_DESC over = {};
    over.RenderTarget[0] = {TRUE, D3D11_BLEND_ONE, D3D11_BLEND_INV_SRC_ALPHA, D3D11_BLEND_OP_ADD, D3D11_BLEND_ONE,
                            D3D11_BLEND_INV_SRC_ALPHA, D3D11_BLEND_OP_ADD, D3D11_COLOR_WRITE_ENABLE_ALL};
    good = good && SUCCEEDED(device_->CreateBlendState(&over, &over_));
    D3D11_RASTERIZER_DESC raster = {};
    raster.FillMode = D3D11_FILL_SOLID;
    raster.CullMode = D3D11_CULL_NONE;
    raster.DepthClipEnable = TRUE;
    good = good && SUCCEEDED(device_->CreateRasterizerState(&raster, &raster_state_));
    for (int i = 0; i < depth_states && good; i++) {
        D3D11_DEPTH_STENCIL_DESC depth = {};
        depth.DepthEnable = i != depth_off;
        depth.DepthWriteMask = D3D11_DEPTH_WRITE_MASK_ZERO;  // splats do not hide each other
        depth.DepthFunc = i == depth_reversed ? D3D11_COMPARISON_GREATER_EQUAL : D3D11_COMPARISON_LESS_EQUAL;
        good = SUCCEEDED(device_->CreateDepthStencilState(&depth, &depth_states_[i]));
    }
    return good;
}

void D3d11Image::set_kind(uint32_t kind) {
    if (kind != kind_) release_image();
    kind_ = kind;
}

bool D3d11Image::can_blend(uint32_t kind) const {
    UINT support = 0;
    const UINT needed = D3D11_FORMAT_SUPPORT_BLENDABLE | D3D11_FORMAT_SUPPORT_SHADER_LOAD;
    return device_ != nullptr && SUCCEEDED(device_->CheckFormatSupport(formats[kind], &support)) && (support & needed) == needed;
}

bool D3d11Image::begin(Errors& errors, int32_t width, int32_t height, const AvatarD3d11Depth* depth) {
    if (depth != nullptr && !is_depth(errors, *depth, width, height)) return false;
    if (!resize(errors, width, height)) return false;
    const uint32_t state = depth == nullptr ? depth_off : depth->reversed != 0 ? depth_reversed : depth_normal;
    set_states(drawn_, depth == nullptr ? nullptr : depth->view, state);
    const float zeros[4] = {0, 0, 0, 0};
    context_->ClearRenderTargetView(drawn_, zeros);
    return true;
}

/// What both passes draw with.
void D3d11Image::set_states(ID3D11RenderTargetView* target, ID3D11DepthStencilView* depth, uint32_t depth_state) {
    ID3D11ShaderResourceView* const none = nullptr;
    context_->PSSetShaderResources(0, 1, &none);  // the image is read, or drawn into
    context_->OMSetRenderTargets(1, &target, depth);
    context_->OMSetBlendState(over_, nullptr, 0xFFFFFFFFu);
    context_->OMSetDepthStencilState(depth_states_[depth_state], 0);
    context_->RSSetState(raster_state_);
    const D3D11_VIEWPORT whole = {0, 0, static_cast<float>(width_), static_cast<float>(height_), 0, 1};
    context_->RSSetViewports(1, &whole);
    context_->IASetInputLayout(nullptr);
    context_->HSSetShader(nullptr, nullptr, 0);
    context_->DSSetShader(nullptr, nullptr, 0);
    context_->GSSetShader(nullptr, nullptr, 0);
}

void D3d11Image::quads(ID3D11ShaderResourceView* from, uint32_t count) {
    const RasterBlock block = {{static_cast<float>(width_), static_cast<float>(height_)}, first_row_on_top, 0};
    context_->UpdateSubresource(raster_, 0, nullptr, &block, 0, 0);
    context_->IASetPrimitiveTopology(D3D11_PRIMITIVE_TOPOLOGY_TRIANGLESTRIP);
    context_->VSSetShader(splats_, nullptr, 0);
    context_->VSSetConstantBuffers(0, 1, &raster_);
    context_->VSSetShaderResources(0, 1, &from);
    context_->PSSetShader(splat_, nullptr, 0);
    if (count > 0) context_->DrawInstanced(4, count, 0, 0);
    ID3D11ShaderResourceView* const none = nullptr;
    context_->VSSetShaderResources(0, 1, &none);
    context_->OMSetRenderTargets(0, nullptr, nullptr);
}

bool D3d11Image::composite(Errors& errors, ID3D11RenderTargetView* target, const float* background, bool linear) {
    if (!has_image(errors)) return false;
    if (background != nullptr && !all_finite(background, 3)) {
        errors.set("background", "has a number that is not finite");
        return false;
    }
    if (!is_target(errors, target)) return false;
    CompositeBlock block = {{0, 0, 0, 0}, linear ? 1.0f : 0.0f, 0, {static_cast<float>(width_), static_cast<float>(height_)}};
    for (int i = 0; background != nullptr && i < 4; i++) block.background[i] = i < 3 ? background[i] : 1;
    context_->UpdateSubresource(composite_, 0, nullptr, &block, 0, 0);
    set_states(target, nullptr, depth_off);
    context_->IASetPrimitiveTopology(D3D11_PRIMITIVE_TOPOLOGY_TRIANGLELIST);
    context_->VSSetShader(whole_, nullptr, 0);
    context_->PSSetShader(compositor_, nullptr, 0);
    context_->PSSetConstantBuffers(0, 1, &composite_);
    context_->PSSetShaderResources(0, 1, &seen_);
    context_->Draw(3, 0);
    ID3D11ShaderResourceView* const none = nullptr;
    context_->PSSetShaderResources(0, 1, &none);
    context_->OMSetRenderTargets(0, nullptr, nullptr);
    return true;
}

bool D3d11Image::is_own(ID3D11DeviceChild* one) const {
    ID3D11Device* of = nullptr;
    one->GetDevice(&of);
    const bool same = of == device_;
    drop(of);
    return same;
}

/// The texture of a view; false for one that has none of two dimensions.
static bool take_texture(ID3D11View* view, D3D11_TEXTURE2D_DESC& into) {
    ID3D11Resource* resource = nullptr;
    view->GetResource(&resource);
    D3D11_RESOURCE_DIMENSION dimension = D3D11_RESOURCE_DIMENSION_UNKNOWN;
    resource->GetType(&dimension);
    const bool good = dimension == D3D11_RESOURCE_DIMENSION_TEXTURE2D;
    if (good) static_cast<ID3D11Texture2D*>(resource)->GetDesc(&into);
    drop(resource);
    return good;
}

static int side(UINT of, UINT mip) { return static_cast<int>(of >> mip > 0 ? of >> mip : 1); }

/// Whether a view of depth has the size of the image. Sets the error.
bool D3d11Image::is_depth(Errors& errors, const AvatarD3d11Depth& depth, int32_t width, int32_t height) const {
    D3D11_TEXTURE2D_DESC texture;
    if (depth.view == nullptr) errors.set("depth", "its view is NULL");
    else if (!is_own(depth.view)) errors.set("depth", "is a view of another device");
    else if (!take_texture(depth.view, texture)) errors.set("depth", "is no view of a 2D texture");
    if (errors.any()) return false;
    D3D11_DEPTH_STENCIL_VIEW_DESC view;
    depth.view->GetDesc(&view);
    const bool array = view.ViewDimension == D3D11_DSV_DIMENSION_TEXTURE2DARRAY;
    const UINT mip = array ? view.Texture2DArray.MipSlice : view.ViewDimension == D3D11_DSV_DIMENSION_TEXTURE2D ? view.Texture2D.MipSlice : 0;
    const int wide = side(texture.Width, mip), high = side(texture.Height, mip);
    if (texture.SampleDesc.Count != 1) {
        errors.set("depth", "has %u samples a pixel; resolve it: splats are tested against one", texture.SampleDesc.Count);
    } else if (array && view.Texture2DArray.ArraySize != 1) {
        errors.set("depth", "is a view of %u textures; give a view of one", view.Texture2DArray.ArraySize);
    } else if (wide != width || high != height) {
        errors.set("depth", "has %dx%d pixels; the image has %dx%d", wide, high, width, height);
    }
    return !errors.any();
}

/// Whether a view can be drawn to. Sets the error.
bool D3d11Image::is_target(Errors& errors, ID3D11RenderTargetView* target) const {
    if (target == nullptr) errors.set("target", "is NULL");
    else if (!is_own(target)) errors.set("target", "is a view of another device");
    if (errors.any()) return false;
    D3D11_RENDER_TARGET_VIEW_DESC view;
    target->GetDesc(&view);
    UINT support = 0;
    const bool good = SUCCEEDED(device_->CheckFormatSupport(view.Format, &support)) && (support & D3D11_FORMAT_SUPPORT_BLENDABLE) != 0;
    if (!good) errors.set("target", "has DXGI_FORMAT %u, which this device cannot blend into", static_cast<unsigned>(view.Format));
    return good;
}

bool D3d11Image::has_image(Errors& errors) const {
    if (texture_ == nullptr) errors.set("", "no image was drawn yet: avatar_d3d11_draw comes first");
    return texture_ != nullptr;
}

bool D3d11Image::resize(Errors& errors, int32_t width, int32_t height) {
    if (texture_ != nullptr && width == width_ && height == height_) return true;
    const int32_t most = D3D11_REQ_TEXTURE2D_U_OR_V_DIMENSION;
    if (width < 1 || height < 1 || width > most || height > most) {
        errors.set("the camera", "an image of %dx%d pixels; Direct3D 11 draws 1x1 to %dx%d", width, height, most, most);
        return false;
    }
    release_image();
    width_ = width;
    height_ = height;
    if (make_image()) return true;
    release_image();
    static const char* const names[] = {"RGBA32F", "RGBA16F", "RGBA8"};
    errors.set("Direct3D", "this device cannot draw %dx%d pixels into %s", width, height, names[kind_]);
    return false;
}

bool D3d11Image::make_image() {
    D3D11_TEXTURE2D_DESC wanted = {};
    wanted.Width = static_cast<UINT>(width_);
    wanted.Height = static_cast<UINT>(height_);
    wanted.MipLevels = wanted.ArraySize = wanted.SampleDesc.Count = 1;
    wanted.Format = formats[kind_];
    wanted.BindFlags = D3D11_BIND_RENDER_TARGET | D3D11_BIND_SHADER_RESOURCE;
    return SUCCEEDED(device_->CreateTexture2D(&wanted, nullptr, &texture_)) &&
           SUCCEEDED(device_->CreateRenderTargetView(texture_, nullptr, &drawn_)) &&
           SUCCEEDED(device_->CreateShaderResourceView(texture_, nullptr, &seen_));
}

static float float_of_half(const uint8_t* from) {
    const int bits = from[0] | from[1] << 8, exponent = bits >> 10 & 31, fraction = bits & 1023;
    const float size = exponent == 31  ? (fraction != 0 ? NAN : INFINITY)
                       : exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                                       : std::ldexp(static_cast<float>(1024 + fraction), exponent - 25);
    return (bits & 0x8000) != 0 ? -size : size;
}

bool D3d11Image::read(Errors& errors, float* rgba) {
    if (rgba == nullptr) errors.set("", "no memory is given to read into");
    if (rgba == nullptr || !has_image(errors)) return false;
    D3D11_TEXTURE2D_DESC wanted;
    texture_->GetDesc(&wanted);
    wanted.Usage = D3D11_USAGE_STAGING;
    wanted.BindFlags = 0;
    wanted.CPUAccessFlags = D3D11_CPU_ACCESS_READ;
    ID3D11Texture2D* staging = nullptr;
    D3D11_MAPPED_SUBRESOURCE mapped = {};
    bool good = SUCCEEDED(device_->CreateTexture2D(&wanted, nullptr, &staging));
    if (good) context_->CopyResource(staging, texture_);
    good = good && SUCCEEDED(context_->Map(staging, 0, D3D11_MAP_READ, 0, &mapped));
    const size_t values = 4 * static_cast<size_t>(width_);
    for (int32_t y = 0; good && y < height_; y++) {
        const uint8_t* from = static_cast<const uint8_t*>(mapped.pData) + size_t{mapped.RowPitch} * static_cast<size_t>(y);
        float* to = rgba + values * static_cast<size_t>(y);
        if (kind_ == AVATAR_D3D11_RGBA32F) std::memcpy(to, from, values * sizeof(float));
        for (size_t i = 0; kind_ != AVATAR_D3D11_RGBA32F && i < values; i++) {
            to[i] = kind_ == AVATAR_D3D11_RGBA8 ? static_cast<float>(from[i]) / 255.0f : float_of_half(from + 2 * i);
        }
    }
    if (good) context_->Unmap(staging, 0);
    drop(staging);
    if (!good) errors.set("Direct3D", "the image cannot be read: was the device removed?");
    return good;
}

void D3d11Image::release_image() {
    drop(seen_);
    drop(drawn_);
    drop(texture_);
}

void D3d11Image::release() {
    release_image();
    drop(splats_);
    drop(whole_);
    drop(splat_);
    drop(compositor_);
    drop(raster_);
    drop(composite_);
    drop(over_);
    drop(raster_state_);
    for (ID3D11DepthStencilState*& one : depth_states_) drop(one);
}

}  // namespace avatar
