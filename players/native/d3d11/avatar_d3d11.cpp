// The functions of avatar_d3d11.h.
#include "avatar_d3d11.h"

#include "../scene/scene.h"
#include "../scene/stage_runner.h"
#include "../src/formats/sized.h"
#include "../src/play/camera.h"
#include "device.h"

using namespace avatar;

/// A scene on a device.
struct AvatarD3d11 {
    AvatarD3d11(const AvatarAllocator& given, ID3D11Device* on);

    /// Begins a call: forgets the error of the last one. False for a scene that cannot be used.
    bool begin();

    bool draw(const AvatarCamera* camera, const AvatarD3d11Depth* depth);
    void forget();
    bool restore(ID3D11Device* on);

    D3d11Device device;
    Scene scene;
    StageRunner runner;
    Errors& errors = scene.errors;
    const AvatarAllocator& allocator = scene.allocator;

private:
    void release();

    bool is_lost_ = false;
};

AvatarD3d11::AvatarD3d11(const AvatarAllocator& given, ID3D11Device* on)
    : device(given), scene(given, device), runner(scene.context()) {
    D3d11Image& image = device.image;
    scene.unusable = !device.load(errors, on);
    while (!scene.unusable && image.kind() < AVATAR_D3D11_RGBA8 && !image.can_blend(image.kind())) image.set_kind(image.kind() + 1);
}

bool AvatarD3d11::begin() {
    if (scene.unusable) return false;
    scene.begin();
    if (is_lost_) errors.set("", "its device was lost: call avatar_d3d11_restore");
    return !is_lost_;
}

bool AvatarD3d11::draw(const AvatarCamera* camera, const AvatarD3d11Depth* depth) {
    AvatarCamera seen;
    AvatarD3d11Depth behind;
    if (const char* line = take_camera(camera, seen)) errors.set("", "%s", line);
    else if (!take(depth, behind) && depth != nullptr) errors.set("depth", not_sized);
    if (errors.any() || !scene.order(seen)) return false;
    if (!device.image.begin(errors, seen.width, seen.height, depth != nullptr ? &behind : nullptr)) return false;
    device.draw_quads(scene.quads(), scene.count());
    scene.clock.end(device, "raster");
    return true;
}

/// Frees all objects on the device.
void AvatarD3d11::release() {
    scene.release();
    runner.release();
    device.release();
}

void AvatarD3d11::forget() {
    release();
    is_lost_ = true;
}

bool AvatarD3d11::restore(ID3D11Device* on) {
    scene.begin();
    if (!is_lost_) {
        errors.set("", "its device was not lost: avatar_d3d11_forget comes first");
        return false;
    }
    is_lost_ = !device.load(errors, on) || !scene.restore();
    if (is_lost_) release();
    return !is_lost_;
}

AvatarD3d11* avatar_d3d11_open(ID3D11Device* device, const AvatarAllocator* allocator) {
    return open_handle<AvatarD3d11>(allocator, device);
}

void avatar_d3d11_close(AvatarD3d11* d3d11) { close_handle(d3d11); }

const char* avatar_d3d11_error(const AvatarD3d11* d3d11) { return line_of(d3d11 == nullptr ? nullptr : &d3d11->scene); }

const char* avatar_d3d11_renderer(const AvatarD3d11* d3d11) { return d3d11 == nullptr ? "" : d3d11->device.renderer; }

const char* avatar_d3d11_compiler(const AvatarD3d11* d3d11) { return d3d11 == nullptr ? "" : d3d11->device.compiler.path; }

static bool begun(AvatarD3d11* d3d11) { return d3d11 != nullptr && d3d11->begin(); }

int avatar_d3d11_can_blend(const AvatarD3d11* d3d11, uint32_t target) {
    return d3d11 != nullptr && !d3d11->scene.unusable && target <= AVATAR_D3D11_RGBA8 && d3d11->device.image.can_blend(target);
}

int avatar_d3d11_set_target(AvatarD3d11* d3d11, uint32_t target) {
    if (!begun(d3d11)) return AVATAR_FAILED;
    if (avatar_d3d11_can_blend(d3d11, target)) {
        d3d11->device.image.set_kind(target);
        return AVATAR_OK;
    }
    d3d11->errors.set("target", "%u: this device cannot blend into such an image; avatar_d3d11_can_blend says which it can", target);
    return AVATAR_FAILED;
}

uint32_t avatar_d3d11_target(const AvatarD3d11* d3d11) { return d3d11 == nullptr ? 0 : d3d11->device.image.kind(); }

int avatar_d3d11_add(AvatarD3d11* d3d11, const AvatarPack* pack, AvatarInstance* instance) {
    return begun(d3d11) && d3d11->scene.add(pack, instance);
}

int avatar_d3d11_remove(AvatarD3d11* d3d11, const AvatarInstance* instance) {
    return begun(d3d11) && d3d11->scene.remove(instance);
}

int avatar_d3d11_show(AvatarD3d11* d3d11, const AvatarInstance* instance, int shown) {
    return begun(d3d11) && d3d11->scene.show(instance, shown != 0);
}

int avatar_d3d11_pose(AvatarD3d11* d3d11) { return begun(d3d11) && d3d11->scene.pose(); }

int avatar_d3d11_draw(AvatarD3d11* d3d11, const AvatarCamera* camera, const AvatarD3d11Depth* depth) {
    return begun(d3d11) && d3d11->draw(camera, depth);
}

const char* avatar_d3d11_camera_depth(AvatarCamera* camera, const double* view, const double* projection) {
    return set_camera_depth(camera, view, projection, false);
}

int avatar_d3d11_composite(AvatarD3d11* d3d11, ID3D11RenderTargetView* target, const float* background, int linear) {
    if (!begun(d3d11) || !d3d11->device.image.composite(d3d11->errors, target, background, linear != 0)) return AVATAR_FAILED;
    d3d11->scene.clock.end(d3d11->device, "composite");
    return AVATAR_OK;
}

int avatar_d3d11_read(AvatarD3d11* d3d11, float* rgba) { return begun(d3d11) && d3d11->device.image.read(d3d11->errors, rgba); }

void avatar_d3d11_forget(AvatarD3d11* d3d11) {
    if (d3d11 != nullptr && !d3d11->scene.unusable) d3d11->forget();
}

int avatar_d3d11_restore(AvatarD3d11* d3d11, ID3D11Device* device) {
    return d3d11 != nullptr && !d3d11->scene.unusable && d3d11->restore(device);
}

void avatar_d3d11_set_clock(AvatarD3d11* d3d11, void (*ended)(void* user, const char* stage), void* user) {
    if (d3d11 != nullptr) d3d11->scene.clock = {ended, user};
}

int avatar_d3d11_stage_runner(AvatarD3d11* d3d11, AvatarStageRunner* out) {
    if (!begun(d3d11)) return AVATAR_FAILED;
    if (give(d3d11->runner.functions(), out) == AVATAR_OK) return AVATAR_OK;
    d3d11->errors.set("runner", out == nullptr ? "no runner is given to be filled in" : not_sized);
    return AVATAR_FAILED;
}
