#pragma once
#include "../../include/avatar_conform.h"
#include "../c_interface/play_handles.h"
#include "reference.h"

namespace avatar {

/// One stage alone of one avatar at its finest level: inputs are written, its passes run, outputs are read. Every
/// function returns false where an input does not fit the avatar, or where `failed` is set: the runner failed, or there is
/// no memory.
class GpuStages {
public:
    GpuStages(const AvatarStageRunner& runner, const AvatarPack& pack, Arena& arena);
    ~GpuStages();

    /// Outputs of a stage by the names of the reference.
    bool run(const Step& step, const Case& of, Arena& arena, Arrays& out);

    bool failed = false;

private:
    bool write(const char* buffer, const void* bytes, size_t size);
    bool read(const char* buffer, void* bytes, size_t size);
    bool run_stage(const char* stage);
    bool put_pose(const Step& step, Arena& arena);
    bool put_mesh(const Step& step, const char* name, Arena& arena);
    bool take_mesh(const char* name, Arena& arena, Arrays& out);
    bool put(const Step& step, bool projected, Arena& arena);
    bool take(const char* const* names, size_t count, bool projected, Arena& arena, Arrays& out);
    bool put_sh(const Step& step, Arena& arena);
    bool take_sh(Arena& arena, Arrays& out);
    bool bind(const Step& step, Arena& arena, Arrays& out);
    bool project(const Step& step, const Case& of, Arena& arena, Arrays& out);
    bool put_light(const Step& step);
    bool shadow(const Step& step, Arena& arena, Arrays& out);
    bool light(const Step& step, Arena& arena, Arrays& out);
    bool sort(const Step& step, Arena& arena, Arrays& out);
    bool raster(const Step& step, const Case& of, Arena& arena, Arrays& out);
    bool write_pairs(Span<double> order, Arena& arena);

    const AvatarStageRunner& runner_;
    const Avatar& avatar_;
    const Level& level_;
    AvatarPasses* lists_[5] = {};
    AvatarSort* sort_ = nullptr;
    FrameValues values_;
    size_t rows_ = 0, sh_terms_ = 0;
};

}  // namespace avatar
