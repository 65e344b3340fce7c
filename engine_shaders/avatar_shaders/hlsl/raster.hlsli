// Core of stage `raster`, profile `engine`: one front-parallel quad a splat; alpha depends on the fragment's position.
// Reads: nothing. Writes: nothing.
//
// Composite premultiplied into a float target, back to front (ONE, ONE_MINUS_SRC_ALPHA) or front to back
// (ONE_MINUS_DST_ALPHA, ONE). Colours stay display-referred until entry `composite_pixel`.
#ifndef AVATAR_RASTER_HLSLI
#define AVATAR_RASTER_HLSLI

#include "constants.hlsli"

#define AVATAR_QUAD_BATCH 128 // splats an instance of raster_vertex_batch
#define AVATAR_QUAD_ROW 512 // splats a row of the texture that raster_vertex_batch reads: three texels each

static const float LOG2_E = 1.44269504;
static const float LN_2 = 0.693147181;

struct QuadFragment
{
    float4 position : SV_Position;
    nointerpolation float2 centre : TEXCOORD0; // as SV_Position counts: pixel centres at halves
    nointerpolation float4 form : TEXCOORD1; // splat_form
    nointerpolation float3 rgb : TEXCOORD2;
};

// What all pixels of a splat share: log2(255 alpha) at `offset` d is d.x (x d.x + y d.y) + z d.y d.y + w.
float4 splat_form(float3 conic, float opacity)
{
    float most = log2(opacity * AVATAR_ALPHA_MIN_DENOMINATOR);
    return float4(-0.5 * LOG2_E * conic.x, -LOG2_E * conic.y, -0.5 * LOG2_E * conic.z, most);
}

// log2(255 alpha) at `offset` = centre - pixel. Below 0 where alpha is below 1/255 or the conic is indefinite: nothing
// is drawn there.
float splat_level(float2 offset, float4 form)
{
    float power = offset.x * (form.x * offset.x + form.y * offset.y) + form.z * offset.y * offset.y;
    return power > 0 ? -1.0 : power + form.w;
}

// Premultiplied colour and alpha of a fragment.
float4 splat_fragment(float3 rgb, float level)
{
    float alpha = min(AVATAR_ALPHA_MAX, exp2(level) * (1.0 / AVATAR_ALPHA_MIN_DENOMINATOR));
    return float4(rgb * alpha, alpha);
}

static const float QUAD_MARGIN = 0.125; // pixels: GPUs may snap corners to 1/16 of a pixel
static const float SMALL_SPLAT = 8; // pixels from the centre

// A corner (-1 or 1 each) of the rectangle that holds every pixel with alpha >= 1/255, in pixels. Most splats are small,
// and there two triangles cost more than what a larger one covers in vain: the two upper corners meet, so that one
// triangle about the ellipse is left. `most` is the splat's largest level.
float2 splat_corner(float2 corner, float2 centre, float3 conic, float most, float2 size)
{
    float reach = 2 * LN_2 * max(most, 0.0);
    // The determinant minus its largest rounding error: a quad that is too large costs little, one that is too small
    // cuts the splat.
    float det = conic.x * conic.z - conic.y * conic.y - 3e-7 * (conic.x * conic.z + conic.y * conic.y);
    if (!(det > 0))
    {
        return (0.5 * corner + 0.5) * size - 0.5;
    }
    float mid = 0.5 * (conic.x + conic.z), half_gap = 0.5 * (conic.x - conic.z);
    float larger = mid + sqrt(half_gap * half_gap + conic.y * conic.y);
    float2 axis = half_gap >= 0 ? float2(larger - conic.z, conic.y) : float2(conic.y, larger - conic.x);
    float axis_length = length(axis);
    axis = axis_length > 0 ? axis / axis_length : float2(1, 0);
    float across = min(sqrt(reach / larger), 1e6) + QUAD_MARGIN;
    float along = min(sqrt(reach * larger / det), 1e6) + QUAD_MARGIN;
    if (along < SMALL_SPLAT)
    {
        corner = corner.y < 0 ? float2(1.7320508 * corner.x, -1) : float2(0, 2);
    }
    return centre + corner.x * across * axis + corner.y * along * float2(-axis.y, axis.x);
}

// Clip position of a point in pixels (pixel centres at integers, y down). flip_y = 1 where clip y points up and
// the target's first row is the top one (Direct3D), -1 where the first row is the bottom one (OpenGL).
float4 clip_from_pixels(float2 pixel, float clip_depth, float2 size, float flip_y)
{
    float2 ndc = (2 * pixel + 1) / size - 1;
    return float4(ndc.x, -flip_y * ndc.y, clip_depth, 1);
}

float3 linear_from_display(float3 srgb)
{
    float3 low = srgb / 12.92;
    float3 high = pow(max((srgb + 0.055) / 1.055, 0.0), 2.4);
    return float3(
        srgb.x <= 0.04045 ? low.x : high.x,
        srgb.y <= 0.04045 ? low.y : high.y,
        srgb.z <= 0.04045 ? low.z : high.z);
}

#endif
