#pragma once
#include "../formats/json.h"
#include "../pack/model.h"

namespace avatar {

/// An array of a stage.
struct Named {
    Text name;
    Span<double> values;
};

/// Arrays of a stage by name.
struct Arrays {
    static constexpr size_t most = 16;

    Named arrays[most];
    size_t size = 0;

    void add(Text name, Span<double> values) {
        if (size < most) arrays[size++] = {name, values};
    }
    /// Null: there is none.
    const Named* find(Text name) const {
        for (size_t i = 0; i < size; i++) {
            if (arrays[i].name == name) return &arrays[i];
        }
        return nullptr;
    }
};

/// An expected output with its tolerance: an element may be off by atol * weight + rtol * |reference|.
struct Expected {
    Text name;
    Span<double> values;
    size_t rows;
    double atol, rtol;
    bool has_weight;
    Span<double> weight;  // of each row
    Text flips;           // "sign", "drawn", "cutoff", "shadow": how right answers may differ; or empty
    uint32_t most_flips;  // how many rows may
};

/// One stage of a case.
struct Step {
    Text stage;
    Text profile;  // how images are composited: "engine" is by quads; or empty
    bool has_pixels;
    Span<double> pixels;  // y * width + x of an image that are compared
    Arrays inputs;
    Span<Expected> outputs;
};

/// One pose seen by one camera, or one captured frame.
struct Case {
    Text name;
    bool has_camera;
    AvatarCamera camera;
    bool within_range;  // whether driving limits weights to their trained ranges
    Span<Step> steps;
};

/// What a player must compute, stage by stage: the files that `avatar-export pack --reference` writes (SPEC.md,
/// section 16). `cases` is the text of cases.json or driving.json, `vectors` the bytes of its .safetensors file. The
/// arena's error is set for what does not fit.
Span<Case> read_reference(Text cases, const uint8_t* vectors, size_t bytes, Arena& arena);

/// How far an array lies from its reference.
struct Verdict {
    double error;    // largest absolute difference, without flips
    double used;     // largest share of the tolerance; 1 is the most that passes
    uint32_t flips;  // rows on the other side of a threshold
    bool passed;
};

/// Compares the outputs of a step with the reference, element by element. One that is missing or of another length fails.
Verdict judge(const Step& step, const Expected& expected, const Arrays& got);

/// Stages driving and joints, which no GPU runs. False: the inputs do not fit the avatar.
bool run_driving(const Avatar& avatar, const Step& step, bool within_range, Arena& arena, Arrays& out);
bool run_joints(const Avatar& avatar, const Case& of, const Step& step, Arena& arena, Arrays& out);

}  // namespace avatar
