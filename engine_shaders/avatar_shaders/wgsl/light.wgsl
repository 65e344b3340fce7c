// Generated from hlsl/light.hlsl, entry light, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_LightConstants_std140_0
{
    @align(16) count_0 : u32,
    @align(4) normal_0 : u32,
    @align(8) normal_width_0 : u32,
    @align(4) normal_scale_0 : u32,
    @align(16) turn_row0_0 : vec4<f32>,
    @align(16) turn_row1_0 : vec4<f32>,
    @align(16) turn_row2_0 : vec4<f32>,
    @align(16) capture_ambient0_0 : vec4<f32>,
    @align(16) capture_ambient1_0 : vec4<f32>,
    @align(16) capture_ambient2_0 : vec4<f32>,
    @align(16) capture_ambient3_0 : vec4<f32>,
    @align(16) capture_ambient4_0 : vec4<f32>,
    @align(16) capture_ambient5_0 : vec4<f32>,
    @align(16) capture_ambient6_0 : vec4<f32>,
    @align(16) capture_ambient7_0 : vec4<f32>,
    @align(16) capture_ambient8_0 : vec4<f32>,
    @align(16) scene_ambient0_0 : vec4<f32>,
    @align(16) scene_ambient1_0 : vec4<f32>,
    @align(16) scene_ambient2_0 : vec4<f32>,
    @align(16) scene_ambient3_0 : vec4<f32>,
    @align(16) scene_ambient4_0 : vec4<f32>,
    @align(16) scene_ambient5_0 : vec4<f32>,
    @align(16) scene_ambient6_0 : vec4<f32>,
    @align(16) scene_ambient7_0 : vec4<f32>,
    @align(16) scene_ambient8_0 : vec4<f32>,
    @align(16) place0_0 : vec4<f32>,
    @align(16) place1_0 : vec4<f32>,
    @align(16) place2_0 : vec4<f32>,
    @align(16) place3_0 : vec4<f32>,
    @align(16) colour0_0 : vec4<f32>,
    @align(16) colour1_0 : vec4<f32>,
    @align(16) colour2_0 : vec4<f32>,
    @align(16) colour3_0 : vec4<f32>,
    @align(16) shadow_row0_0 : vec4<f32>,
    @align(16) shadow_row1_0 : vec4<f32>,
    @align(16) shadow_row2_0 : vec4<f32>,
    @align(16) shadow_row3_0 : vec4<f32>,
    @align(16) shadow_offset_0 : vec4<f32>,
    @align(16) turned_0 : u32,
};

@binding(8) @group(0) var<uniform> LightConstants_0 : SLANG_ParameterGroup_LightConstants_std140_0;
@binding(3) @group(0) var<storage, read_write> Projected_0 : array<vec4<f32>>;

@binding(1) @group(0) var<storage, read> Splats_0 : array<vec4<f32>>;

@binding(0) @group(0) var<storage, read> LightStatic_0 : array<u32>;

@binding(2) @group(0) var<storage, read> Shadow_0 : array<u32>;

fn packed_element_0( word_0 : u32,  bit_0 : u32,  width_0 : u32) -> u32
{
    return (((word_0 >> (((bit_0 & (u32(31))))))) & ((((u32(1) << (width_0))) - u32(1))));
}

fn light_code_0( section_0 : u32,  index_0 : u32,  width_1 : u32) -> u32
{
    if(width_1 == u32(32))
    {
        return LightStatic_0[section_0 + index_0];
    }
    var bit_1 : u32 = index_0 * width_1;
    return packed_element_0(LightStatic_0[section_0 + ((bit_1 >> (u32(5))))], bit_1, width_1);
}

fn light_linear_0( section_1 : u32,  index_1 : u32,  width_2 : u32,  scale_0 : u32) -> f32
{
    var code_0 : u32 = light_code_0(section_1, index_1, width_2);
    if(width_2 == u32(32))
    {
        return (bitcast<f32>((code_0)));
    }
    return (bitcast<f32>((LightStatic_0[scale_0]))) + (bitcast<f32>((LightStatic_0[scale_0 + u32(1)]))) * f32(code_0);
}

fn light_linear3_0( section_2 : u32,  index_2 : u32,  stride_0 : u32,  width_3 : u32,  scale_1 : u32) -> vec3<f32>
{
    return vec3<f32>(light_linear_0(section_2, index_2, width_3, scale_1), light_linear_0(section_2, index_2 + stride_0, width_3, scale_1 + u32(2)), light_linear_0(section_2, index_2 + u32(2) * stride_0, width_3, scale_1 + u32(4)));
}

struct Rows3_0
{
     row0_0 : vec3<f32>,
     row1_0 : vec3<f32>,
     row2_0 : vec3<f32>,
};

