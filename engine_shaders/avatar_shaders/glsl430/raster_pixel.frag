#version 430
// Generated from hlsl/raster.hlsl, entry raster_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1

struct QuadFragment
{
    vec4 position;
    vec2 centre;
    vec4 form;
    vec3 rgb;
};

layout(location = 0) flat in vec2 q_centre;
layout(location = 1) flat in vec4 q_form;
layout(location = 2) flat in vec3 q_rgb;
layout(location = 0) out vec4 _entryPointOutput;

float splat_level(vec2 offset, vec4 form)
{
    float power = (offset.x * ((form.x * offset.x) + (form.y * offset.y))) + ((form.z * offset.y) * offset.y);
    return (power > 0.0) ? (-1.0) : (power + form.w);
}

vec4 splat_fragment(vec3 rgb, float level)
{
    float alpha = min(0.9900000095367431640625, exp2(level) * 0.0039215688593685626983642578125);
    return vec4(rgb * alpha, alpha);
}

vec4 _raster_pixel(QuadFragment q)
{
    vec2 param = q.centre - q.position.xy;
    vec4 param_1 = q.form;
    float level = splat_level(param, param_1);
    if (level < 0.0)
    {
        discard;
    }
    vec3 param_2 = q.rgb;
    float param_3 = level;
    return splat_fragment(param_2, param_3);
}

void main()
{
    QuadFragment q;
    q.position = gl_FragCoord;
    q.centre = q_centre;
    q.form = q_form;
    q.rgb = q_rgb;
    QuadFragment param = q;
    vec4 _138 = _raster_pixel(param);
    _entryPointOutput = _138;
}

