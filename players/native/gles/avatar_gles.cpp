// The functions of avatar_gles.h.
#include "avatar_gles.h"

#include "../src/formats/finite.h"
#include "../src/formats/sized.h"
#include "scene.h"

using namespace avatar;

AvatarGles* avatar_gles_open(AvatarGlesLoad load, const AvatarAllocator* allocator) {
    return open_handle<AvatarGles>(allocator, load);
}

void avatar_gles_close(AvatarGles* gles) { close_handle(gles); }

const char* avatar_gles_error(const AvatarGles* gles) { return line_of(gles); }

const char* avatar_gles_renderer(const AvatarGles* gles) { return gles == nullptr ? "" : gles->renderer; }

static bool begun(AvatarGles* gles) { return gles != nullptr && gles->begin(); }

int avatar_gles_can_blend(const AvatarGles* gles, uint32_t target) {
    return gles != nullptr && !gles->unusable && target <= AVATAR_GLES_RGBA8 && gles->gl.can_blend[target];
}

int avatar_gles_set_target(AvatarGles* gles, uint32_t target) {
    if (!begun(gles)) return AVATAR_FAILED;
    if (avatar_gles_can_blend(gles, target)) {
        gles->draw.set_kind(target);
        return AVATAR_OK;
    }
    gles->errors.set("target", "%u: this context cannot blend into such an image; avatar_gles_can_blend says which it can", target);
    return AVATAR_FAILED;
}

uint32_t avatar_gles_target(const AvatarGles* gles) { return gles == nullptr ? 0 : gles->draw.kind(); }

int avatar_gles_add(AvatarGles* gles, const AvatarPack* pack, AvatarInstance* instance) {
    return begun(gles) && gles->add(pack, instance);
}

int avatar_gles_remove(AvatarGles* gles, const AvatarInstance* instance) { return begun(gles) && gles->remove(instance); }

int avatar_gles_show(AvatarGles* gles, const AvatarInstance* instance, int shown) {
    return begun(gles) && gles->show(instance, shown != 0);
}

int avatar_gles_pose(AvatarGles* gles) { return begun(gles) && gles->pose(); }

int avatar_gles_draw(AvatarGles* gles, const AvatarCamera* camera, const AvatarGlesDepth* depth) {
    return begun(gles) && gles->view(camera, depth);
}

const char* avatar_gles_camera_depth(AvatarCamera* camera, const double* view, const double* projection) {
    if (camera == nullptr || view == nullptr || projection == nullptr) return "the camera's depth: an argument is NULL";
    if (size_of(camera) < sizeof(AvatarCamera)) return "the camera's depth: struct_size must be sizeof(AvatarCamera)";
    const double size = projection[14] < 0 ? -projection[14] : projection[14];
    double row[4];
    for (int column = 0; column < 4; column++) {
        double sum = 0;
        for (int k = 0; k < 4; k++) sum += 0.5 * (projection[8 + k] + projection[12 + k]) * view[4 * k + column];
        row[column] = sum / size;
    }
    if (!all_finite(row, 4)) return "the camera's depth: view and projection must be finite, with a perspective";
    for (int column = 0; column < 4; column++) camera->clip_from_world[8 + column] = static_cast<float>(row[column]);
    return nullptr;
}

int avatar_gles_composite(AvatarGles* gles, uint32_t framebuffer, const float* background, int linear) {
    if (!begun(gles) || !gles->draw.composite(framebuffer, background, linear != 0)) return AVATAR_FAILED;
    gles->clock.end(gles->gl, "composite");
    return AVATAR_OK;
}

int avatar_gles_read(AvatarGles* gles, float* rgba) { return begun(gles) && gles->draw.read(rgba); }

void avatar_gles_forget(AvatarGles* gles) {
    if (gles != nullptr && !gles->unusable) gles->forget();
}

int avatar_gles_restore(AvatarGles* gles) { return gles != nullptr && !gles->unusable && gles->restore(); }

void avatar_gles_set_clock(AvatarGles* gles, void (*ended)(void* user, const char* stage), void* user) {
    if (gles != nullptr) gles->clock = {ended, user};
}

int avatar_gles_stage_runner(AvatarGles* gles, AvatarStageRunner* out) {
    if (!begun(gles)) return AVATAR_FAILED;
    if (give(gles->runner.functions(), out) == AVATAR_OK) return AVATAR_OK;
    gles->errors.set("runner", out == nullptr ? "no runner is given to be filled in" : not_sized);
    return AVATAR_FAILED;
}