fn matrix_from_quat_0( q_0 : vec4<f32>) -> Rows3_0
{
    var w_0 : f32 = q_0.x;
    var x_0 : f32 = q_0.y;
    var y_0 : f32 = q_0.z;
    var z_0 : f32 = q_0.w;
    var r_0 : Rows3_0;
    var _S1 : f32 = y_0 * y_0;
    var _S2 : f32 = z_0 * z_0;
    var _S3 : f32 = x_0 * y_0;
    var _S4 : f32 = w_0 * z_0;
    var _S5 : f32 = x_0 * z_0;
    var _S6 : f32 = w_0 * y_0;
    r_0.row0_0 = vec3<f32>(1.0f - 2.0f * (_S1 + _S2), 2.0f * (_S3 - _S4), 2.0f * (_S5 + _S6));
    var _S7 : f32 = x_0 * x_0;
    var _S8 : f32 = y_0 * z_0;
    var _S9 : f32 = w_0 * x_0;
    r_0.row1_0 = vec3<f32>(2.0f * (_S3 + _S4), 1.0f - 2.0f * (_S7 + _S2), 2.0f * (_S8 - _S9));
    r_0.row2_0 = vec3<f32>(2.0f * (_S5 - _S6), 2.0f * (_S8 + _S9), 1.0f - 2.0f * (_S7 + _S1));
    return r_0;
}

fn rotate_0( m_0 : Rows3_0,  v_0 : vec3<f32>) -> vec3<f32>
{
    return vec3<f32>(dot(m_0.row0_0, v_0), dot(m_0.row1_0, v_0), dot(m_0.row2_0, v_0));
}

fn sh_band0_0( k0_0 : vec3<f32>) -> vec3<f32>
{
    return vec3<f32>(0.282094806432724f) * k0_0;
}

fn sh_band1_0( d_0 : vec3<f32>,  k1_0 : vec3<f32>,  k2_0 : vec3<f32>,  k3_0 : vec3<f32>) -> vec3<f32>
{
    return vec3<f32>((-0.48860251903533936f * d_0.y)) * k1_0 + vec3<f32>((0.48860251903533936f * d_0.z)) * k2_0 + vec3<f32>((-0.48860251903533936f * d_0.x)) * k3_0;
}

fn sh_band2_0( d_1 : vec3<f32>,  k4_0 : vec3<f32>,  k5_0 : vec3<f32>,  k6_0 : vec3<f32>,  k7_0 : vec3<f32>,  k8_0 : vec3<f32>) -> vec3<f32>
{
    var _S10 : f32 = d_1.x;
    var xx_0 : f32 = _S10 * _S10;
    var _S11 : f32 = d_1.y;
    var yy_0 : f32 = _S11 * _S11;
    var _S12 : f32 = d_1.z;
    return vec3<f32>((1.09254848957061768f * (_S10 * _S11))) * k4_0 + vec3<f32>((-1.09254848957061768f * (_S11 * _S12))) * k5_0 + vec3<f32>((0.31539157032966614f * (2.0f * (_S12 * _S12) - xx_0 - yy_0))) * k6_0 + vec3<f32>((-1.09254848957061768f * (_S10 * _S12))) * k7_0 + vec3<f32>((0.54627424478530884f * (xx_0 - yy_0))) * k8_0;
}

fn light_ambient_0( n_0 : vec3<f32>,  a0_0 : vec3<f32>,  a1_0 : vec3<f32>,  a2_0 : vec3<f32>,  a3_0 : vec3<f32>,  a4_0 : vec3<f32>,  a5_0 : vec3<f32>,  a6_0 : vec3<f32>,  a7_0 : vec3<f32>,  a8_0 : vec3<f32>) -> vec3<f32>
{
    return sh_band0_0(a0_0) + sh_band1_0(n_0, a1_0, a2_0, a3_0) + sh_band2_0(n_0, a4_0, a5_0, a6_0, a7_0, a8_0);
}

fn light_direct_0( n_1 : vec3<f32>,  x_1 : vec3<f32>,  place_0 : vec4<f32>,  colour_0 : vec3<f32>) -> vec3<f32>
{
    var _S13 : f32 = place_0.w;
    var to_0 : vec3<f32> = place_0.xyz - vec3<f32>(_S13) * x_1;
    var squared_0 : f32 = dot(to_0, to_0);
    var _S14 : f32 = max(dot(n_1, to_0) / sqrt(max(squared_0, 1.00000000317107685e-30f)), 0.0f);
    var _S15 : f32;
    if(_S13 != 0.0f)
    {
        _S15 = _S14 / max(squared_0, 0.00009999999747379f);
    }
    else
    {
        _S15 = _S14;
    }
    return colour_0 * vec3<f32>(_S15);
}

