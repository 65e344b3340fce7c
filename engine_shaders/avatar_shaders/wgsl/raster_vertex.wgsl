// Generated from hlsl/raster.hlsl, entry raster_vertex, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_RasterConstants_std140_0
{
    @align(16) image_size_0 : vec2<f32>,
    @align(8) flip_y_0 : f32,
};

@binding(8) @group(0) var<uniform> RasterConstants_0 : SLANG_ParameterGroup_RasterConstants_std140_0;
fn splat_form_0( conic_0 : vec3<f32>,  opacity_0 : f32) -> vec4<f32>
{
    return vec4<f32>(-0.72134751081466675f * conic_0.x, -1.4426950216293335f * conic_0.y, -0.72134751081466675f * conic_0.z, log2(opacity_0 * 255.0f));
}

fn splat_corner_0( corner_0 : vec2<f32>,  centre_0 : vec2<f32>,  conic_1 : vec3<f32>,  most_0 : f32,  size_0 : vec2<f32>) -> vec2<f32>
{
    var reach_0 : f32 = 1.38629436492919922f * max(most_0, 0.0f);
    var _S1 : f32 = conic_1.x;
    var _S2 : f32 = conic_1.z;
    var _S3 : f32 = _S1 * _S2;
    var _S4 : f32 = conic_1.y;
    var _S5 : f32 = _S4 * _S4;
    var det_0 : f32 = _S3 - _S5 - 3.00000010611256585e-07f * (_S3 + _S5);
    if(!(det_0 > 0.0f))
    {
        var _S6 : vec2<f32> = vec2<f32>(0.5f);
        return (_S6 * corner_0 + _S6) * size_0 - _S6;
    }
    var half_gap_0 : f32 = 0.5f * (_S1 - _S2);
    var larger_0 : f32 = 0.5f * (_S1 + _S2) + sqrt(half_gap_0 * half_gap_0 + _S5);
    var axis_0 : vec2<f32>;
    if(half_gap_0 >= 0.0f)
    {
        axis_0 = vec2<f32>(larger_0 - _S2, _S4);
    }
    else
    {
        axis_0 = vec2<f32>(_S4, larger_0 - _S1);
    }
    var axis_length_0 : f32 = length(axis_0);
    if(axis_length_0 > 0.0f)
    {
        axis_0 = axis_0 / vec2<f32>(axis_length_0);
    }
    else
    {
        axis_0 = vec2<f32>(1.0f, 0.0f);
    }
    var across_0 : f32 = min(sqrt(reach_0 / larger_0), 1.0e+06f) + 0.125f;
    var along_0 : f32 = min(sqrt(reach_0 * larger_0 / det_0), 1.0e+06f) + 0.125f;
    var _S7 : vec2<f32>;
    if(along_0 < 8.0f)
    {
        if((corner_0.y) < 0.0f)
        {
            _S7 = vec2<f32>(1.73205077648162842f * corner_0.x, -1.0f);
        }
        else
        {
            _S7 = vec2<f32>(0.0f, 2.0f);
        }
    }
    else
    {
        _S7 = corner_0;
    }
    return centre_0 + vec2<f32>((_S7.x * across_0)) * axis_0 + vec2<f32>((_S7.y * along_0)) * vec2<f32>(- axis_0.y, axis_0.x);
}

fn clip_from_pixels_0( pixel_0 : vec2<f32>,  clip_depth_0 : f32,  size_1 : vec2<f32>,  flip_y_1 : f32) -> vec4<f32>
{
    var _S8 : vec2<f32> = vec2<f32>(1.0f);
    var ndc_0 : vec2<f32> = (vec2<f32>(2.0f) * pixel_0 + _S8) / size_1 - _S8;
    return vec4<f32>(ndc_0.x, - flip_y_1 * ndc_0.y, clip_depth_0, 1.0f);
}

struct QuadFragment_0
{
    @builtin(position) position_0 : vec4<f32>,
    @interpolate(flat) @location(0) centre_1 : vec2<f32>,
    @interpolate(flat) @location(1) form_0 : vec4<f32>,
    @interpolate(flat) @location(2) rgb_0 : vec3<f32>,
};

fn quad_vertex_0( vertex_0 : u32,  place_0 : vec4<f32>,  conic_2 : vec3<f32>,  rgb_1 : vec3<f32>) -> QuadFragment_0
{
    var q_0 : QuadFragment_0;
    var _S9 : vec2<f32> = place_0.xy;
    q_0.centre_1 = _S9 + vec2<f32>(0.5f);
    var _S10 : vec4<f32> = splat_form_0(conic_2, place_0.w);
    q_0.form_0 = _S10;
    q_0.rgb_0 = rgb_1;
    q_0.position_0 = vec4<f32>(2.0f, 2.0f, 0.0f, 1.0f);
    if((_S10.w) >= 0.0f)
    {
        var _S11 : i32;
        if(((vertex_0 & (u32(1)))) != u32(0))
        {
            _S11 = i32(1);
        }
        else
        {
            _S11 = i32(-1);
        }
        var _S12 : f32 = f32(_S11);
        if(((vertex_0 & (u32(2)))) != u32(0))
        {
            _S11 = i32(1);
        }
        else
        {
            _S11 = i32(-1);
        }
        q_0.position_0 = clip_from_pixels_0(splat_corner_0(vec2<f32>(_S12, f32(_S11)), _S9, conic_2, q_0.form_0.w, RasterConstants_0.image_size_0), place_0.z, RasterConstants_0.image_size_0, RasterConstants_0.flip_y_0);
    }
    return q_0;
}

struct vertexInput_0
{
    @location(0) quad0_0 : vec4<f32>,
    @location(1) quad1_0 : vec4<f32>,
    @location(2) quad2_0 : vec4<f32>,
};

@vertex
fn raster_vertex( _S13 : vertexInput_0, @builtin(vertex_index) vertex_1 : u32) -> QuadFragment_0
{
    return quad_vertex_0(vertex_1, _S13.quad0_0, _S13.quad1_0.xyz, _S13.quad2_0.xyz);
}

