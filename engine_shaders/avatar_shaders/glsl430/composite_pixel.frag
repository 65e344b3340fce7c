#version 430
// Generated from hlsl/composite.hlsl, entry composite_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1

layout(binding = 8, std140) uniform CompositeConstants
{
    vec4 background;
    float linear_target;
    float flip_rows;
    vec2 image_size;
} constants;

layout(binding = 0) uniform sampler2D Accumulated;

layout(location = 0) out vec4 _entryPointOutput;

vec3 linear_from_display(vec3 srgb)
{
    vec3 low = srgb / vec3(12.9200000762939453125);
    vec3 high = pow(max((srgb + vec3(0.054999999701976776123046875)) / vec3(1.05499994754791259765625), vec3(0.0)), vec3(2.400000095367431640625));
    return vec3((srgb.x <= 0.040449999272823333740234375) ? low.x : high.x, (srgb.y <= 0.040449999272823333740234375) ? low.y : high.y, (srgb.z <= 0.040449999272823333740234375) ? low.z : high.z);
}

vec4 _composite_pixel(vec4 position)
{
    float y = (constants.flip_rows != 0.0) ? (constants.image_size.y - position.y) : position.y;
    vec4 colour = texelFetch(Accumulated, ivec3(int(position.x), int(y), 0).xy, ivec3(int(position.x), int(y), 0).z);
    float left = 1.0 - colour.w;
    float alpha = colour.w + (left * constants.background.w);
    vec3 display = colour.xyz + (constants.background.xyz * (left * constants.background.w));
    if (constants.linear_target != 0.0)
    {
        vec3 _154 = display / vec3(alpha);
        bvec3 _157 = bvec3(alpha > 0.0);
        vec3 straight = vec3(_157.x ? _154.x : display.x, _157.y ? _154.y : display.y, _157.z ? _154.z : display.z);
        vec3 param = straight;
        display = linear_from_display(param) * alpha;
    }
    return vec4(display, alpha);
}

void main()
{
    vec4 position = gl_FragCoord;
    vec4 param = position;
    _entryPointOutput = _composite_pixel(param);
}

