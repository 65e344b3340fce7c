#include "effect.h"

#include <cmath>
#include <cstring>

#include "panorama.h"

namespace godot {

/// Methods of each view.
struct ViewMethods {
    Method buffers = METHOD(RenderData, get_render_scene_buffers);
    Method scene = METHOD(RenderData, get_render_scene_data);
    Method view_count = METHOD(RenderSceneData, get_view_count);
    Method cam_transform = METHOD(RenderSceneData, get_cam_transform);
    Method cam_projection = METHOD(RenderSceneData, get_cam_projection);
    Method view_projection = METHOD(RenderSceneData, get_view_projection);
    Method internal_size = METHOD(RenderSceneBuffersRD, get_internal_size);
    Method color_layer = METHOD(RenderSceneBuffersRD, get_color_layer);
    Method depth_layer = METHOD(RenderSceneBuffersRD, get_depth_layer);
    Method msaa = METHOD(RenderSceneBuffersRD, get_msaa_3d);
    Method unreference = METHOD(RefCounted, unreference);
    Method frame = METHOD(Engine, get_frames_drawn);
};

static const ViewMethods& view_methods() {
    static const ViewMethods made;
    return made;
}

/// The Mobile renderer resolves no depth of MSAA for effects.
static bool is_mobile() {
    char method[16] = "";
    Value::object(singleton("RenderingServer")).call("get_current_rendering_method").to_utf8(method, sizeof method);
    return std::strcmp(method, "mobile") == 0;
}

Effect::Effect(GDExtensionObjectPtr object) : Instance{&row}, wanted_(counted_allocator(), errors_) {
    const int64_t after = CompositorEffect_EFFECT_CALLBACK_TYPE_POST_TRANSPARENT;
    const uint8_t yes = 1, resolves = !is_mobile();
    METHOD(CompositorEffect, set_effect_callback_type).run(object, after);
    METHOD(CompositorEffect, set_access_resolved_color).run(object, yes);
    METHOD(CompositorEffect, set_access_resolved_depth).run(object, resolves);
}

Effect::~Effect() {
    release();
    for (size_t i = 0; i < wanted_.size(); i++) wanted_[i].posed->release();
}

Wanted* Effect::wanted_of(const Posed* posed) {
    for (size_t i = 0; i < wanted_.size(); i++) {
        if (wanted_[i].posed == posed) return &wanted_[i];
    }
    return nullptr;
}

static Posed* posed_of(const Value& core) {
    const Core* held = static_cast<const Core*>(instance_of(core, Core::row));
    return held == nullptr ? nullptr : held->posed();
}

void Effect::add(const Value& core) {
    Posed* posed = posed_of(core);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (posed == nullptr || wanted_of(posed) != nullptr) return;
    Wanted made = {posed, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, false, false, {}};
    if (wanted_.add(made)) posed->hold();
}

void Effect::remove(const Value& core) {
    Posed* posed = posed_of(core);
    const std::lock_guard<std::mutex> lock(mutex_);
    Wanted* found = posed == nullptr ? nullptr : wanted_of(posed);
    if (found == nullptr) return;
    *found = wanted_[wanted_.size() - 1];
    wanted_.set_size(wanted_.size() - 1);
    posed->release();
}

void Effect::set_place(const Value& core, const Transform3D& place, bool visible) {
    Posed* posed = posed_of(core);
    const std::lock_guard<std::mutex> lock(mutex_);
    Wanted* found = posed == nullptr ? nullptr : wanted_of(posed);
    if (found == nullptr) return;
    matrix_of(place, false, found->place);
    found->visible = visible;
    for (double number : found->place) found->visible &= std::isfinite(number);
}

/// 1 where the first light casts a shadow; nine rows of ambient light; then of each light its place, its colour, and 1 where
/// it is a point. No numbers: the light of the capture.
void Effect::set_light(const Value& core, const Value& numbers) {
    constexpr size_t head = 1 + 27, each = 7;
    const size_t size = numbers.size();
    Posed* posed = posed_of(core);
    const std::lock_guard<std::mutex> lock(mutex_);
    Wanted* found = posed == nullptr ? nullptr : wanted_of(posed);
    if (found == nullptr) return;
    found->lit = size >= head;
    if (!found->lit) return;
    const float* at = numbers.floats_data();
    AvatarLight& light = found->light;
    light = AvatarLight();
    light.shadow = at[0] > 0;
    light.count = static_cast<uint32_t>((size - head) / each);
    if (light.count > AVATAR_MOST_LIGHTS) light.count = AVATAR_MOST_LIGHTS;
    for (size_t i = 0; i < head - 1; i++) light.ambient[i / 3][i % 3] = static_cast<double>(at[1 + i]);
    for (size_t i = 0; i < AVATAR_MOST_LIGHTS; i++) {
        const bool is_given = i < light.count;
        AvatarDirectLight& one = light.lights[i] = {};
        for (size_t c = 0; c < 3 && is_given; c++) {
            one.place[c] = static_cast<double>(at[head + each * i + c]);
            one.colour[c] = static_cast<double>(at[head + each * i + 3 + c]);
        }
        one.point = is_given && at[head + each * i + 6] > 0;
    }
}

Value Effect::error() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return errors_.any() ? errors_.line() : renderer_ == nullptr ? "" : renderer_->error();
}

