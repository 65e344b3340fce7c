#pragma once
#include "../formats/memory.h"
#include "contracts.h"

namespace avatar {

/// The elements of a section: whole numbers, or the bits of float32, little-endian.
struct Elements {
    const uint8_t* data = nullptr;
    uint32_t bits = 8;  // of an element: 8, 16 or 32
    uint32_t length = 0;

    size_t bytes() const { return static_cast<size_t>(length) * (bits / 8); }
    /// 32-bit words that they take.
    uint32_t words() const { return static_cast<uint32_t>((bytes() + 3) / 4); }
    /// Element i.
    uint32_t operator[](size_t i) const {
        if (bits == 8) return data[i];
        const uint8_t* at = data + i * (bits / 8);
        const uint32_t low = static_cast<uint32_t>(at[0]) | static_cast<uint32_t>(at[1]) << 8;
        return bits == 16 ? low : low | static_cast<uint32_t>(at[2]) << 16 | static_cast<uint32_t>(at[3]) << 24;
    }
    /// Element i of 32 bits as float32.
    float float_at(size_t i) const {
        const uint32_t bits32 = (*this)[i];
        float value;
        std::memcpy(&value, &bits32, 4);
        return value;
    }
};

/// A run of equal elements in a packed buffer. It begins at a 32-bit word.
struct Section {
    Text name;  // the constant by which kernels know where it begins
    Elements elements;
};

/// A buffer of the GPU: static with sections, or writable with a size alone.
struct Buffer {
    Text name;
    double bytes;  // a whole number
    Span<Section> sections;

    /// Null: there is none.
    const Section* find(Text section) const {
        for (const Section& one : sections) {
            if (one.name == section) return &one;
        }
        return nullptr;
    }
};

/// Bytes that sections take.
inline double bytes_of(Span<Section> sections) {
    double words = 0;
    for (const Section& one : sections) words += one.elements.words();
    return 4 * words;
}

/// A number, a vector, or the name of a value of the frame: "world_row0", "group_matrix_row1[2]".
struct Constant {
    enum class Kind : uint8_t { number, vector, source };

    Text name;
    Kind kind;
    uint32_t floats;  // of a vector, 0 to 4
    double number;
    double vector[4];
    Text source;
};

/// A buffer that a pass binds.
struct Bound {
    Text name;   // the shader's
    Text buffer;
    uint32_t index;  // in Program::buffers, once checked
};

/// One dispatch of one kernel.
struct Pass {
    Text entry;
    double rows;  // threads that have work
    Span<Bound> buffers;
    Span<Constant> constants;

