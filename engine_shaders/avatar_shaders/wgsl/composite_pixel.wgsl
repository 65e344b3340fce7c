// Generated from hlsl/composite.hlsl, entry composite_pixel, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_CompositeConstants_std140_0
{
    @align(16) background_0 : vec4<f32>,
    @align(16) linear_target_0 : f32,
    @align(4) flip_rows_0 : f32,
    @align(8) image_size_0 : vec2<f32>,
};

@binding(8) @group(0) var<uniform> CompositeConstants_0 : SLANG_ParameterGroup_CompositeConstants_std140_0;
@binding(0) @group(0) var Accumulated_0 : texture_2d<f32>;

fn linear_from_display_0( srgb_0 : vec3<f32>) -> vec3<f32>
{
    var low_0 : vec3<f32> = srgb_0 / vec3<f32>(12.92000007629394531f);
    var high_0 : vec3<f32> = pow(max((srgb_0 + vec3<f32>(0.05499999970197678f)) / vec3<f32>(1.0549999475479126f), vec3<f32>(0.0f)), vec3<f32>(2.40000009536743164f));
    var _S1 : f32;
    if((srgb_0.x) <= 0.04044999927282333f)
    {
        _S1 = low_0.x;
    }
    else
    {
        _S1 = high_0.x;
    }
    var _S2 : f32;
    if((srgb_0.y) <= 0.04044999927282333f)
    {
        _S2 = low_0.y;
    }
    else
    {
        _S2 = high_0.y;
    }
    var _S3 : f32;
    if((srgb_0.z) <= 0.04044999927282333f)
    {
        _S3 = low_0.z;
    }
    else
    {
        _S3 = high_0.z;
    }
    return vec3<f32>(_S1, _S2, _S3);
}

struct pixelOutput_0
{
    @location(0) output_0 : vec4<f32>,
};

@fragment
fn composite_pixel(@builtin(position) position_0 : vec4<f32>) -> pixelOutput_0
{
    var y_0 : f32;
    if((CompositeConstants_0.flip_rows_0) != 0.0f)
    {
        y_0 = CompositeConstants_0.image_size_0.y - position_0.y;
    }
    else
    {
        y_0 = position_0.y;
    }
    var _S4 : vec3<i32> = vec3<i32>(i32(position_0.x), i32(y_0), i32(0));
    var colour_0 : vec4<f32> = (textureLoad((Accumulated_0), ((_S4)).xy, ((_S4)).z));
    var _S5 : f32 = colour_0.w;
    var left_0 : f32 = 1.0f - _S5;
    var alpha_0 : f32 = _S5 + left_0 * CompositeConstants_0.background_0.w;
    var display_0 : vec3<f32> = colour_0.xyz + vec3<f32>((left_0 * CompositeConstants_0.background_0.w)) * CompositeConstants_0.background_0.xyz;
    var display_1 : vec3<f32>;
    if((CompositeConstants_0.linear_target_0) != 0.0f)
    {
        if(alpha_0 > 0.0f)
        {
            display_1 = display_0 / vec3<f32>(alpha_0);
        }
        else
        {
            display_1 = display_0;
        }
        display_1 = linear_from_display_0(display_1) * vec3<f32>(alpha_0);
    }
    else
    {
        display_1 = display_0;
    }
    var _S6 : pixelOutput_0 = pixelOutput_0( vec4<f32>(display_1, alpha_0) );
    return _S6;
}

