// The functions of avatar_gles.h.
#include "avatar_gles.h"

#include "../scene/scene.h"
#include "../scene/stage_runner.h"
#include "../src/formats/sized.h"
#include "../src/play/camera.h"
#include "device.h"

using namespace avatar;

/// A scene in a context.
struct AvatarGles {
    AvatarGles(const AvatarAllocator& given, AvatarGlesLoad function);

    /// Begins a call: forgets the error of the last one. False for a scene that cannot be used.
    bool begin();

    bool draw(const AvatarCamera* camera, const AvatarGlesDepth* depth);
    void forget();
    bool restore();

    GlesDevice device;
    Scene scene;
    StageRunner runner;
    Errors& errors = scene.errors;
    const AvatarAllocator& allocator = scene.allocator;

private:
    void release();

    AvatarGlesLoad load_;
    bool is_lost_ = false;
};

AvatarGles::AvatarGles(const AvatarAllocator& given, AvatarGlesLoad function)
    : scene(given, device), runner(scene.context()), load_(function) {
    Draw& image = device.image;
    scene.unusable = !device.load(errors, load_);
    while (!scene.unusable && !device.gl.can_blend[image.kind()]) image.set_kind(image.kind() + 1);
}

bool AvatarGles::begin() {
    if (scene.unusable) return false;
    scene.begin();
    if (is_lost_) errors.set("", "its context was lost: call avatar_gles_restore");
    return !is_lost_;
}

bool AvatarGles::draw(const AvatarCamera* camera, const AvatarGlesDepth* depth) {
    AvatarCamera seen;
    AvatarGlesDepth behind;
    if (const char* line = take_camera(camera, seen)) errors.set("", "%s", line);
    else if (!take(depth, behind) && depth != nullptr) errors.set("depth", not_sized);
    if (errors.any() || !scene.order(seen)) return false;
    if (!device.image.begin(errors, seen.width, seen.height, depth != nullptr ? &behind : nullptr)) return false;
    device.image.quads(static_cast<uint32_t>(scene.quads()), scene.count());
    scene.clock.end(device, "raster");
    return true;
}

/// Frees all objects in the context.
void AvatarGles::release() {
    scene.release();
    runner.release();
    device.release();
}

void AvatarGles::forget() {
    device.gl.forget();
    release();
    is_lost_ = true;
}

bool AvatarGles::restore() {
    scene.begin();
    if (!is_lost_) {
        errors.set("", "its context was not lost: avatar_gles_forget comes first");
        return false;
    }
    is_lost_ = !device.load(errors, load_) || !scene.restore();
    if (is_lost_) release();
    return !is_lost_;
}

AvatarGles* avatar_gles_open(AvatarGlesLoad load, const AvatarAllocator* allocator) {
    return open_handle<AvatarGles>(allocator, load);
}

void avatar_gles_close(AvatarGles* gles) { close_handle(gles); }

const char* avatar_gles_error(const AvatarGles* gles) { return line_of(gles == nullptr ? nullptr : &gles->scene); }

const char* avatar_gles_renderer(const AvatarGles* gles) { return gles == nullptr ? "" : gles->device.renderer; }

static bool begun(AvatarGles* gles) { return gles != nullptr && gles->begin(); }

int avatar_gles_can_blend(const AvatarGles* gles, uint32_t target) {
    return gles != nullptr && !gles->scene.unusable && target <= AVATAR_GLES_RGBA8 && gles->device.gl.can_blend[target];
}

int avatar_gles_set_target(AvatarGles* gles, uint32_t target) {
    if (!begun(gles)) return AVATAR_FAILED;
    if (avatar_gles_can_blend(gles, target)) {
        gles->device.image.set_kind(target);
        return AVATAR_OK;
    }
    gles->errors.set("target", "%u: this context cannot blend into such an image; avatar_gles_can_blend says which it can", target);
    return AVATAR_FAILED;
}

uint32_t avatar_gles_target(const AvatarGles* gles) { return gles == nullptr ? 0 : gles->device.image.kind(); }

int avatar_gles_add(AvatarGles* gles, const AvatarPack* pack, AvatarInstance* instance) {
    return begun(gles) && gles->scene.add(pack, instance);
}

int avatar_gles_remove(AvatarGles* gles, const AvatarInstance* instance) { return begun(gles) && gles->scene.remove(instance); }

int avatar_gles_show(AvatarGles* gles, const AvatarInstance* instance, int shown) {
    return begun(gles) && gles->scene.show(instance, shown != 0);
}

int avatar_gles_pose(AvatarGles* gles) { return begun(gles) && gles->scene.pose(); }

int avatar_gles_draw(AvatarGles* gles, const AvatarCamera* camera, const AvatarGlesDepth* depth) {
    return begun(gles) && gles->draw(camera, depth);
}

const char* avatar_gles_camera_depth(AvatarCamera* camera, const double* view, const double* projection) {
    return set_camera_depth(camera, view, projection, true);
}

int avatar_gles_composite(AvatarGles* gles, uint32_t framebuffer, const float* background, int linear) {
    if (!begun(gles) || !gles->device.image.composite(gles->errors, framebuffer, background, linear != 0)) return AVATAR_FAILED;
    gles->scene.clock.end(gles->device, "composite");
    return AVATAR_OK;
}

int avatar_gles_read(AvatarGles* gles, float* rgba) { return begun(gles) && gles->device.image.read(gles->errors, rgba); }

void avatar_gles_forget(AvatarGles* gles) {
    if (gles != nullptr && !gles->scene.unusable) gles->forget();
}

int avatar_gles_restore(AvatarGles* gles) { return gles != nullptr && !gles->scene.unusable && gles->restore(); }

void avatar_gles_set_clock(AvatarGles* gles, void (*ended)(void* user, const char* stage), void* user) {
    if (gles != nullptr) gles->scene.clock = {ended, user};
}

int avatar_gles_stage_runner(AvatarGles* gles, AvatarStageRunner* out) {
    if (!begun(gles)) return AVATAR_FAILED;
    if (give(gles->runner.functions(), out) == AVATAR_OK) return AVATAR_OK;
    gles->errors.set("runner", out == nullptr ? "no runner is given to be filled in" : not_sized);
    return AVATAR_FAILED;
}
