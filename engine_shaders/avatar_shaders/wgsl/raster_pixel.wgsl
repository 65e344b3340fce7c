// Generated from hlsl/raster.hlsl, entry raster_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
fn splat_alpha_0( offset_0 : vec2<f32>,  conic_0 : vec3<f32>,  opacity_0 : f32) -> f32
{
    var _S1 : f32 = offset_0.x;
    var _S2 : f32 = offset_0.y;
    var power_0 : f32 = -0.5f * (conic_0.x * _S1 * _S1 + conic_0.z * _S2 * _S2) - conic_0.y * _S1 * _S2;
    var _S3 : f32 = min(0.99000000953674316f, opacity_0 * exp(power_0));
    var _S4 : bool;
    if(power_0 > 0.0f)
    {
        _S4 = true;
    }
    else
    {
        _S4 = _S3 < 0.00392156885936856f;
    }
    var _S5 : f32;
    if(_S4)
    {
        _S5 = 0.0f;
    }
    else
    {
        _S5 = _S3;
    }
    return _S5;
}

fn splat_fragment_0( rgb_0 : vec3<f32>,  alpha_0 : f32) -> vec4<f32>
{
    return vec4<f32>(rgb_0 * vec3<f32>(alpha_0), alpha_0);
}

struct pixelOutput_0
{
    @location(0) output_0 : vec4<f32>,
};

struct pixelInput_0
{
    @interpolate(flat) @location(0) place_0 : vec4<f32>,
    @interpolate(flat) @location(1) conic_1 : vec3<f32>,
    @interpolate(flat) @location(2) rgb_1 : vec3<f32>,
};

@fragment
fn raster_pixel( _S6 : pixelInput_0, @builtin(position) position_0 : vec4<f32>) -> pixelOutput_0
{
    var alpha_1 : f32 = splat_alpha_0(_S6.place_0.xy - (position_0.xy - vec2<f32>(0.5f)), _S6.conic_1, _S6.place_0.w);
    if(alpha_1 <= 0.0f)
    {
        discard;
    }
    var _S7 : pixelOutput_0 = pixelOutput_0( splat_fragment_0(_S6.rgb_1, alpha_1) );
    return _S7;
}