    /// Null: there is none.
    const Constant* constant(Text name) const {
        for (const Constant& one : constants) {
            if (one.name == name) return &one;
        }
        return nullptr;
    }
    const Bound* buffer(Text name) const {
        for (const Bound& one : buffers) {
            if (one.name == name) return &one;
        }
        return nullptr;
    }
};

/// Rows first .. first + count of an avatar's Gaussians.
struct Run {
    int32_t first;
    int32_t count;
};

/// One level of detail. Chunk i is in the buffers prefix + "Splats." + i, Sh and Projected.
struct Level {
    Text prefix;
    Span<Run> chunks;
    Span<Pass> deform;  // once a pose
    Span<Pass> view;    // once a camera
    Span<Pass> shadow;  // once a pose and light, where one casts shadows; empty where light is
    Span<Pass> light;   // once a camera, after view, where the scene has a light; empty: colours stay as trained
};

/// First floats of the sections of buffer Pose: weights [K], features [9 C], late [L], joints [J, 3, 4].
struct PoseSections {
    int32_t weights, features, late, joints;
};

/// All that a player runs up to stage project. Sorting and drawing belong to its scene.
struct Program {
    Span<Buffer> buffers;
    Names buffer_names;
    Span<Pass> mesh;  // stages morph and skin
    Span<Level> levels;
    PoseSections pose;
    int32_t pose_floats;
    bool reads_mesh;  // deform reads buffer Mesh: then the passes of mesh run before it
};

/// An expression: a blendshape weight that a pose sets, with its trained range.
struct Expression {
    Text name;
    Span<Text> aliases;
    double low, high;
};

/// Skeleton at rest. Matrices are row-major 4x4 for column vectors.
struct Skeleton {
    Span<Text> names;                // [J], a parent before its children
    Span<int32_t> parents;           // [J], -1 for a root
    Span<double> rest_local;         // [J, 4, 4] parent from joint
    Span<double> inverse_bind;       // [J, 4, 4] joint from mesh
    Span<double> joint_basis;        // [K, J, 3] how far each expression moves each joint at rest, metres
    Span<uint32_t> corrective_joints;  // [C] whose rotation gives nine pose features each
    Span<uint32_t> anchor_vertices;  // [A] that groups of binding anchor follow, repeats kept
};

enum class Binding : uint8_t { skin, anchor, joint_mix, surface, none };

/// A joint and its factor.
struct Factor {
    Text joint;
    double factor;
};

/// A group of Gaussians with one binding.
struct Group {
    Text name;
    int32_t first, count;
    Binding binding;
    Span<Factor> joint_mix;
};

/// A recorded motion. Frame t of an array begins at t times its row.
struct ClipData {
    Text name;
    double fps;
    int32_t frames;                  // T
    Span<float> expression_weights;  // [T, K]
    Span<float> late_weights;        // [T, L]
    Span<float> joint_delta;         // [T, J, 4, 4]
    Span<float> world_from_avatar;   // [T, 4, 4] rigid
};

/// How ARKit inputs drive the avatar: outputs = matrix inputs, and the joints of measured rotations.
struct Driving {
    Span<Text> inputs;    // the columns of matrix
    Span<Text> outputs;   // "expression/NAME", "eyelid/NAME" or "joint/NAME/x", its rows
    Span<double> matrix;  // [outputs, inputs]
    Text head_joint;      // turns with the head; empty: the avatar turns as a whole
    double head_pivot[3];
    Text left_eye_joint;  // or empty
    Text right_eye_joint;
};

/// A level as a person sees it; below 0: not stated.
struct LevelInfo {
    int32_t count;
    double height_px;
    double psnr_db;
};

/// A part that a camera may look at, metres.
struct FramedPart {
    bool given;
    double target[3];
    double size[3];
};

/// Where to look at rest, right-handed for every pack.
struct Framing {
    double up[3];
    double front[3];
    FramedPart whole;
    FramedPart head;
};

/// The light in which an avatar was captured. Normals and colours are in the program.
struct Relight {
    bool given;
    bool follows;        // it moves with the avatar, not with the world
    int64_t head;        // and with this joint; below 0: with none
    double centre[3];    // of the sphere in which everything lies that casts shadows, in the pack's frame
    double radius;
};

/// Rules that a player needs; empty: null or missing.
struct Rules {
    Text rotation, rotation_joint, anchor;
};

/// A loaded and checked pack. Nothing of it changes.
struct Avatar {
    Text name;
    Text license;  // empty: not stated
    Text consent;
    bool left_handed;
    Span<Expression> expressions;  // [K] in the order of weights
    Span<Text> late_morphs;        // [L] names of eyelids
    bool has_skeleton;
    Skeleton skeleton;
    Span<Group> groups;  // they cover the Gaussians of the finest level in order
    Rules rules;
    Relight relight;
    Span<ClipData> clips;
    bool has_driving;
    Driving driving;
    Span<LevelInfo> levels;  // finest first
    Framing framing;
    double bounds_low[3], bounds_high[3];  // right-handed for every pack
    bool has_background;
    double background[3];
    Span<uint8_t> preview;
    Span<uint32_t> triangles;  // [3, F]
    size_t file_bytes;
    Program program;
    Names expression_names;  // aliases too
    Names late_names;
    Names joint_names;
};

/// What a pass may ask of a frame. Names that begin with "group_" have a row a group.
struct FrameSource {
    const char* name;
    uint32_t floats;
};
extern const FrameSource frame_sources[];
constexpr uint32_t frame_source_count = 45;

}  // namespace avatar
