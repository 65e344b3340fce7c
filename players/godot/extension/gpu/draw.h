// The image into which splats are blended, and how it gets into a viewport.
#pragma once
#include "rendering_device.h"

namespace godot {

class Draw {
public:
    explicit Draw(RdDevice& device) : device_(device) {}
    ~Draw();
    Draw(const Draw&) = delete;

    /// Compiles the shaders, once.
    bool make(Errors& errors);

    /// Draws quads over each other into a float image of zeros. `scene_depth` hides what lies behind it; it may be none.
    bool quads(Errors& errors, Rid quads, uint32_t count, Vector2i size, Rid scene_depth);

    /// Puts the image over what a texture of linear light holds.
    bool composite(Errors& errors, Rid colour);

    /// The image as floats [height, width, 4], first row on top. Waits for the GPU.
    bool read(Errors& errors, float* rgba) const;
    Vector2i size() const { return image_ == nullptr ? Vector2i{0, 0} : image_->size; }

private:
    static constexpr uint32_t most_images = 8, most_targets = 16, most_pipelines = 4;
    static constexpr uint64_t kept_for = 128;  // views that an image of another size waits to be used again

    struct Image {  // one of each size in use
        Vector2i size;
        Rid colour, depth, framebuffer, block, set;
        Rid quads;  // that `set` binds
        uint64_t used;
    };
    struct Target {  // what a viewport gives
        Rid colour, framebuffer, set, block, image_colour, pipeline;
        uint64_t used;
    };
    struct Depth {
        Rid texture, set, pipeline;
        uint64_t used;
    };
    struct Pipeline {
        int64_t format;
        Rid pipeline;
    };

    Image* image_of(Errors& errors, Vector2i size);
    Target* target_of(Errors& errors, Rid colour);
    const Depth& depth_of(Rid texture);
    Rid pipeline(Rid shader, Rid framebuffer, int64_t primitive, int64_t depth_test, bool blends, double brightness);
    Rid composite_pipeline(Rid framebuffer, Rid colour);
    Rid framebuffer(Rid colour, Rid depth);
    Rid texture(Vector2i size, int64_t format, int64_t usage);
    bool is_set(Rid set) const { return set.id != 0 && device_.methods.uniform_set_is_valid.call<uint8_t>(device_.object, set) != 0; }
    bool is_framebuffer(Rid id) const { return id.id != 0 && device_.methods.framebuffer_is_valid.call<uint8_t>(device_.object, id) != 0; }
    int64_t begin(Rid framebuffer, int64_t flags);
    void release(Image& image);
    void release(Target& target);

    RdDevice& device_;
    Rid splats_, compositor_, depths_, samples_;  // shaders
    Rid splat_pipeline_, depth_pipeline_, samples_pipeline_;
    Pipeline composites_[most_pipelines] = {};
    uint32_t composite_count_ = 0;
    Image images_[most_images] = {};
    Target targets_[most_targets] = {};
    Depth depth_sets_[most_targets] = {};
    Image* image_ = nullptr;
    uint64_t clock_ = 0;
    Value clear_ = Value::empty(GDEXTENSION_VARIANT_TYPE_PACKED_COLOR_ARRAY);
};

}  // namespace godot
