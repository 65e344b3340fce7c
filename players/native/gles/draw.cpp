#include "draw.h"

#include <initializer_list>

#include "../src/formats/finite.h"
#include "buffers.h"

namespace avatar {

static constexpr int32_t quad_bytes = 48;  // three float4
static constexpr float flip_y = -1;        // the first row of the image is the top one

// Not a stage: it turns over the caller's depth, whose first row is at the bottom.
static const char depth_es[] = R"~(#version 310 es
precision highp float;
layout(binding = 0) uniform highp sampler2D depth;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    gl_FragDepth = texelFetch(depth, ivec2(at.x, textureSize(depth, 0).y - 1 - at.y), 0).r;
}
)~";
static const char depth_desktop[] = R"~(#version 430
layout(binding = 0) uniform sampler2D depth;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    gl_FragDepth = texelFetch(depth, ivec2(at.x, textureSize(depth, 0).y - 1 - at.y), 0).r;
}
)~";

bool Draw::make(Errors& errors) {
    const uint32_t language = gl_.language;
    const char* whole = avatar_shader(language, "composite_vertex");
    splats_ = programs_.drawing(errors, "raster", avatar_shader(language, "raster_vertex"), avatar_shader(language, "raster_pixel"));
    compositor_ = splats_ == 0 ? 0 : programs_.drawing(errors, "composite", whole, avatar_shader(language, "composite_pixel"));
    depths_ = compositor_ == 0 ? 0 : programs_.drawing(errors, "depth", whole, gl_.is_es ? depth_es : depth_desktop);
    if (depths_ == 0) return false;
    gl_.GenVertexArrays(1, &vertices_);
    gl_.GenVertexArrays(1, &empty_);
    gl_.GenSamplers(1, &sampler_);
    gl_.SamplerParameteri(sampler_, gl_texture_min_filter, static_cast<int32_t>(gl_nearest));
    gl_.SamplerParameteri(sampler_, gl_texture_mag_filter, static_cast<int32_t>(gl_nearest));
    raster_ = make_buffer(gl_, errors, "of constants", sizeof(RasterBlock));
    composite_ = raster_ == 0 ? 0 : make_buffer(gl_, errors, "of constants", sizeof(CompositeBlock));
    return composite_ != 0;
}

void Draw::set_kind(uint32_t kind) {
    if (kind != kind_) release_image();
    kind_ = kind;
}

bool Draw::begin(Errors& errors, int32_t width, int32_t height, const AvatarGlesDepth* depth) {
    if (depth != nullptr && !is_depth(errors, *depth, width, height)) return false;
    if (!resize(errors, width, height)) return false;
    gl_.BindFramebuffer(gl_framebuffer, framebuffer_);
    gl_.Viewport(0, 0, width, height);
    const uint32_t off[] = {gl_cull_face, gl_scissor_test, gl_stencil_test, gl_dither, gl_blend, gl_depth_test};
    for (uint32_t flag : off) gl_.Disable(flag);
    gl_.DepthMask(1);
    if (depth != nullptr) draw_depth(*depth);
    gl_.ColorMask(1, 1, 1, 1);
    const float zeros[4] = {0, 0, 0, 0};
    gl_.ClearBufferfv(gl_colour, 0, zeros);
    return true;
}

void Draw::quads(uint32_t buffer, uint32_t count) {
    const RasterBlock block = {{static_cast<float>(width_), static_cast<float>(height_)}, flip_y, 0};
    bind_block(raster_, &block, sizeof block);
    gl_.UseProgram(splats_);
    gl_.Enable(gl_blend);
    gl_.BlendEquation(gl_function_add);
    gl_.BlendFunc(gl_one, gl_one_minus_source_alpha);
    gl_.DepthMask(0);  // splats do not hide each other
    gl_.MemoryBarrier(gl_vertex_attribute_barrier);
    gl_.BindVertexArray(vertices_);
    gl_.BindBuffer(gl_array_buffer, buffer);
    for (uint32_t i = 0; i < 3; i++) {
        gl_.EnableVertexAttribArray(i);
        gl_.VertexAttribPointer(i, 4, gl_float, 0, quad_bytes, reinterpret_cast<const void*>(static_cast<uintptr_t>(16 * i)));
        gl_.VertexAttribDivisor(i, 1);
    }
    if (count > 0) gl_.DrawArraysInstanced(gl_triangle_strip, 0, 4, static_cast<int32_t>(count));
    gl_.BindVertexArray(0);
    gl_.DepthMask(1);
}

