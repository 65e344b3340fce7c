// OpenGL through EGL: how a host plays avatars with avatar_gles.h.
#include "screen.h"

#if defined(_WIN32)

std::unique_ptr<PlayScreen> make_gl_screen() { return nullptr; }

#else

#include <cstring>

#include "../gles/avatar_gles.h"
#include "egl.h"
#include "window.h"

namespace {

class GlScreen final : public PlayScreen {
public:
    ~GlScreen() override {
        avatar_gles_close(scene_);  // its context must still be current
        close_egl(egl_);
        close_window(window_);
    }

    const char* open(const Options& options) override {
        width_ = options.width;
        height_ = options.height;
        const bool es = options.api != "gl";
        const char* line = options.window ? open_window(window_, egl_, es, width_, height_) : open_egl(egl_, es, width_, height_);
        if (line != nullptr) return line;
        scene_ = avatar_gles_open(eglGetProcAddress, nullptr);
        if (error() == nullptr && options.target >= 0) avatar_gles_set_target(scene_, static_cast<uint32_t>(options.target));
        return error();
    }

    const char* error() const override { return avatar_gles_error(scene_); }

    bool add(const AvatarPack* pack, AvatarInstance* instance) override { return avatar_gles_add(scene_, pack, instance) != 0; }

    /// Onto framebuffer 0.
    bool draw(const AvatarCamera& camera, const float* behind) override {
        return avatar_gles_pose(scene_) && avatar_gles_draw(scene_, &camera, nullptr) && avatar_gles_composite(scene_, 0, behind, 0);
    }

    /// GL has the last row first.
    bool read(std::vector<uint8_t>& rgba) override {
        using ReadPixels = void (*)(int, int, int, int, unsigned, unsigned, void*);
        const auto read_pixels = reinterpret_cast<ReadPixels>(eglGetProcAddress("glReadPixels"));
        const size_t row = 4 * static_cast<size_t>(width_), rows = static_cast<size_t>(height_);
        std::vector<uint8_t> read(row * rows);
        read_pixels(0, 0, width_, height_, 0x1908 /* GL_RGBA */, 0x1401 /* GL_UNSIGNED_BYTE */, read.data());
        rgba.resize(row * rows);
        for (size_t y = 0; y < rows; y++) std::memcpy(&rgba[row * y], &read[row * (rows - 1 - y)], row);
        return true;
    }

    bool show() override {
        eglSwapBuffers(egl_.display, egl_.surface);
        return window_is_open(window_);
    }

    const char* renderer() const override { return avatar_gles_renderer(scene_); }
    uint32_t target() const override { return avatar_gles_target(scene_); }
    void set_clock(void (*ended)(void*, const char*), void* user) override { avatar_gles_set_clock(scene_, ended, user); }

private:
    EglContext egl_;
    PlayWindow* window_ = nullptr;
    AvatarGles* scene_ = nullptr;
    int width_ = 0, height_ = 0;
};

}  // namespace

std::unique_ptr<PlayScreen> make_gl_screen() { return std::make_unique<GlScreen>(); }

#endif
