// A screen of OpenGL, by EGL.
#include <cstring>
#include <ctime>
#include <fstream>
#include <initializer_list>
#include <vector>

#include "../play/egl.h"
#include "desk.h"

namespace {

EglContext egl;
std::vector<std::string> hidden;

template <class... Parameters>
void call(const char* name, Parameters... parameters) {
    reinterpret_cast<void (*)(Parameters...)>(eglGetProcAddress(name))(parameters...);
}

using Texts = const uint8_t* (*)(uint32_t, uint32_t);

const uint8_t* shown_extension(uint32_t name, uint32_t index) {
    const uint8_t* found = reinterpret_cast<Texts>(eglGetProcAddress("glGetStringi"))(name, index);
    for (const std::string& one : hidden) {
        if (found != nullptr && one == reinterpret_cast<const char*>(found)) return reinterpret_cast<const uint8_t*>("");
    }
    return found;
}

AvatarGlesFunction load(const char* name) {
    if (std::strcmp(name, "glGetStringi") == 0) return reinterpret_cast<AvatarGlesFunction>(&shown_extension);
    return eglGetProcAddress(name);
}

uint32_t texture_of(uint32_t format, int width, int height) {
    uint32_t made = 0;
    call("glGenTextures", 1, &made);
    call("glBindTexture", 0x0DE1u, made);
    call("glTexStorage2D", 0x0DE1u, 1, format, width, height);
    return made;
}

/// Rows of bytes the other way up.
void turn(uint8_t* rows, size_t row, size_t count) {
    for (size_t y = 0; y < count / 2; y++) {
        for (size_t i = 0; i < row; i++) std::swap(rows[row * y + i], rows[row * (count - 1 - y) + i]);
    }
}

}  // namespace

const char* open_screen(const std::string& kind, int width, int height) { return open_egl(egl, kind == "es", width, height); }

void close_screen() { close_egl(egl); }

void finish_screen() { call("glFinish"); }

void alter_screen(const std::string& name) {
    if (name.empty()) hidden.clear();
    else hidden.push_back(name);
}

AvatarGles* open_scene(const AvatarAllocator& allocator) { return avatar_gles_open(&load, &allocator); }

int restore_scene(AvatarGles* scene) { return avatar_gles_restore(scene); }

int draw_behind(AvatarGles* scene, const AvatarCamera& camera, const float* depths, int reversed) {
    const size_t row = 4 * static_cast<size_t>(camera.width), rows = static_cast<size_t>(camera.height);
    Bytes turned(reinterpret_cast<const uint8_t*>(depths), reinterpret_cast<const uint8_t*>(depths) + row * rows);
    turn(turned.data(), row, rows);
    const AvatarGlesDepth depth = {sizeof(AvatarGlesDepth), texture_of(0x8CACu, camera.width, camera.height), reversed};  // DEPTH_COMPONENT32F
    call("glTexSubImage2D", 0x0DE1u, 0, 0, 0, camera.width, camera.height, 0x1902u, 0x1406u, static_cast<const void*>(turned.data()));
    const int good = avatar_gles_draw(scene, &camera, &depth);
    call("glDeleteTextures", 1, &depth.texture);
    return good;
}

int show_scene(AvatarGles* scene) { return avatar_gles_composite(scene, 0, nullptr, 0); }

int composite_scene(AvatarGles* scene, const AvatarCamera& camera, const float* background, int linear, int, Bytes& into) {
    const uint32_t texture = texture_of(0x8058u, camera.width, camera.height);  // RGBA8
    uint32_t framebuffer = 0;
    call("glGenFramebuffers", 1, &framebuffer);
    call("glBindFramebuffer", 0x8D40u, framebuffer);
    call("glFramebufferTexture2D", 0x8D40u, 0x8CE0u, 0x0DE1u, texture, 0);
    const float grey[] = {0.5f, 0.5f, 0.5f, 1};
    call("glClearBufferfv", 0x1800u, 0, static_cast<const float*>(grey));
    const int good = avatar_gles_composite(scene, framebuffer, background, linear);
    const size_t row = 4 * static_cast<size_t>(camera.width), rows = static_cast<size_t>(camera.height);
    into.resize(row * rows);
    call("glReadPixels", 0, 0, camera.width, camera.height, 0x1908u, 0x1401u, static_cast<void*>(into.data()));
    turn(into.data(), row, rows);
    call("glDeleteFramebuffers", 1, static_cast<const uint32_t*>(&framebuffer));
    call("glDeleteTextures", 1, &texture);
    return good;
}

long resident_pages() {
    long total = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> total >> resident;
    return resident;
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void refused_scenes() {
    refused_all(nullptr, "NULL");
    refused_all(avatar_gles_open(nullptr, nullptr), "load: is NULL");
    refused_all(avatar_gles_open([](const char*) -> AvatarGlesFunction { return nullptr; }, nullptr), "a context of OpenGL ES 3.1");
}

void refused_views(AvatarGles* scene, const AvatarCamera& camera) {
    const uint32_t colour = texture_of(0x8058u, camera.width, camera.height), small = texture_of(0x8CACu, 3, 2);  // RGBA8, depth
    const auto depth = [&](uint32_t texture, const char* words, uint32_t size = sizeof(AvatarGlesDepth)) {
        const AvatarGlesDepth given = {size, texture, 0};
        row("draw depth", avatar_gles_draw(scene, &camera, &given) == 0, avatar_gles_error(scene), words);
    };
    for (const uint32_t texture : {0u, 987654u, colour}) depth(texture, "depth: texture");
    depth(small, "depth: struct_size", 0);
    depth(small, "depth: has 3x2 pixels");
    row("composite framebuffer", avatar_gles_composite(scene, 987654, nullptr, 0) == 0, avatar_gles_error(scene), "framebuffer: 987654");
    call("glDeleteTextures", 1, &colour);
    call("glDeleteTextures", 1, &small);
}