struct ShadowPoint_0
{
     texel_0 : vec2<f32>,
     distance_0 : f32,
     scale_2 : f32,
};

fn shadow_point_0( x_2 : vec3<f32>,  row0_1 : vec4<f32>,  row1_1 : vec4<f32>,  row2_1 : vec4<f32>,  row3_0 : vec4<f32>) -> ShadowPoint_0
{
    var at_0 : vec4<f32> = vec4<f32>(x_2, 1.0f);
    var p_0 : ShadowPoint_0;
    var _S16 : f32 = 1.0f / dot(row3_0, at_0);
    p_0.scale_2 = _S16;
    p_0.texel_0 = vec2<f32>(dot(row0_1, at_0), dot(row1_1, at_0)) * vec2<f32>(_S16);
    p_0.distance_0 = dot(row2_1, at_0);
    return p_0;
}

fn shadow_weight_0( i_0 : u32,  part_0 : f32) -> f32
{
    var _S17 : f32;
    if(i_0 == u32(0))
    {
        _S17 = 1.0f - part_0;
    }
    else
    {
        if(i_0 == u32(3))
        {
            _S17 = part_0;
        }
        else
        {
            _S17 = 1.0f;
        }
    }
    return _S17 / 3.0f;
}

fn light_seen_0( x_3 : vec3<f32>,  n_2 : vec3<f32>) -> f32
{
    if((LightConstants_0.shadow_offset_0.z) == 0.0f)
    {
        return 1.0f;
    }
    var p_1 : ShadowPoint_0 = shadow_point_0(x_3 + n_2 * vec3<f32>(LightConstants_0.shadow_offset_0.x), LightConstants_0.shadow_row0_0, LightConstants_0.shadow_row1_0, LightConstants_0.shadow_row2_0, LightConstants_0.shadow_row3_0);
    var first_0 : vec2<f32> = floor(p_1.texel_0);
    var _S18 : vec2<f32> = p_1.texel_0 - first_0;
    var i_1 : u32 = u32(0);
    var seen_0 : f32 = 0.0f;
    for(;;)
    {
        if(i_1 < u32(16))
        {
        }
        else
        {
            break;
        }
        var _S19 : u32 = i_1 % u32(4);
        var at_1 : vec2<f32> = first_0 + vec2<f32>(f32(_S19), f32(i_1 / u32(4))) - vec2<f32>(1.0f);
        var _S20 : f32 = at_1.x;
        var _S21 : bool;
        if(_S20 >= 0.0f)
        {
            _S21 = (at_1.y) >= 0.0f;
        }
        else
        {
            _S21 = false;
        }
        var _S22 : bool;
        if(_S21)
        {
            _S22 = _S20 <= 255.0f;
        }
        else
        {
            _S22 = false;
        }
        var inside_0 : bool;
        if(_S22)
        {
            inside_0 = (at_1.y) <= 255.0f;
        }
        else
        {
            inside_0 = false;
        }
        var texel_1 : u32;
        if(inside_0)
        {
            texel_1 = u32(at_1.y) * u32(256) + u32(_S20);
        }
        else
        {
            texel_1 = u32(0);
        }
        var lit_0 : bool;
        if(!inside_0)
        {
            lit_0 = true;
        }
        else
        {
            lit_0 = (bitcast<f32>((Shadow_0[texel_1]))) >= (p_1.distance_0 - LightConstants_0.shadow_offset_0.y);
        }
        var _S23 : f32;
        if(lit_0)
        {
            _S23 = shadow_weight_0(_S19, _S18.x) * shadow_weight_0(i_1 / u32(4), _S18.y);
        }
        else
        {
            _S23 = 0.0f;
        }
        var seen_1 : f32 = seen_0 + _S23;
        i_1 = i_1 + u32(1);
        seen_0 = seen_1;
    }
    return seen_0;
}

fn light_scene_0( n_3 : vec3<f32>,  x_4 : vec3<f32>) -> vec3<f32>
{
    return light_ambient_0(n_3, LightConstants_0.scene_ambient0_0.xyz, LightConstants_0.scene_ambient1_0.xyz, LightConstants_0.scene_ambient2_0.xyz, LightConstants_0.scene_ambient3_0.xyz, LightConstants_0.scene_ambient4_0.xyz, LightConstants_0.scene_ambient5_0.xyz, LightConstants_0.scene_ambient6_0.xyz, LightConstants_0.scene_ambient7_0.xyz, LightConstants_0.scene_ambient8_0.xyz) + light_direct_0(n_3, x_4, LightConstants_0.place0_0, LightConstants_0.colour0_0.xyz) * vec3<f32>(light_seen_0(x_4, n_3)) + light_direct_0(n_3, x_4, LightConstants_0.place1_0, LightConstants_0.colour1_0.xyz) + light_direct_0(n_3, x_4, LightConstants_0.place2_0, LightConstants_0.colour2_0.xyz) + light_direct_0(n_3, x_4, LightConstants_0.place3_0, LightConstants_0.colour3_0.xyz);
}

