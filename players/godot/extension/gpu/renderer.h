// What the render thread has of a world: the avatars on the GPU, and the images of its viewports.
#pragma once
#include "../../../native/include/avatar_light.h"
#include "../../../native/scene/scene.h"
#include "draw.h"
#include "../posed.h"

namespace godot {

/// An avatar of a world, as the main thread wants it.
struct Wanted {
    Posed* posed;
    double place[16];
    bool visible;
    bool lit;
    AvatarLight light;  // where `lit`
};

struct Statistics {
    std::atomic<uint64_t> frames{0}, views{0}, sorts{0}, splats{0};
};

/// Lives on the render thread.
class Renderer {
public:
    Renderer(GDExtensionObjectPtr device, Statistics& statistics);
    ~Renderer();
    Renderer(const Renderer&) = delete;

    /// Takes what is wanted now, and deforms what changed. An avatar with an error is left out. `is_new`: of another frame.
    void follow(const Wanted* wanted, size_t count, bool is_new);
    /// Draws all into a view of the scene.
    void view(const Transform3D& stands, const Projection& projection, Vector2i size, Rid colour, Rid depth);

    const Draw& image() const { return draw_; }
    const char* error() const { return error_; }

private:
    struct Entry {
        Posed* posed;
        AvatarInstance* instance;
        uint64_t seen;
        int32_t level;
        double height;  // of the largest view since the last frame, pixels
        bool wanted, visible, is_broken;
        bool lit;
        AvatarLight light;  // relative to the origin
    };

    Entry* entry_of(Posed* posed);
    void drop(size_t index);
    void say(const char* line);
    void move_origin(const Wanted* wanted, size_t count);
    bool place(Entry& entry, const Wanted& wanted) const;
    bool shine(Entry& entry, const Wanted& wanted);
    bool camera(Transform3D stands, const Projection& projection, Vector2i size, AvatarCamera& out);
    bool follow_level(Entry& entry);

    Statistics& statistics_;
    RdDevice device_;
    avatar::Scene scene_;
    Draw draw_;
    Errors errors_;
    avatar::Grown<Entry> entries_;
    double origin_[3] = {0, 0, 0};  // of all places on the GPU: near to the avatars, for the sake of float32
    bool is_ready_ = false;
    char error_[1024] = "";
};

}  // namespace godot
