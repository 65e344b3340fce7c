// After stage `raster`, for what an engine draws later: the depth of a splat where its own alpha reaches depth_alpha. The
// vertices are those of raster.hlsl; no colour is written.
// Reads: nothing. Writes: nothing.
#include "platform.hlsli"
#include "raster.hlsli"

AVATAR_CONSTANTS(RasterDepthConstants)
    float3 raster_constants; // RasterConstants: one buffer serves both entries of a draw
    float depth_alpha; // above 0, at most AVATAR_ALPHA_MAX
AVATAR_CONSTANTS_END

void raster_depth_pixel(QuadFragment q)
{
    float level = splat_level(q.centre - q.position.xy, q.form);
    if (level < 0 || splat_fragment(q.rgb, level).a < depth_alpha)
    {
        discard;
    }
}
