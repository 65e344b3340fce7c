#version 430
// Generated from hlsl/raster.hlsl, entry raster_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1

struct QuadFragment
{
    vec4 position;
    vec4 place;
    vec3 conic;
    vec3 rgb;
};

layout(location = 0) flat in vec4 q_place;
layout(location = 1) flat in vec3 q_conic;
layout(location = 2) flat in vec3 q_rgb;
layout(location = 0) out vec4 _entryPointOutput;

float splat_alpha(vec2 offset, vec3 conic, float opacity)
{
    float power = ((-0.5) * (((conic.x * offset.x) * offset.x) + ((conic.z * offset.y) * offset.y))) - ((conic.y * offset.x) * offset.y);
    float alpha = min(0.9900000095367431640625, opacity * exp(power));
    return ((power > 0.0) || (alpha < 0.0039215688593685626983642578125)) ? 0.0 : alpha;
}

vec4 splat_fragment(vec3 rgb, float alpha)
{
    return vec4(rgb * alpha, alpha);
}

vec4 _raster_pixel(QuadFragment q)
{
    vec2 param = q.place.xy - (q.position.xy - vec2(0.5));
    vec3 param_1 = q.conic;
    float param_2 = q.place.w;
    float alpha = splat_alpha(param, param_1, param_2);
    if (alpha <= 0.0)
    {
        discard;
    }
    vec3 param_3 = q.rgb;
    float param_4 = alpha;
    return splat_fragment(param_3, param_4);
}

void main()
{
    QuadFragment q;
    q.position = gl_FragCoord;
    q.place = q_place;
    q.conic = q_conic;
    q.rgb = q_rgb;
    QuadFragment param = q;
    vec4 _150 = _raster_pixel(param);
    _entryPointOutput = _150;
}