fn light_power_0( x_5 : f32,  exponent_0 : f32) -> f32
{
    var _S24 : f32;
    if(x_5 > 0.0f)
    {
        _S24 = exp(exponent_0 * log(x_5));
    }
    else
    {
        _S24 = 0.0f;
    }
    return _S24;
}

fn light_channel_0( display_0 : f32,  ratio_0 : f32) -> f32
{
    var _S25 : f32;
    if(display_0 > 0.04044999927282333f)
    {
        var raised_0 : f32 = (display_0 + 0.05499999970197678f) * light_power_0(ratio_0, 0.4166666567325592f);
        if(raised_0 > 0.09544999897480011f)
        {
            _S25 = raised_0 - 0.05499999970197678f;
        }
        else
        {
            _S25 = 12.92000007629394531f * light_power_0(raised_0 / 1.0549999475479126f, 2.40000009536743164f);
        }
        return _S25;
    }
    var lit_1 : f32 = display_0 / 12.92000007629394531f * ratio_0;
    if(lit_1 <= 0.00313080009073019f)
    {
        _S25 = 12.92000007629394531f * lit_1;
    }
    else
    {
        _S25 = 1.0549999475479126f * light_power_0(lit_1, 0.4166666567325592f) - 0.05499999970197678f;
    }
    return _S25;
}

fn light_colour_0( display_1 : vec3<f32>,  scene_0 : vec3<f32>,  capture_0 : vec3<f32>) -> vec3<f32>
{
    var ratio_1 : vec3<f32> = max(scene_0, vec3<f32>(0.0f)) / max(capture_0, vec3<f32>(0.05000000074505806f));
    var _S26 : f32 = ratio_1.x;
    var _S27 : bool;
    if(_S26 == 1.0f)
    {
        _S27 = (ratio_1.y) == 1.0f;
    }
    else
    {
        _S27 = false;
    }
    if(_S27)
    {
        _S27 = (ratio_1.z) == 1.0f;
    }
    else
    {
        _S27 = false;
    }
    if(_S27)
    {
        return display_1;
    }
    return vec3<f32>(light_channel_0(display_1.x, _S26), light_channel_0(display_1.y, ratio_1.y), light_channel_0(display_1.z, ratio_1.z));
}

@compute
@workgroup_size(64, 1, 1)
fn light(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_0 : u32 = id_0.x;
    var _S28 : bool;
    if(row_0 >= (LightConstants_0.count_0))
    {
        _S28 = true;
    }
    else
    {
        _S28 = !((Projected_0[LightConstants_0.count_0 + row_0].w) > 0.0f);
    }
    if(_S28)
    {
        return;
    }
    var n_4 : vec3<f32>;
    if((LightConstants_0.turned_0) != u32(0))
    {
        n_4 = Splats_0[u32(5) * LightConstants_0.count_0 + row_0].xyz;
    }
    else
    {
        n_4 = rotate_0(matrix_from_quat_0(Splats_0[LightConstants_0.count_0 + row_0]), light_linear3_0(LightConstants_0.normal_0, row_0, LightConstants_0.count_0, LightConstants_0.normal_width_0, LightConstants_0.normal_scale_0));
    }
    var n_5 : vec3<f32> = n_4 / vec3<f32>(max(length(n_4), 1.00000000317107685e-30f));
    Projected_0[u32(2) * LightConstants_0.count_0 + row_0] = vec4<f32>(light_colour_0(Projected_0[u32(2) * LightConstants_0.count_0 + row_0].xyz, light_scene_0(n_5, Splats_0[row_0].xyz), light_ambient_0(vec3<f32>(dot(LightConstants_0.turn_row0_0.xyz, n_5), dot(LightConstants_0.turn_row1_0.xyz, n_5), dot(LightConstants_0.turn_row2_0.xyz, n_5)), LightConstants_0.capture_ambient0_0.xyz, LightConstants_0.capture_ambient1_0.xyz, LightConstants_0.capture_ambient2_0.xyz, LightConstants_0.capture_ambient3_0.xyz, LightConstants_0.capture_ambient4_0.xyz, LightConstants_0.capture_ambient5_0.xyz, LightConstants_0.capture_ambient6_0.xyz, LightConstants_0.capture_ambient7_0.xyz, LightConstants_0.capture_ambient8_0.xyz)), Projected_0[u32(2) * LightConstants_0.count_0 + row_0].w);
    return;
}

