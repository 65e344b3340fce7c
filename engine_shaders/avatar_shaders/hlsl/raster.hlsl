// Stage `raster`, last step: draws a strip of 4 vertices an instance, one instance a splat.
// Reads: Quads (raster_vertex_fetch alone; raster_vertex takes it as instance attributes), QuadTexels
// (raster_vertex_batch alone, whose instance is a batch of splats). Writes: nothing.
#include "platform.hlsli"
#include "raster.hlsli"

StructuredBuffer<float4> Quads; // [3 instances]: centre, clip depth, opacity; conic, 0; rgb, 0
AVATAR_FLOAT_TEXTURE(QuadTexels); // the same, AVATAR_QUAD_ROW splats a row

AVATAR_CONSTANTS(RasterConstants)
    float2 image_size; // pixels
    float flip_y; // 1 Direct3D, -1 OpenGL; see clip_from_pixels
AVATAR_CONSTANTS_END

QuadFragment quad_vertex(uint vertex, float4 place, float3 conic, float3 rgb)
{
    QuadFragment q;
    q.centre = place.xy + 0.5;
    q.form = splat_form(conic, place.w);
    q.rgb = rgb;
    q.position = float4(2, 2, 0, 1); // not visible: all four corners at one point outside the image
    if (q.form.w >= 0)
    {
        float2 corner = float2((vertex & 1) != 0 ? 1 : -1, (vertex & 2) != 0 ? 1 : -1);
        float2 pixel = splat_corner(corner, place.xy, conic, q.form.w, image_size);
        q.position = clip_from_pixels(pixel, place.z, image_size, flip_y);
    }
    return q;
}

QuadFragment raster_vertex(
    float4 quad0 : TEXCOORD0, float4 quad1 : TEXCOORD1, float4 quad2 : TEXCOORD2, uint vertex : SV_VertexID)
{
    return quad_vertex(vertex, quad0, quad1.xyz, quad2.xyz);
}

QuadFragment raster_vertex_fetch(uint vertex : SV_VertexID, uint instance : SV_InstanceID)
{
    return quad_vertex(vertex, Quads[3 * instance], Quads[3 * instance + 1].xyz, Quads[3 * instance + 2].xyz);
}

// For devices that are slow at instances of four vertices: vertex 4 k + c is corner c of splat k of the batch.
QuadFragment raster_vertex_batch(uint vertex : SV_VertexID, uint instance : SV_InstanceID)
{
    uint splat = instance * AVATAR_QUAD_BATCH + vertex / 4;
    int3 at = int3(3 * (splat % AVATAR_QUAD_ROW), splat / AVATAR_QUAD_ROW, 0);
    return quad_vertex(
        vertex, QuadTexels.Load(at), QuadTexels.Load(at + int3(1, 0, 0)).xyz, QuadTexels.Load(at + int3(2, 0, 0)).xyz);
}

float4 raster_pixel(QuadFragment q) : SV_Target
{
    float level = splat_level(q.centre - q.position.xy, q.form);
    if (level < 0)
    {
        discard;
    }
    return splat_fragment(q.rgb, level);
}
