#pragma once
#include "../scene/draw_blocks.h"
#include "programs.h"

namespace avatar {

/// The image into which quads are blended, its depth, and how it gets onto a framebuffer. Its first row is the top one.
/// What returns false sets the error.
class Draw {
public:
    Draw(const Gl& gl, Programs& programs) : gl_(gl), programs_(programs) {}

    /// Compiles the programs. Before it, nothing else may be called but `release`.
    bool make(Errors& errors);

    /// The kind of the image from now on: AVATAR_GLES_RGBA32F ..
    void set_kind(uint32_t kind);
    uint32_t kind() const { return kind_; }

    /// Binds the image of that size, cleared, with the depth if there is one.
    bool begin(Errors& errors, int32_t width, int32_t height, const AvatarGlesDepth* depth);

    /// Draws the quads of a buffer over each other into what `begin` bound.
    void quads(uint32_t buffer, uint32_t count);

    /// Puts the image onto a framebuffer. Fails where nothing was drawn yet.
    bool composite(Errors& errors, uint32_t framebuffer, const float* background, bool linear);

    /// The image as floats [height, width, 4].
    bool read(Errors& errors, float* rgba);

    void release();

private:

    bool resize(Errors& errors, int32_t width, int32_t height);
    bool make_image();
    void release_image();
    bool bind_framebuffer(Errors& errors, uint32_t framebuffer);
    bool is_depth(Errors& errors, const AvatarGlesDepth& depth, int32_t width, int32_t height);
    void draw_depth(const AvatarGlesDepth& depth);
    void bind_texture(uint32_t texture);
    void bind_block(uint32_t buffer, const void* block, size_t bytes);
    bool has_image(Errors& errors);

    const Gl& gl_;
    Programs& programs_;
    uint32_t splats_ = 0, compositor_ = 0, depths_ = 0;  // programs
    uint32_t vertices_ = 0, empty_ = 0;                  // vertex arrays
    uint32_t raster_ = 0, composite_ = 0;                // uniform buffers
    uint32_t sampler_ = 0;
    uint32_t colour_ = 0, depth_ = 0, framebuffer_ = 0;
    uint32_t kind_ = AVATAR_GLES_RGBA32F;
    int32_t width_ = 0, height_ = 0;
};

}  // namespace avatar
