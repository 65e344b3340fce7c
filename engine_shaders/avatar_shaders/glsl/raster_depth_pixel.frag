#version 310 es
// Generated from hlsl/raster_depth.hlsl, entry raster_depth_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
precision mediump float;
precision highp int;

struct QuadFragment
{
    highp vec4 position;
    highp vec2 centre;
    highp vec4 form;
    highp vec3 rgb;
};

layout(binding = 8, std140) uniform RasterDepthConstants
{
    highp vec3 raster_constants;
    highp float depth_alpha;
} constants;

layout(location = 0) flat in highp vec2 q_centre;
layout(location = 1) flat in highp vec4 q_form;
layout(location = 2) flat in highp vec3 q_rgb;

highp float splat_level(highp vec2 offset, highp vec4 form)
{
    highp float power = (offset.x * ((form.x * offset.x) + (form.y * offset.y))) + ((form.z * offset.y) * offset.y);
    return (power > 0.0) ? (-1.0) : (power + form.w);
}

highp vec4 splat_fragment(highp vec3 rgb, highp float level)
{
    highp float alpha = min(0.9900000095367431640625, exp2(level) * 0.0039215688593685626983642578125);
    return vec4(rgb * alpha, alpha);
}

void _raster_depth_pixel(QuadFragment q)
{
    highp vec2 param = q.centre - q.position.xy;
    highp vec4 param_1 = q.form;
    highp float level = splat_level(param, param_1);
    highp vec3 param_2 = q.rgb;
    highp float param_3 = level;
    if ((level < 0.0) || (splat_fragment(param_2, param_3).w < constants.depth_alpha))
    {
        discard;
    }
}

void main()
{
    QuadFragment q;
    q.position = gl_FragCoord;
    q.centre = q_centre;
    q.form = q_form;
    q.rgb = q_rgb;
    QuadFragment param = q;
    _raster_depth_pixel(param);
}

