// Core of stages `shadow` and `light`: what light reaches a Gaussian, and its colour in that light.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_LIGHT_HLSLI
#define AVATAR_LIGHT_HLSLI

#include "splat.hlsli"

// Texels of a shadow map that a Gaussian may reach to each side, and a triangle in all, so that their work is bounded.
static const float SHADOW_REACH = 12;
static const float SHADOW_SPAN = 128;
static const float DISPLAY_TOE = 0.04045; // of sRGB: below it the curve is a line
static const float LINEAR_TOE = 0.0031308;

// Irradiance over pi by the unit normal n: spherical harmonics with the bases and signs of colours.
float3 light_ambient(
    float3 n, float3 a0, float3 a1, float3 a2, float3 a3, float3 a4, float3 a5, float3 a6, float3 a7, float3 a8)
{
    return sh_band0(a0) + sh_band1(n, a1, a2, a3) + sh_band2(n, a4, a5, a6, a7, a8);
}

// What one light gives to a white matt surface at x with unit normal n. `place`: xyz towards the light and w 0, or its
// position and w 1. `colour`: what it gives to a surface that faces it, of a point light from 1 m.
float3 light_direct(float3 n, float3 x, float4 place, float3 colour)
{
    float3 to = place.xyz - place.w * x;
    float squared = dot(to, to);
    float facing = max(dot(n, to) / sqrt(max(squared, 1e-30)), 0.0);
    return colour * (place.w != 0 ? facing / max(squared, AVATAR_LIGHT_NEAREST * AVATAR_LIGHT_NEAREST) : facing);
}

float light_power(float x, float exponent)
{
    return x > 0 ? exp(exponent * log(x)) : 0;
}

// A display-referred channel after its linear value is multiplied by `ratio`.
float light_channel(float display, float ratio)
{
    if (display > DISPLAY_TOE)
    {
        float raised = (display + 0.055) * light_power(ratio, 1.0 / 2.4);
        return raised > DISPLAY_TOE + 0.055 ? raised - 0.055 : 12.92 * light_power(raised / 1.055, 2.4);
    }
    float lit = display / 12.92 * ratio;
    return lit <= LINEAR_TOE ? 12.92 * lit : 1.055 * light_power(lit, 1.0 / 2.4) - 0.055;
}

// The colour in light `scene` of what was trained in light `capture`. Equal lights change no bit.
float3 light_colour(float3 display, float3 scene, float3 capture)
{
    float3 ratio = max(scene, 0.0) / max(capture, AVATAR_LIGHT_FLOOR);
    if (ratio.x == 1 && ratio.y == 1 && ratio.z == 1)
    {
        return display;
    }
    return float3(
        light_channel(display.x, ratio.x), light_channel(display.y, ratio.y), light_channel(display.z, ratio.z));
}

// Where a shadow map has the point x: column and row in texels, distance from the light.
struct ShadowPoint
{
    float2 texel; // centres at integers
    float distance;
    float scale; // 1 / w
};

ShadowPoint shadow_point(float3 x, float4 row0, float4 row1, float4 row2, float4 row3)
{
    float4 at = float4(x, 1);
    ShadowPoint p;
    p.scale = 1.0 / dot(row3, at);
    p.texel = float2(dot(row0, at), dot(row1, at)) * p.scale;
    p.distance = dot(row2, at);
    return p;
}

// Weight of the column (or row) i, 0 to 3, of the 4x4 texels around a point: a box of 3 texels, moved by `part`.
float shadow_weight(uint i, float part)
{
    return (i == 0 ? 1 - part : i == 3 ? part : 1.0) / 3.0;
}

#endif
