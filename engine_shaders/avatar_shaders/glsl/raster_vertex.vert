#version 310 es
// Generated from hlsl/raster.hlsl, entry raster_vertex, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1

struct QuadFragment
{
    vec4 position;
    vec2 centre;
    vec4 form;
    vec3 rgb;
};

layout(binding = 8, std140) uniform RasterConstants
{
    vec2 image_size;
    float flip_y;
} constants;

layout(location = 0) in vec4 quad0;
layout(location = 1) in vec4 quad1;
layout(location = 2) in vec4 quad2;
layout(location = 0) flat out vec2 _entryPointOutput_centre;
layout(location = 1) flat out vec4 _entryPointOutput_form;
layout(location = 2) flat out vec3 _entryPointOutput_rgb;

vec4 splat_form(vec3 conic, float opacity)
{
    float most = log2(opacity * 255.0);
    return vec4((-0.721347510814666748046875) * conic.x, (-1.44269502162933349609375) * conic.y, (-0.721347510814666748046875) * conic.z, most);
}

vec2 splat_corner(inout vec2 corner, vec2 centre, vec3 conic, float most, vec2 size)
{
    float reach = 1.38629436492919921875 * max(most, 0.0);
    float det = ((conic.x * conic.z) - (conic.y * conic.y)) - (3.0000001061125658452510833740234e-07 * ((conic.x * conic.z) + (conic.y * conic.y)));
    if (!(det > 0.0))
    {
        return (((corner * 0.5) + vec2(0.5)) * size) - vec2(0.5);
    }
    float mid = 0.5 * (conic.x + conic.z);
    float half_gap = 0.5 * (conic.x - conic.z);
    float larger = mid + sqrt((half_gap * half_gap) + (conic.y * conic.y));
    vec2 axis = mix(vec2(conic.y, larger - conic.x), vec2(larger - conic.z, conic.y), bvec2(half_gap >= 0.0));
    float axis_length = length(axis);
    axis = mix(vec2(1.0, 0.0), axis / vec2(axis_length), bvec2(axis_length > 0.0));
    float across = min(sqrt(reach / larger), 1000000.0) + 0.125;
    float along = min(sqrt((reach * larger) / det), 1000000.0) + 0.125;
    if (along < 8.0)
    {
        corner = mix(vec2(0.0, 2.0), vec2(1.73205077648162841796875 * corner.x, -1.0), bvec2(corner.y < 0.0));
    }
    return (centre + (axis * (corner.x * across))) + (vec2(-axis.y, axis.x) * (corner.y * along));
}

vec4 clip_from_pixels(vec2 pixel, float clip_depth, vec2 size, float flip_y)
{
    vec2 ndc = (((pixel * 2.0) + vec2(1.0)) / size) - vec2(1.0);
    return vec4(ndc.x, (-flip_y) * ndc.y, clip_depth, 1.0);
}

QuadFragment quad_vertex(uint vertex, vec4 place, vec3 conic, vec3 rgb)
{
    QuadFragment q;
    q.centre = place.xy + vec2(0.5);
    vec3 param = conic;
    float param_1 = place.w;
    q.form = splat_form(param, param_1);
    q.rgb = rgb;
    q.position = vec4(2.0, 2.0, 0.0, 1.0);
    if (q.form.w >= 0.0)
    {
        vec2 corner = vec2(float(((vertex & 1u) != 0u) ? 1 : (-1)), float(((vertex & 2u) != 0u) ? 1 : (-1)));
        vec2 param_2 = corner;
        vec2 param_3 = place.xy;
        vec3 param_4 = conic;
        float param_5 = q.form.w;
        vec2 param_6 = constants.image_size;
        vec2 _320 = splat_corner(param_2, param_3, param_4, param_5, param_6);
        vec2 pixel = _320;
        vec2 param_7 = pixel;
        float param_8 = place.z;
        vec2 param_9 = constants.image_size;
        float param_10 = constants.flip_y;
        q.position = clip_from_pixels(param_7, param_8, param_9, param_10);
    }
    return q;
}

QuadFragment _raster_vertex(vec4 quad0_1, vec4 quad1_1, vec4 quad2_1, uint vertex)
{
    uint param = vertex;
    vec4 param_1 = quad0_1;
    vec3 param_2 = quad1_1.xyz;
    vec3 param_3 = quad2_1.xyz;
    return quad_vertex(param, param_1, param_2, param_3);
}

void main()
{
    vec4 quad0_1 = quad0;
    vec4 quad1_1 = quad1;
    vec4 quad2_1 = quad2;
    uint vertex = uint(gl_VertexID);
    vec4 param = quad0_1;
    vec4 param_1 = quad1_1;
    vec4 param_2 = quad2_1;
    uint param_3 = vertex;
    QuadFragment flattenTemp = _raster_vertex(param, param_1, param_2, param_3);
    gl_Position = flattenTemp.position;
    _entryPointOutput_centre = flattenTemp.centre;
    _entryPointOutput_form = flattenTemp.form;
    _entryPointOutput_rgb = flattenTemp.rgb;
    gl_Position.z = 2.0 * gl_Position.z - gl_Position.w;
}

