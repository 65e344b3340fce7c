#pragma once
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "avatar_player.h"

namespace avatar_unreal {

/// A pack that several threads share. The last owner closes it.
using Pack = std::shared_ptr<const AvatarPack>;

/// The pack of a file's bytes, or null: then `error` holds the line.
Pack open_pack(const void* file, size_t bytes, const char* name, std::string& error);

/// The values of a pose: what one thread hands to another.
struct PoseValues {
    std::vector<float> expressions;         // [K]
    std::vector<float> eyelids;             // [L]
    std::vector<double> joint_delta;        // [J, 4, 4]
    std::vector<double> world_from_avatar;  // [4, 4]

    /// Takes the pose of an instance of a pack.
    void take(AvatarInstance* instance, const AvatarFacts& facts);

    /// Writes it into an instance of the same pack.
    void give(AvatarInstance* instance) const;
};

/// Where the pose of a component comes from. The base is a clip, or the pose at rest. Over it lie keys, then values of
/// scripts, then a live face: each replaces what it sets and leaves the rest. A live face sets what the pack's driving
/// maps. The order is that of the player for Unity.
class PoseLayers {
public:
    /// Layers over the pose at rest. `error()` holds a line where it cannot be played.
    explicit PoseLayers(Pack pack);
    ~PoseLayers();
    PoseLayers(const PoseLayers&) = delete;
    PoseLayers& operator=(const PoseLayers&) = delete;

    /// The newest line; empty if all went well.
    const std::string& error() const { return line; }
    /// That line, once: null if news() has returned it before.
    const char* news() { return told.insert(line).second ? line.c_str() : nullptr; }

    /// Whether these are layers over a pack.
    bool is_of(const Pack& other) const { return pack == other; }

    /// Who sets a value: keys, which are cleared before those of each frame, and scripts, whose values stay.
    enum Source { keys, script };

    /// False for an unknown name and for a number that is not finite; error() says which.
    bool set_expression(Source from, const char* name, double weight);
    bool set_eyelid(Source from, const char* name, double weight);
    /// `rotation` [4]: x, y, z, w of an FQuat.
    bool set_joint(Source from, const char* name, const double* rotation);
    /// It sets nothing any more.
    void clear(Source from) { size(layers[from]); }

    /// A clip by its name and its length in seconds; -1 and 0: there is none.
    int32_t clip(const char* name, double& seconds) const;

    /// Computes the pose. `clip` -1: none. `face` may be null. False where a face cannot drive the avatar.
    bool mix(int32_t clip, double seconds, const AvatarFrame* face);

    /// What mix computed.
    const PoseValues& pose() const { return mixed; }

private:
    /// Values, and which of them replace those of the layer below.
    struct Layer {
        PoseValues values;
        std::vector<char> has_expression, has_eyelid, has_joint;  // [K], [L], [J]
    };

    void size(Layer& layer) const;
    void put(const Layer& layer);
    bool learn_driven();
    bool drive(const AvatarFrame& face);
    bool fail();

    Pack pack;
    AvatarInstance* instance;
    AvatarFacts facts = {};
    Layer layers[2];          // by Source: in the order in which they lie over the clip
    Layer driven;             // what a live face sets
    bool driven_root = false; // whether it moves the whole avatar
    PoseValues mixed;
    std::string line;
    std::set<std::string> told{""};
    std::string driving_line; // why no face can drive it
    bool learned = false;     // `driven` is known, or `driving_line`
};

}  // namespace avatar_unreal