bool Draw::composite(Errors& errors, uint32_t framebuffer, const float* background, bool linear) {
    if (!has_image(errors)) return false;
    if (background != nullptr && !all_finite(background, 3)) {
        errors.set("background", "has a number that is not finite");
        return false;
    }
    if (!bind_framebuffer(errors, framebuffer)) return false;
    CompositeBlock block = {{0, 0, 0, 0}, linear ? 1.0f : 0.0f, 1, {static_cast<float>(width_), static_cast<float>(height_)}};
    for (int i = 0; background != nullptr && i < 4; i++) block.background[i] = i < 3 ? background[i] : 1;
    bind_block(composite_, &block, sizeof block);
    gl_.Viewport(0, 0, width_, height_);
    const uint32_t off[] = {gl_cull_face, gl_scissor_test, gl_stencil_test, gl_dither, gl_depth_test};
    for (uint32_t flag : off) gl_.Disable(flag);
    gl_.ColorMask(1, 1, 1, 1);
    gl_.Enable(gl_blend);
    gl_.BlendEquation(gl_function_add);
    gl_.BlendFunc(gl_one, gl_one_minus_source_alpha);
    bind_texture(colour_);
    gl_.UseProgram(compositor_);
    gl_.BindVertexArray(empty_);
    gl_.DrawArrays(gl_triangles, 0, 3);
    gl_.BindVertexArray(0);
    bind_texture(0);
    return true;
}

/// Binds the caller's framebuffer, if it can be drawn to. Sets the error.
bool Draw::bind_framebuffer(Errors& errors, uint32_t framebuffer) {
    gl_.clear_errors();
    gl_.BindFramebuffer(gl_framebuffer, framebuffer);
    const bool good = gl_.GetError() == 0 && gl_.CheckFramebufferStatus(gl_framebuffer) == gl_framebuffer_complete;
    if (!good) errors.set("framebuffer", "%u cannot be drawn to: it is none, or not complete", framebuffer);
    return good;
}

bool Draw::read(Errors& errors, float* rgba) {
    if (rgba == nullptr) errors.set("", "no memory is given to read into");
    if (rgba == nullptr || !has_image(errors)) return false;
    gl_.BindFramebuffer(gl_framebuffer, framebuffer_);
    gl_.PixelStorei(gl_pack_alignment, 4);
    const bool bytes = kind_ == AVATAR_GLES_RGBA8;
    gl_.ReadPixels(0, 0, width_, height_, gl_rgba, bytes ? gl_unsigned_byte : gl_float, rgba);
    const size_t values = 4 * static_cast<size_t>(width_) * static_cast<size_t>(height_);
    const uint8_t* read = reinterpret_cast<const uint8_t*>(rgba);  // from the last one on, so that none is lost
    for (size_t i = values; bytes && i > 0; i--) rgba[i - 1] = static_cast<float>(read[i - 1]) / 255.0f;
    return true;
}

/// Whether a texture of depth has the size of the image. Sets the error.
bool Draw::is_depth(Errors& errors, const AvatarGlesDepth& depth, int32_t width, int32_t height) {
    int32_t bits = 0, wide = 0, high = 0;
    gl_.clear_errors();
    bind_texture(depth.texture);  // fails for a name that is none, and for one of another target
    if (depth.texture != 0 && gl_.GetError() == 0) {
        gl_.GetTexLevelParameteriv(gl_texture_2d, 0, gl_texture_depth_size, &bits);
        gl_.GetTexLevelParameteriv(gl_texture_2d, 0, gl_texture_width, &wide);
        gl_.GetTexLevelParameteriv(gl_texture_2d, 0, gl_texture_height, &high);
    }
    bind_texture(0);
    if (bits == 0) errors.set("depth", "texture %u is no GL_TEXTURE_2D of a depth format", depth.texture);
    else if (wide != width || high != height) errors.set("depth", "has %dx%d pixels; the image has %dx%d", wide, high, width, height);
    return !errors.any();
}

