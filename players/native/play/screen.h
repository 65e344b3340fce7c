#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "avatar_player.h"
#include "options.h"

/// What the program draws with, and its scene of avatars. What returns false has a line in `error`.
class PlayScreen {
public:
    virtual ~PlayScreen() = default;

    /// Step 2: a context or a device of the size that is asked for, with a scene in it. NULL, or what is missing.
    virtual const char* open(const Options& options) = 0;
    virtual const char* error() const = 0;
    /// The avatar goes onto the GPU.
    virtual bool add(const AvatarPack* pack, AvatarInstance* instance) = 0;
    /// Step 3: one frame, over a display-referred colour [3].
    virtual bool draw(const AvatarCamera& camera, const float* behind) = 0;
    /// The frame: rgba [height, width, 4], first row on top.
    virtual bool read(std::vector<uint8_t>& rgba) = 0;
    /// Shows the frame in the window. False: there is none, or it was closed.
    virtual bool show() { return false; }

    virtual const char* renderer() const = 0;
    virtual uint32_t target() const = 0;
    virtual void set_clock(void (*ended)(void* user, const char* stage), void* user) = 0;
};

/// Of OpenGL, or of Direct3D 11; null where the program was built without it.
std::unique_ptr<PlayScreen> make_gl_screen();
std::unique_ptr<PlayScreen> make_d3d11_screen();
