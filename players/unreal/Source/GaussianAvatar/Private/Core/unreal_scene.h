#pragma once
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "unreal_pose.h"

namespace avatar_unreal {

/// A buffer on the GPU: of an avatar by its id, or of the scene (owner 0).
struct BufferId {
    uint32_t owner;
    uint32_t index;

    bool operator<(const BufferId& other) const {
        return owner != other.owner ? owner < other.owner : index < other.index;
    }
};

/// How a dispatch uses a buffer.
struct BufferUse {
    BufferId id;
    uint32_t bytes;           // of the whole buffer; those of the scene may grow
    const AvatarPack* source; // the pack whose content it has; null: it begins with zeros
};

/// A binding of a kernel, with its buffer.
struct Bound {
    AvatarBinding binding;
    BufferUse buffer;
};

/// The GPU, as the scene sees it. Buffers live until `release`, unless they grow.
class Device {
public:
    virtual ~Device() = default;
    /// Writes a buffer from its beginning on.
    virtual void write(const BufferUse& buffer, const void* bytes, size_t size) = 0;
    /// Runs a dispatch with its block of constants and its bindings. The next call sees its results.
    virtual void run(const AvatarDispatch& dispatch, const uint8_t* block, const std::vector<Bound>& bound) = 0;
    /// Nobody will use the buffers of an owner again.
    virtual void release(uint32_t owner) = 0;
};

/// One eye that sees the scene, in Unreal's terms: see camera_of_view.
struct View {
    const double* view_rotation;
    const double* projection;
    const double* eye;  // [3] centimetres
    int32_t width;
    int32_t height;
};

/// Quads that draw the splats of a view, back to front.
struct Drawn {
    BufferUse quads;
    uint32_t instances = 0;  // of four vertices; 0: there is nothing to draw
};

/// All avatars of a world on the render thread: which levels they show, which dispatches a view needs. It knows no
/// engine: a Device runs what it asks for.
class Scene {
public:
    Scene();
    ~Scene();
    Scene(const Scene&) = delete;
    Scene& operator=(const Scene&) = delete;

    /// Whether there is no avatar.
    bool empty() const { return members.empty(); }

    /// An avatar that nobody sees yet. `id` is not 0 and not in use.
    void add(uint32_t id, const Pack& pack);
    void remove(uint32_t id, Device& device);

    /// The pose and the place (FMatrix of the component, row-major [4, 4]) of the next frames.
    void set(uint32_t id, PoseValues&& pose, const double* unreal_from_component, bool shown);

    /// Runs what a view needs: deforms avatars with a new pose, projects, sorts all together. `frame` counts frames: each
    /// avatar shows one level in all views of a frame, which follows from its largest height in the frame before.
    Drawn draw(const View& view, uint64_t frame, Device& device);

    /// The newest line of a failure; empty if nothing failed.
    const std::string& error() const { return line; }
    /// That line, once: null if news() has returned it before.
    const char* news() { return told.insert(line).second ? line.c_str() : nullptr; }

private:
    struct Member;
    struct Sorted;

    void begin_frame(uint64_t frame);
    bool deform(Member& member, Device& device);
    void project(Member& member, const AvatarCamera& camera, Device& device);
    Sorted* sorted();

    std::map<uint32_t, std::unique_ptr<Member>> members;
    std::unique_ptr<Sorted> sort;
    std::string line;
    std::set<std::string> told{""};
    uint64_t newest = 0;
};

}  // namespace avatar_unreal