Value Effect::statistics() const {
    const Value made = Value::dictionary();
    made.set("frames", static_cast<int64_t>(statistics_.frames.load()));
    made.set("views", static_cast<int64_t>(statistics_.views.load()));
    made.set("sorts", static_cast<int64_t>(statistics_.sorts.load()));
    made.set("splats", static_cast<int64_t>(statistics_.splats.load()));
    made.set("allocations", static_cast<int64_t>(allocations()));
    return made;
}

Value Effect::accumulated() {
    const Value made = Value::dictionary();
    const std::lock_guard<std::mutex> lock(mutex_);
    const Vector2i size = renderer_ == nullptr ? Vector2i{0, 0} : renderer_->image().size();
    const Value data = Value::bytes(16 * static_cast<size_t>(size.x) * static_cast<size_t>(size.y));
    Errors errors;
    const bool good = size.x > 0 && renderer_->image().read(errors, reinterpret_cast<float*>(data.bytes_data()));
    made.set("width", good ? size.x : 0);
    made.set("height", good ? size.y : 0);
    made.set("data", good ? data : Value::bytes(0));
    return made;
}

/// Deletes a renderer where it lives.
static void delete_later(Renderer* renderer) {
    const GDExtensionObjectPtr server = singleton("RenderingServer");
    if (server == nullptr) return;  // the engine has ended, and took all with it
    GDExtensionCallableCustomInfo2 info = {};
    info.callable_userdata = renderer;
    info.token = library;
    info.call_func = [](void* user, const GDExtensionConstVariantPtr*, GDExtensionInt, GDExtensionVariantPtr,
                        GDExtensionCallError* error) {
        delete static_cast<Renderer*>(user);
        error->error = GDEXTENSION_CALL_OK;
    };
    alignas(8) uint8_t callable[16];
    engine.callable_custom_create2(callable, &info);
    Value::object(server).call("call_on_render_thread", {Value::of_pointer(GDEXTENSION_VARIANT_TYPE_CALLABLE, callable)});
    destroy_callable(callable);
}

void Effect::release() {
    Renderer* held;
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        held = renderer_;
        renderer_ = nullptr;
    }
    if (held != nullptr) delete_later(held);
}

void Effect::called(GDExtensionClassInstancePtr instance, const GDExtensionConstTypePtr* given, GDExtensionTypePtr) {
    static_cast<Effect*>(static_cast<Instance*>(instance))->render(*static_cast<const GDExtensionObjectPtr*>(given[1]));
}

void Effect::render(GDExtensionObjectPtr data) {
    const ViewMethods& methods = view_methods();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (renderer_ == nullptr) {
        if (wanted_.size() == 0) return;
        const Value device = Value::object(singleton("RenderingServer")).call("get_rendering_device");
        if (device.to_object() == nullptr) return;
        renderer_ = new Renderer(device.to_object(), statistics_);
        frame_ = -1;
    }
    static GDExtensionObjectPtr const counter = singleton("Engine");
    const int64_t frame = methods.frame.call<int64_t>(counter);
    renderer_->follow(wanted_.data(), wanted_.size(), frame != frame_);
    frame_ = frame;
    const GDExtensionObjectPtr buffers = methods.buffers.call<GDExtensionObjectPtr>(data);
    if (buffers == nullptr) return;
    views(buffers, methods.scene.call<GDExtensionObjectPtr>(data));
    methods.unreference.call<uint8_t>(buffers);  // the call gave a reference
}

