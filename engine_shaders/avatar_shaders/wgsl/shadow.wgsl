// Generated from hlsl/shadow.hlsl, entry shadow, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_ShadowConstants_std140_0
{
    @align(16) shadow_row0_0 : vec4<f32>,
    @align(16) shadow_row1_0 : vec4<f32>,
    @align(16) shadow_row2_0 : vec4<f32>,
    @align(16) shadow_row3_0 : vec4<f32>,
    @align(16) count_0 : u32,
};

@binding(8) @group(0) var<uniform> ShadowConstants_0 : SLANG_ParameterGroup_ShadowConstants_std140_0;
@binding(0) @group(0) var<storage, read> Splats_0 : array<vec4<f32>>;

@binding(1) @group(0) var<storage, read_write> Shadow_0 : array<atomic<u32>>;

struct ShadowPoint_0
{
     texel_0 : vec2<f32>,
     distance_0 : f32,
     scale_0 : f32,
};

fn shadow_point_0( x_0 : vec3<f32>,  row0_0 : vec4<f32>,  row1_0 : vec4<f32>,  row2_0 : vec4<f32>,  row3_0 : vec4<f32>) -> ShadowPoint_0
{
    var at_0 : vec4<f32> = vec4<f32>(x_0, 1.0f);
    var p_0 : ShadowPoint_0;
    var _S1 : f32 = 1.0f / dot(row3_0, at_0);
    p_0.scale_0 = _S1;
    p_0.texel_0 = vec2<f32>(dot(row0_0, at_0), dot(row1_0, at_0)) * vec2<f32>(_S1);
    p_0.distance_0 = dot(row2_0, at_0);
    return p_0;
}

struct Rows3_0
{
     row0_1 : vec3<f32>,
     row1_1 : vec3<f32>,
     row2_1 : vec3<f32>,
};

fn matrix_from_quat_0( q_0 : vec4<f32>) -> Rows3_0
{
    var w_0 : f32 = q_0.x;
    var x_1 : f32 = q_0.y;
    var y_0 : f32 = q_0.z;
    var z_0 : f32 = q_0.w;
    var r_0 : Rows3_0;
    var _S2 : f32 = y_0 * y_0;
    var _S3 : f32 = z_0 * z_0;
    var _S4 : f32 = x_1 * y_0;
    var _S5 : f32 = w_0 * z_0;
    var _S6 : f32 = x_1 * z_0;
    var _S7 : f32 = w_0 * y_0;
    r_0.row0_1 = vec3<f32>(1.0f - 2.0f * (_S2 + _S3), 2.0f * (_S4 - _S5), 2.0f * (_S6 + _S7));
    var _S8 : f32 = x_1 * x_1;
    var _S9 : f32 = y_0 * z_0;
    var _S10 : f32 = w_0 * x_1;
    r_0.row1_1 = vec3<f32>(2.0f * (_S4 + _S5), 1.0f - 2.0f * (_S8 + _S3), 2.0f * (_S9 - _S10));
    r_0.row2_1 = vec3<f32>(2.0f * (_S6 - _S7), 2.0f * (_S9 + _S10), 1.0f - 2.0f * (_S8 + _S2));
    return r_0;
}

fn rotate_inverse_0( m_0 : Rows3_0,  v_0 : vec3<f32>) -> vec3<f32>
{
    return m_0.row0_1 * vec3<f32>(v_0.x) + m_0.row1_1 * vec3<f32>(v_0.y) + m_0.row2_1 * vec3<f32>(v_0.z);
}

