#version 310 es
// Generated from hlsl/composite.hlsl, entry composite_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
precision mediump float;
precision highp int;

layout(binding = 8, std140) uniform CompositeConstants
{
    highp vec4 background;
    highp float linear_target;
    highp float flip_rows;
    highp vec2 image_size;
} constants;

layout(binding = 0) uniform highp sampler2D Accumulated;

layout(location = 0) out highp vec4 _entryPointOutput;

highp vec3 linear_from_display(highp vec3 srgb)
{
    highp vec3 low = srgb / vec3(12.9200000762939453125);
    highp vec3 high = pow(max((srgb + vec3(0.054999999701976776123046875)) / vec3(1.05499994754791259765625), vec3(0.0)), vec3(2.400000095367431640625));
    return vec3((srgb.x <= 0.040449999272823333740234375) ? low.x : high.x, (srgb.y <= 0.040449999272823333740234375) ? low.y : high.y, (srgb.z <= 0.040449999272823333740234375) ? low.z : high.z);
}

highp vec4 _composite_pixel(highp vec4 position)
{
    highp float y = (constants.flip_rows != 0.0) ? (constants.image_size.y - position.y) : position.y;
    highp vec4 colour = texelFetch(Accumulated, ivec3(int(position.x), int(y), 0).xy, ivec3(int(position.x), int(y), 0).z);
    highp float left = 1.0 - colour.w;
    highp float alpha = colour.w + (left * constants.background.w);
    highp vec3 display = colour.xyz + (constants.background.xyz * (left * constants.background.w));
    if (constants.linear_target != 0.0)
    {
        highp vec3 straight = mix(display, display / vec3(alpha), bvec3(alpha > 0.0));
        highp vec3 param = straight;
        display = linear_from_display(param) * alpha;
    }
    return vec4(display, alpha);
}

void main()
{
    highp vec4 position = gl_FragCoord;
    highp vec4 param = position;
    _entryPointOutput = _composite_pixel(param);
}

