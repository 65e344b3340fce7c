#include "draw.h"

#include "../../../native/scene/draw_blocks.h"

namespace godot {

using avatar::CompositeBlock;
using avatar::constants_binding;
using avatar::RasterBlock;

static constexpr float first_row_on_top = -1;  // Vulkan's clip space points down

/// The element that was used longest ago.
template <class T, size_t N>
static T& oldest(T (&rows)[N]) {
    T* found = rows;
    for (T& row : rows) {
        if (row.used < found->used) found = &row;
    }
    return *found;
}

Draw::~Draw() {
    for (Target& one : targets_) release(one);
    for (Depth& one : depth_sets_) {
        if (is_set(one.set)) device_.free(one.set);
    }
    for (Image& one : images_) release(one);
    for (Rid shader : {splats_, compositor_, depths_, samples_}) device_.free(shader);  // their pipelines go with them
}

bool Draw::make(Errors& errors) {
    if (samples_.id != 0) return true;
    splats_ = device_.shader(errors, "raster_vertex_fetch", "raster_pixel");
    if (splats_.id != 0) compositor_ = device_.shader(errors, "composite_vertex", "composite_pixel");
    if (compositor_.id != 0) depths_ = device_.shader(errors, "composite_vertex", "depth_pixel");
    if (depths_.id != 0) samples_ = device_.shader(errors, "composite_vertex", "depth_samples_pixel");
    float none[4] = {0, 0, 0, 0};
    clear_.append(Value::of_pointer(GDEXTENSION_VARIANT_TYPE_COLOR, none));
    return samples_.id != 0;
}

Rid Draw::texture(Vector2i size, int64_t format, int64_t usage) {
    const Value wanted = construct("RDTextureFormat");
    wanted.call("set_format", {format});
    wanted.call("set_width", {size.x});
    wanted.call("set_height", {size.y});
    wanted.call("set_usage_bits", {usage});
    return device_.rd.call("texture_create", {wanted, construct("RDTextureView")}).to_rid();
}

Rid Draw::framebuffer(Rid colour, Rid depth) {
    const Value textures = Value::array();
    textures.append(colour);
    if (depth.id != 0) textures.append(depth);
    return device_.rd.call("framebuffer_create", {textures}).to_rid();
}

/// A pipeline of a full screen or of quads. `depth_test` below 0: none. `brightness`: what colours are multiplied by.
Rid Draw::pipeline(Rid shader, Rid framebuffer, int64_t primitive, int64_t depth_test, bool blends, double brightness) {
    const Value raster = construct("RDPipelineRasterizationState"), depth = construct("RDPipelineDepthStencilState");
    const Value blend = construct("RDPipelineColorBlendState"), one = construct("RDPipelineColorBlendStateAttachment");
    depth.call("set_enable_depth_test", {depth_test >= 0});
    depth.call("set_enable_depth_write", {!blends});
    if (depth_test >= 0) depth.call("set_depth_compare_operator", {depth_test});
    one.call("set_enable_blend", {blends});
    const int64_t left = RenderingDevice_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
    one.call("set_src_color_blend_factor", {RenderingDevice_BLEND_FACTOR_CONSTANT_COLOR});
    one.call("set_src_alpha_blend_factor", {RenderingDevice_BLEND_FACTOR_ONE});
    for (const char* set : {"set_dst_color_blend_factor", "set_dst_alpha_blend_factor"}) one.call(set, {left});
    for (const char* set : {"set_write_r", "set_write_g", "set_write_b", "set_write_a"}) one.call(set, {blends});
    float constant[4] = {static_cast<float>(brightness), static_cast<float>(brightness), static_cast<float>(brightness), 1};
    blend.call("set_blend_constant", {Value::of_pointer(GDEXTENSION_VARIANT_TYPE_COLOR, constant)});
    const Value attachments = Value::array();
    attachments.append(one);
    blend.call("set_attachments", {attachments});
    const int64_t format = device_.rd.call("framebuffer_get_format", {framebuffer}).to_int();
    return device_.rd
        .call("render_pipeline_create",
              {shader, format, -1, primitive, raster, construct("RDPipelineMultisampleState"), depth, blend})
        .to_rid();
}

Draw::Image* Draw::image_of(Errors& errors, Vector2i size) {
    for (Image& one : images_) {
        if (one.colour.id != 0 && one.size.x == size.x && one.size.y == size.y) return &one;
    }
    Image& made = oldest(images_);
    release(made);
    made = {};
    made.size = size;
    const int64_t colour_usage = RenderingDevice_TEXTURE_USAGE_COLOR_ATTACHMENT_BIT | RenderingDevice_TEXTURE_USAGE_SAMPLING_BIT |
                                 RenderingDevice_TEXTURE_USAGE_CAN_COPY_FROM_BIT;
    made.colour = texture(size, RenderingDevice_DATA_FORMAT_R32G32B32A32_SFLOAT, colour_usage);
    made.depth = texture(size, RenderingDevice_DATA_FORMAT_D32_SFLOAT, RenderingDevice_TEXTURE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT);
    if (made.colour.id != 0 && made.depth.id != 0) made.framebuffer = framebuffer(made.colour, made.depth);
    if (made.framebuffer.id == 0) {
        release(made);
        errors.set("the GPU", "it makes no image of %dx%d pixels to blend splats into", size.x, size.y);
        return nullptr;
    }
    const RasterBlock block = {{static_cast<float>(size.x), static_cast<float>(size.y)}, first_row_on_top, 0};
    made.block = device_.uniform_buffer(sizeof block);
    device_.update(made.block, &block, sizeof block);
    if (splat_pipeline_.id == 0) {
        splat_pipeline_ = pipeline(splats_, made.framebuffer, RenderingDevice_RENDER_PRIMITIVE_TRIANGLE_STRIPS,
                                   RenderingDevice_COMPARE_OP_GREATER_OR_EQUAL, true, 1);
        for (Rid shader : {depths_, samples_}) {
            (shader.id == depths_.id ? depth_pipeline_ : samples_pipeline_) = pipeline(
                shader, made.framebuffer, RenderingDevice_RENDER_PRIMITIVE_TRIANGLES, RenderingDevice_COMPARE_OP_ALWAYS, false, 1);
        }
    }
    return &made;
}

/// What gives a depth of the scene to the pass that copies it.
const Draw::Depth& Draw::depth_of(Rid texture) {
    for (Depth& one : depth_sets_) {
        if (one.texture.id != texture.id || !is_set(one.set)) continue;
        one.used = clock_;
        return one;
    }
    Depth& made = oldest(depth_sets_);
    if (is_set(made.set)) device_.free(made.set);
    const Bound bound = {RenderingDevice_UNIFORM_TYPE_TEXTURE, 0, texture};
    const int64_t samples = device_.rd.call("texture_get_format", {texture}).call("get_samples").to_int();
    const bool is_one = samples == RenderingDevice_TEXTURE_SAMPLES_1;
    made = {texture, device_.uniform_set(is_one ? depths_ : samples_, &bound, 1), is_one ? depth_pipeline_ : samples_pipeline_, clock_};
    return made;
}

int64_t Draw::begin(Rid framebuffer, int64_t flags) {
    const double clear_depth = 0;
    const int64_t zero = 0;
    const float region[4] = {0, 0, 0, 0};
    const void* arguments[] = {&framebuffer, &flags, clear_.inner(), &clear_depth, &zero, region, &zero};
    int64_t list = 0;
    engine.object_method_bind_ptrcall(device_.methods.draw_list_begin.bind(), device_.object, arguments, &list);
    return list;
}

bool Draw::quads(Errors& errors, Rid quads, uint32_t count, Vector2i size, Rid scene_depth) {
    clock_++;
    image_ = image_of(errors, size);
    if (image_ == nullptr) return false;
    image_->used = clock_;
    for (Image& one : images_) {
        if (one.used + kept_for < clock_) release(one);
    }
    if (quads.id != 0 && (image_->quads.id != quads.id || !is_set(image_->set))) {
        if (is_set(image_->set)) device_.free(image_->set);
        const Bound bound[] = {{RenderingDevice_UNIFORM_TYPE_STORAGE_BUFFER, 0, quads},
                               {RenderingDevice_UNIFORM_TYPE_UNIFORM_BUFFER, constants_binding, image_->block}};
        image_->set = device_.uniform_set(splats_, bound, 2);
        image_->quads = quads;
    }
    const Depth depth = scene_depth.id == 0 ? Depth{} : depth_of(scene_depth);
    const RdMethods& rd = device_.methods;
    GDExtensionObjectPtr const to = device_.object;
    const int64_t list = begin(image_->framebuffer, RenderingDevice_DRAW_CLEAR_ALL);
    const int64_t zero = 0, one = 1, three = 3, four = 4, instances = count;
    const uint8_t indexed = 0;
    if (depth.set.id != 0) {
        rd.draw_list_bind_render_pipeline.run(to, list, depth.pipeline);
        rd.draw_list_bind_uniform_set.run(to, list, depth.set, zero);
        rd.draw_list_draw.run(to, list, indexed, one, three);
    }
    if (count > 0) {
        rd.draw_list_bind_render_pipeline.run(to, list, splat_pipeline_);
        rd.draw_list_bind_uniform_set.run(to, list, image_->set, zero);
        rd.draw_list_draw.run(to, list, indexed, instances, four);
    }
    rd.draw_list_end.run(to);
    return true;
}

/// Mobile without hdr_2d keeps half of the light in ten bits a channel.
Rid Draw::composite_pipeline(Rid framebuffer, Rid colour) {
    const int64_t format = device_.rd.call("framebuffer_get_format", {framebuffer}).to_int();
    for (uint32_t i = 0; i < composite_count_; i++) {
        if (composites_[i].format == format) return composites_[i].pipeline;
    }
    const int64_t pixels = device_.rd.call("texture_get_format", {colour}).call("get_format").to_int();
    const double brightness = pixels == RenderingDevice_DATA_FORMAT_A2B10G10R10_UNORM_PACK32 ? 0.5 : 1;
    const Rid made = pipeline(compositor_, framebuffer, RenderingDevice_RENDER_PRIMITIVE_TRIANGLES, -1, true, brightness);
    if (composite_count_ < most_pipelines) composites_[composite_count_++] = {format, made};
    return made;
}

Draw::Target* Draw::target_of(Errors& errors, Rid colour) {
    for (Target& one : targets_) {
        if (one.colour.id != colour.id || one.image_colour.id != image_->colour.id) continue;
        if (is_framebuffer(one.framebuffer) && is_set(one.set)) return &one;
    }
    Target& made = oldest(targets_);
    release(made);
    made = {};
    made.colour = colour;
    made.framebuffer = framebuffer(colour, Rid{});
    if (made.framebuffer.id == 0) {
        errors.set("the viewport", "its colours cannot be drawn to");
        return nullptr;
    }
    const CompositeBlock block = {{0, 0, 0, 0}, 1, 0, {static_cast<float>(image_->size.x), static_cast<float>(image_->size.y)}};
    made.block = device_.uniform_buffer(sizeof block);
    device_.update(made.block, &block, sizeof block);
    const Bound bound[] = {{RenderingDevice_UNIFORM_TYPE_TEXTURE, 0, image_->colour},
                           {RenderingDevice_UNIFORM_TYPE_UNIFORM_BUFFER, constants_binding, made.block}};
    made.set = device_.uniform_set(compositor_, bound, 2);
    made.image_colour = image_->colour;
    made.pipeline = composite_pipeline(made.framebuffer, colour);
    return &made;
}

bool Draw::composite(Errors& errors, Rid colour) {
    Target* target = target_of(errors, colour);
    if (target == nullptr) return false;
    target->used = clock_;
    const RdMethods& rd = device_.methods;
    GDExtensionObjectPtr const to = device_.object;
    const int64_t list = begin(target->framebuffer, RenderingDevice_DRAW_DEFAULT_ALL);
    const int64_t zero = 0, one = 1, three = 3;
    const uint8_t indexed = 0;
    rd.draw_list_bind_render_pipeline.run(to, list, target->pipeline);
    rd.draw_list_bind_uniform_set.run(to, list, target->set, zero);
    rd.draw_list_draw.run(to, list, indexed, one, three);
    rd.draw_list_end.run(to);
    return true;
}

bool Draw::read(Errors& errors, float* rgba) const {
    if (image_ == nullptr) return false;
    device_.finish();
    const Value read = device_.rd.call("texture_get_data", {image_->colour, 0});
    const size_t size = 16 * static_cast<size_t>(image_->size.x) * static_cast<size_t>(image_->size.y);
    if (read.size() != size) {
        errors.set("the GPU", "the image cannot be read");
        return false;
    }
    std::memcpy(rgba, read.bytes_data(), size);
    return true;
}

void Draw::release(Image& image) {
    if (is_set(image.set)) device_.free(image.set);
    if (is_framebuffer(image.framebuffer)) device_.free(image.framebuffer);
    for (Rid id : {image.colour, image.depth, image.block}) device_.free(id);
    image = {};
}

void Draw::release(Target& target) {
    if (is_set(target.set)) device_.free(target.set);
    if (is_framebuffer(target.framebuffer)) device_.free(target.framebuffer);
    device_.free(target.block);
    target = {};
}

}  // namespace godot