@compute
@workgroup_size(64, 1, 1)
fn shadow(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_0 : u32 = id_0.x;
    if(row_0 >= (ShadowConstants_0.count_0))
    {
        return;
    }
    var mean_0 : vec4<f32> = Splats_0[row_0];
    var p_1 : ShadowPoint_0 = shadow_point_0(mean_0.xyz, ShadowConstants_0.shadow_row0_0, ShadowConstants_0.shadow_row1_0, ShadowConstants_0.shadow_row2_0, ShadowConstants_0.shadow_row3_0);
    var most_0 : f32 = 2.0f * log(max(mean_0.w, 1.00000000317107685e-30f) / 0.30000001192092896f);
    var _S11 : vec3<f32> = vec3<f32>(p_1.scale_0);
    var scale_1 : vec3<f32> = vec3<f32>(Splats_0[u32(2) * ShadowConstants_0.count_0 + row_0].w, Splats_0[u32(3) * ShadowConstants_0.count_0 + row_0].w, Splats_0[u32(4) * ShadowConstants_0.count_0 + row_0].w);
    var turn_0 : Rows3_0 = matrix_from_quat_0(Splats_0[ShadowConstants_0.count_0 + row_0]);
    var u_0 : vec3<f32> = rotate_inverse_0(turn_0, (ShadowConstants_0.shadow_row0_0.xyz - vec3<f32>(p_1.texel_0.x) * ShadowConstants_0.shadow_row3_0.xyz) * _S11) * scale_1;
    var v_1 : vec3<f32> = rotate_inverse_0(turn_0, (ShadowConstants_0.shadow_row1_0.xyz - vec3<f32>(p_1.texel_0.y) * ShadowConstants_0.shadow_row3_0.xyz) * _S11) * scale_1;
    var xx_0 : f32 = dot(u_0, u_0) + 0.25f;
    var xy_0 : f32 = dot(u_0, v_1);
    var yy_0 : f32 = dot(v_1, v_1) + 0.25f;
    var det_0 : f32 = xx_0 * yy_0 - xy_0 * xy_0;
    var _S12 : bool;
    if(!(most_0 > 0.0f))
    {
        _S12 = true;
    }
    else
    {
        _S12 = !((p_1.distance_0) > 0.0f);
    }
    if(_S12)
    {
        _S12 = true;
    }
    else
    {
        _S12 = !(det_0 > 0.0f);
    }
    if(_S12)
    {
        return;
    }
    var away_0 : vec3<f32> = rotate_inverse_0(turn_0, ShadowConstants_0.shadow_row2_0.xyz) * scale_1;
    var away_x_0 : f32 = dot(away_0, u_0);
    var away_y_0 : f32 = dot(away_0, v_1);
    var _S13 : vec2<f32> = vec2<f32>(yy_0 * away_x_0 - xy_0 * away_y_0, xx_0 * away_y_0 - xy_0 * away_x_0) / vec2<f32>(det_0);
    var reach_0 : vec2<f32> = min(sqrt(vec2<f32>(most_0) * vec2<f32>(xx_0, yy_0)), vec2<f32>(12.0f));
    var low_0 : vec2<f32> = clamp(ceil(p_1.texel_0 - reach_0), vec2<f32>(0.0f), vec2<f32>(256.0f));
    var _S14 : vec2<f32> = clamp(floor(p_1.texel_0 + reach_0), vec2<f32>(-1.0f), vec2<f32>(255.0f));
    var y_1 : f32 = low_0.y;
    for(;;)
    {
        if(y_1 <= (_S14.y))
        {
        }
        else
        {
            break;
        }
        var x_2 : f32 = low_0.x;
        for(;;)
        {
            if(x_2 <= (_S14.x))
            {
            }
            else
            {
                break;
            }
            var d_0 : vec2<f32> = vec2<f32>(x_2, y_1) - p_1.texel_0;
            var _S15 : f32 = d_0.x;
            var _S16 : f32 = d_0.y;
            if((_S15 * (yy_0 * _S15 - 2.0f * xy_0 * _S16) + xx_0 * _S16 * _S16) <= (most_0 * det_0))
            {
                var _S17 : u32 = atomicMin(&(Shadow_0[u32(y_1) * u32(256) + u32(x_2)]), (bitcast<u32>((max(p_1.distance_0 + dot(_S13, d_0), 0.0f)))));
            }
            x_2 = x_2 + 1.0f;
        }
        y_1 = y_1 + 1.0f;
    }
    return;
}

