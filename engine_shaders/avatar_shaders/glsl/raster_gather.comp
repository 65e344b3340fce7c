#version 310 es
// Generated from hlsl/raster_gather.hlsl, entry raster_gather, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

layout(binding = 8, std140) uniform RasterGatherConstants
{
    uint count;
    uint begin;
    uint piece_count;
    uint first;
    uint chunk_count;
    uint reverse;
} constants;

layout(binding = 1, std430) readonly buffer Pairs
{
    uvec2 _data[];
} Pairs_1;

layout(binding = 0, std430) readonly buffer Projected
{
    vec4 _data[];
} Projected_1;

layout(binding = 2, std430) buffer Quads
{
    vec4 _data[];
} Quads_1;

void _raster_gather(uvec3 id)
{
    uint instance = id.x;
    if (instance >= constants.piece_count)
    {
        return;
    }
    uint rank = constants.begin + instance;
    uint row = Pairs_1._data[(constants.reverse != 0u) ? ((constants.count - 1u) - rank) : rank].y - constants.first;
    if (row >= constants.chunk_count)
    {
        return;
    }
    vec4 place = Projected_1._data[row];
    vec4 conic = Projected_1._data[constants.chunk_count + row];
    vec4 rgb = Projected_1._data[(2u * constants.chunk_count) + row];
    Quads_1._data[3u * instance] = vec4(place.xy, rgb.w, place.w);
    Quads_1._data[(3u * instance) + 1u] = vec4(conic.xyz, 0.0);
    Quads_1._data[(3u * instance) + 2u] = vec4(rgb.xyz, 0.0);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _raster_gather(param);
}