void Effect::views(GDExtensionObjectPtr buffers, GDExtensionObjectPtr scene) {
    const ViewMethods& methods = view_methods();
    const Vector2i size = methods.internal_size.call<Vector2i>(buffers);
    const Transform3D stands = methods.cam_transform.call<Transform3D>(scene);
    const int64_t count = methods.view_count.call<int64_t>(scene);
    static const bool has_samples = is_mobile();
    const uint8_t resolved = 0, samples = has_samples && methods.msaa.call<int64_t>(buffers) != 0;  // of MSAA
    for (int64_t view = 0; view < count; view++) {
        const Projection projection = count == 1 ? methods.cam_projection.call<Projection>(scene)
                                                 : methods.view_projection.call<Projection>(scene, view);
        const Rid colour = methods.color_layer.call<Rid>(buffers, view, resolved);
        const Rid depth = methods.depth_layer.call<Rid>(buffers, view, samples);
        renderer_->view(stands, projection, size, colour, depth);
    }
}

static Effect& of(Instance* instance) { return *static_cast<Effect*>(instance); }

static constexpr auto nothing = GDEXTENSION_VARIANT_TYPE_NIL, object = GDEXTENSION_VARIANT_TYPE_OBJECT,
                      dictionary = GDEXTENSION_VARIANT_TYPE_DICTIONARY, text = GDEXTENSION_VARIANT_TYPE_STRING;
static const Argument core = {"core", object, "GaussianAvatarCore"};

static const MethodRow methods[] = {
    {"add", [](Instance* self, const Value* given) -> Value { of(self).add(given[0]); return {}; }, nothing, {core}, 1},
    {"remove", [](Instance* self, const Value* given) -> Value { of(self).remove(given[0]); return {}; }, nothing, {core}, 1},
    {"set_place",
     [](Instance* self, const Value* given) -> Value {
         of(self).set_place(given[0], given[1].to_transform(), given[2].to_bool());
         return {};
     },
     nothing,
     {core, {"place", GDEXTENSION_VARIANT_TYPE_TRANSFORM3D}, {"visible", GDEXTENSION_VARIANT_TYPE_BOOL}},
     3},
    {"set_light",
     [](Instance* self, const Value* given) -> Value {
         of(self).set_light(given[0], given[1]);
         return {};
     },
     nothing,
     {core, {"numbers", GDEXTENSION_VARIANT_TYPE_PACKED_FLOAT32_ARRAY}},
     2},
    {"rows_of_panorama",
     [](Instance*, const Value* given) { return rows_of_panorama(given[0], given[1].to_int(), given[2].to_transform()); },
     GDEXTENSION_VARIANT_TYPE_PACKED_FLOAT32_ARRAY,
     {{"panorama", GDEXTENSION_VARIANT_TYPE_PACKED_BYTE_ARRAY},
      {"height", GDEXTENSION_VARIANT_TYPE_INT},
      {"turn", GDEXTENSION_VARIANT_TYPE_TRANSFORM3D}},
     3},
    {"error", [](Instance* self, const Value*) { return of(self).error(); }, text, {}, 0},
    {"statistics", [](Instance* self, const Value*) { return of(self).statistics(); }, dictionary, {}, 0},
    {"accumulated", [](Instance* self, const Value*) { return of(self).accumulated(); }, dictionary, {}, 0},
    {"release", [](Instance* self, const Value*) -> Value { of(self).release(); return {}; }, nothing, {}, 0},
};

const ClassRow Effect::row = {"GaussianAvatarEffect",
                              "CompositorEffect",
                              [](GDExtensionObjectPtr of) -> Instance* { return new Effect(of); },
                              [](Instance* instance) { delete static_cast<Effect*>(instance); },
                              "_render_callback",
                              &Effect::called,
                              methods,
                              sizeof methods / sizeof methods[0]};

}  // namespace godot
