// Generated from hlsl/raster_depth.hlsl, entry raster_depth_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_RasterDepthConstants_std140_0
{
    @align(16) raster_constants_0 : vec3<f32>,
    @align(4) depth_alpha_0 : f32,
};

@binding(8) @group(0) var<uniform> RasterDepthConstants_0 : SLANG_ParameterGroup_RasterDepthConstants_std140_0;
fn splat_level_0( offset_0 : vec2<f32>,  form_0 : vec4<f32>) -> f32
{
    var _S1 : f32 = offset_0.x;
    var _S2 : f32 = offset_0.y;
    var power_0 : f32 = _S1 * (form_0.x * _S1 + form_0.y * _S2) + form_0.z * _S2 * _S2;
    var _S3 : f32;
    if(power_0 > 0.0f)
    {
        _S3 = -1.0f;
    }
    else
    {
        _S3 = power_0 + form_0.w;
    }
    return _S3;
}

fn splat_fragment_0( rgb_0 : vec3<f32>,  level_0 : f32) -> vec4<f32>
{
    var _S4 : f32 = min(0.99000000953674316f, exp2(level_0) * 0.00392156885936856f);
    return vec4<f32>(rgb_0 * vec3<f32>(_S4), _S4);
}

struct pixelInput_0
{
    @interpolate(flat) @location(0) centre_0 : vec2<f32>,
    @interpolate(flat) @location(1) form_1 : vec4<f32>,
    @interpolate(flat) @location(2) rgb_1 : vec3<f32>,
};

@fragment
fn raster_depth_pixel( _S5 : pixelInput_0, @builtin(position) position_0 : vec4<f32>)
{
    var level_1 : f32 = splat_level_0(_S5.centre_0 - position_0.xy, _S5.form_1);
    var _S6 : bool;
    if(level_1 < 0.0f)
    {
        _S6 = true;
    }
    else
    {
        _S6 = (splat_fragment_0(_S5.rgb_1, level_1).w) < (RasterDepthConstants_0.depth_alpha_0);
    }
    if(_S6)
    {
        discard;
    }
    return;
}