/// Draws the caller's depth into that of the image. The test of splats against it stays enabled.
void Draw::draw_depth(const AvatarGlesDepth& depth) {
    gl_.Enable(gl_depth_test);
    gl_.DepthFunc(gl_always);
    gl_.ColorMask(0, 0, 0, 0);
    bind_texture(depth.texture);
    gl_.UseProgram(depths_);
    gl_.BindVertexArray(empty_);
    gl_.DrawArrays(gl_triangles, 0, 3);
    gl_.BindVertexArray(0);
    bind_texture(0);
    gl_.DepthFunc(depth.reversed != 0 ? gl_greater_or_equal : gl_less_or_equal);
}

/// Unit 0, without filtering and comparing; 0: nothing any more.
void Draw::bind_texture(uint32_t texture) {
    gl_.ActiveTexture(gl_texture0);
    gl_.BindTexture(gl_texture_2d, texture);
    gl_.BindSampler(0, texture != 0 ? sampler_ : 0);
}

void Draw::bind_block(uint32_t buffer, const void* block, size_t bytes) {
    gl_.BindBuffer(gl_uniform_buffer, buffer);
    gl_.BufferSubData(gl_uniform_buffer, 0, static_cast<ptrdiff_t>(bytes), block);
    gl_.BindBufferBase(gl_uniform_buffer, constants_binding, buffer);
}

bool Draw::has_image(Errors& errors) {
    if (framebuffer_ == 0) errors.set("", "no image was drawn yet: avatar_gles_draw comes first");
    return framebuffer_ != 0;
}

bool Draw::resize(Errors& errors, int32_t width, int32_t height) {
    if (framebuffer_ != 0 && width == width_ && height == height_) return true;
    if (width < 1 || height < 1 || width > gl_.most_width || height > gl_.most_height) {
        errors.set("the camera", "an image of %dx%d pixels; this GPU draws 1x1 to %dx%d", width, height, gl_.most_width,
                    gl_.most_height);
        return false;
    }
    release_image();
    width_ = width;
    height_ = height;
    if (make_image()) return true;
    release_image();
    static const char* const names[] = {"RGBA32F", "RGBA16F", "RGBA8"};
    errors.set("OpenGL", "this context cannot draw %dx%d pixels into %s", width, height, names[kind_]);
    return false;
}

bool Draw::make_image() {
    static const uint32_t formats[] = {gl_rgba32f, gl_rgba16f, gl_rgba8};
    const uint32_t stored[] = {formats[kind_], gl_depth_component32f};
    const uint32_t attachments[] = {gl_colour_attachment0, gl_depth_attachment};
    uint32_t* const textures[] = {&colour_, &depth_};
    gl_.clear_errors();
    gl_.GenFramebuffers(1, &framebuffer_);
    gl_.BindFramebuffer(gl_framebuffer, framebuffer_);
    gl_.ActiveTexture(gl_texture0);
    for (int i = 0; i < 2; i++) {
        gl_.GenTextures(1, textures[i]);
        gl_.BindTexture(gl_texture_2d, *textures[i]);
        gl_.TexStorage2D(gl_texture_2d, 1, stored[i], width_, height_);
        gl_.TexParameteri(gl_texture_2d, gl_texture_min_filter, static_cast<int32_t>(gl_nearest));
        gl_.TexParameteri(gl_texture_2d, gl_texture_mag_filter, static_cast<int32_t>(gl_nearest));
        gl_.FramebufferTexture2D(gl_framebuffer, attachments[i], gl_texture_2d, *textures[i], 0);
    }
    gl_.BindTexture(gl_texture_2d, 0);
    return gl_.GetError() == 0 && gl_.CheckFramebufferStatus(gl_framebuffer) == gl_framebuffer_complete;
}

void Draw::release_image() {
    if (framebuffer_ != 0) gl_.DeleteFramebuffers(1, &framebuffer_);
    if (colour_ != 0) gl_.DeleteTextures(1, &colour_);
    if (depth_ != 0) gl_.DeleteTextures(1, &depth_);
    framebuffer_ = colour_ = depth_ = 0;
}

void Draw::release() {
    if (splats_ == 0) return;  // nothing was made
    release_image();
    for (uint32_t program : {splats_, compositor_, depths_}) gl_.DeleteProgram(program);
    for (uint32_t array : {vertices_, empty_}) gl_.DeleteVertexArrays(1, &array);
    for (uint32_t buffer : {raster_, composite_}) gl_.DeleteBuffers(1, &buffer);
    gl_.DeleteSamplers(1, &sampler_);
    splats_ = compositor_ = depths_ = vertices_ = empty_ = raster_ = composite_ = sampler_ = 0;
}

}  // namespace avatar
