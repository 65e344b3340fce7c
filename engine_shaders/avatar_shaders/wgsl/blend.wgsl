// Generated from hlsl/blend.hlsl, entry blend, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_BlendConstants_std140_0
{
    @align(16) count_0 : u32,
    @align(4) sh_terms_0 : u32,
    @align(8) weights_0 : u32,
    @align(4) base_mean_0 : u32,
    @align(16) base_mean_width_0 : u32,
    @align(4) base_mean_scale_0 : u32,
    @align(8) base_log_scale_0 : u32,
    @align(4) base_log_scale_width_0 : u32,
    @align(16) base_log_scale_scale_0 : u32,
    @align(4) base_quat_0 : u32,
    @align(8) base_quat_width_0 : u32,
    @align(4) base_quat_scale_0 : u32,
    @align(16) base_opacity_0 : u32,
    @align(4) base_opacity_width_0 : u32,
    @align(8) base_opacity_table_0 : u32,
    @align(4) base_sh_0 : u32,
    @align(16) base_sh_width_0 : u32,
    @align(4) base_sh_scale_0 : u32,
    @align(8) geometry_ptr_0 : u32,
    @align(4) geometry_column_0 : u32,
    @align(16) geometry_column_width_0 : u32,
    @align(4) geometry_mean_0 : u32,
    @align(8) geometry_mean_width_0 : u32,
    @align(4) geometry_mean_step_0 : u32,
    @align(16) geometry_quat_0 : u32,
    @align(4) geometry_quat_width_0 : u32,
    @align(8) geometry_quat_step_0 : u32,
    @align(4) appearance_ptr_0 : u32,
    @align(16) appearance_column_0 : u32,
    @align(4) appearance_column_width_0 : u32,
    @align(8) appearance_log_scale_0 : u32,
    @align(4) appearance_log_scale_width_0 : u32,
    @align(16) appearance_log_scale_step_0 : u32,
    @align(4) appearance_opacity_0 : u32,
    @align(8) appearance_opacity_width_0 : u32,
    @align(4) appearance_opacity_step_0 : u32,
    @align(16) appearance_sh_0 : u32,
    @align(4) appearance_sh_width_0 : u32,
    @align(8) appearance_sh_step_0 : u32,
    @align(4) unused_0 : u32,
};

@binding(8) @group(0) var<uniform> BlendConstants_0 : SLANG_ParameterGroup_BlendConstants_std140_0;
@binding(0) @group(0) var<storage, read> BlendStatic_0 : array<u32>;

@binding(1) @group(0) var<storage, read> Pose_0 : array<f32>;

@binding(2) @group(0) var<storage, read_write> Splats_0 : array<vec4<f32>>;

@binding(3) @group(0) var<storage, read_write> Sh_0 : array<f32>;

fn packed_element_0( word_0 : u32,  bit_0 : u32,  width_0 : u32) -> u32
{
    return (((word_0 >> (((bit_0 & (u32(31))))))) & ((((u32(1) << (width_0))) - u32(1))));
}

fn blend_code_0( section_0 : u32,  index_0 : u32,  width_1 : u32) -> u32
{
    if(width_1 == u32(32))
    {
        return BlendStatic_0[section_0 + index_0];
    }
    var bit_1 : u32 = index_0 * width_1;
    return packed_element_0(BlendStatic_0[section_0 + ((bit_1 >> (u32(5))))], bit_1, width_1);
}

fn blend_linear_0( section_1 : u32,  index_1 : u32,  width_2 : u32,  scale_0 : u32) -> f32
{
    var code_0 : u32 = blend_code_0(section_1, index_1, width_2);
    if(width_2 == u32(32))
    {
        return (bitcast<f32>((code_0)));
    }
    return (bitcast<f32>((BlendStatic_0[scale_0]))) + (bitcast<f32>((BlendStatic_0[scale_0 + u32(1)]))) * f32(code_0);
}

fn blend_linear3_0( section_2 : u32,  index_2 : u32,  stride_0 : u32,  width_3 : u32,  scale_1 : u32) -> vec3<f32>
{
    return vec3<f32>(blend_linear_0(section_2, index_2, width_3, scale_1), blend_linear_0(section_2, index_2 + stride_0, width_3, scale_1 + u32(2)), blend_linear_0(section_2, index_2 + u32(2) * stride_0, width_3, scale_1 + u32(4)));
}

fn packed_step_count_0( code_1 : u32,  width_4 : u32) -> f32
{
    return f32(code_1) - f32((u32(1) << ((width_4 - u32(1)))));
}

fn blend_signed_0( section_3 : u32,  index_3 : u32,  width_5 : u32,  step_0 : u32) -> f32
{
    if(width_5 == u32(0))
    {
        return 0.0f;
    }
    var code_2 : u32 = blend_code_0(section_3, index_3, width_5);
    if(width_5 == u32(32))
    {
        return (bitcast<f32>((code_2)));
    }
    return (bitcast<f32>((BlendStatic_0[step_0]))) * packed_step_count_0(code_2, width_5);
}

fn blend_signed3_0( section_4 : u32,  index_4 : u32,  width_6 : u32,  step_1 : u32) -> vec3<f32>
{
    return vec3<f32>(blend_signed_0(section_4, index_4, width_6, step_1), blend_signed_0(section_4, index_4 + u32(1), width_6, step_1 + u32(1)), blend_signed_0(section_4, index_4 + u32(2), width_6, step_1 + u32(2)));
}

struct BlendGeometry_0
{
     mean_0 : vec3<f32>,
     quat_wxyz_0 : vec4<f32>,
};

fn blend_geometry_0( g_0 : BlendGeometry_0,  weight_0 : f32,  mean_1 : vec3<f32>,  quat_wxyz_1 : vec4<f32>) -> BlendGeometry_0
{
    var _S1 : BlendGeometry_0 = g_0;
    _S1.mean_0 = _S1.mean_0 + vec3<f32>(weight_0) * mean_1;
    _S1.quat_wxyz_0 = _S1.quat_wxyz_0 + vec4<f32>(weight_0) * quat_wxyz_1;
    return _S1;
}

fn blended_geometry_0( row_0 : u32) -> BlendGeometry_0
{
    var g_1 : BlendGeometry_0;
    g_1.mean_0 = blend_linear3_0(BlendConstants_0.base_mean_0, row_0, BlendConstants_0.count_0, BlendConstants_0.base_mean_width_0, BlendConstants_0.base_mean_scale_0);
    g_1.quat_wxyz_0 = vec4<f32>(blend_linear_0(BlendConstants_0.base_quat_0, row_0, BlendConstants_0.base_quat_width_0, BlendConstants_0.base_quat_scale_0), blend_linear3_0(BlendConstants_0.base_quat_0, BlendConstants_0.count_0 + row_0, BlendConstants_0.count_0, BlendConstants_0.base_quat_width_0, BlendConstants_0.base_quat_scale_0 + u32(2)));
    var _S2 : u32 = BlendStatic_0[BlendConstants_0.geometry_ptr_0 + row_0 + u32(1)];
    var e_0 : u32 = BlendStatic_0[BlendConstants_0.geometry_ptr_0 + row_0];
    for(;;)
    {
        if(e_0 < _S2)
        {
        }
        else
        {
            break;
        }
        var column_0 : u32 = blend_code_0(BlendConstants_0.geometry_column_0, e_0, BlendConstants_0.geometry_column_width_0);
        var weight_1 : f32 = Pose_0[BlendConstants_0.weights_0 + column_0];
        if(weight_1 != 0.0f)
        {
            var step_2 : u32 = BlendConstants_0.geometry_quat_step_0 + u32(4) * column_0;
            var _S3 : u32 = u32(4) * e_0;
            g_1 = blend_geometry_0(g_1, weight_1, blend_signed3_0(BlendConstants_0.geometry_mean_0, u32(3) * e_0, BlendConstants_0.geometry_mean_width_0, BlendConstants_0.geometry_mean_step_0 + u32(3) * column_0), vec4<f32>(blend_signed_0(BlendConstants_0.geometry_quat_0, _S3, BlendConstants_0.geometry_quat_width_0, step_2), blend_signed3_0(BlendConstants_0.geometry_quat_0, _S3 + u32(1), BlendConstants_0.geometry_quat_width_0, step_2 + u32(1))));
        }
        e_0 = e_0 + u32(1);
    }
    return g_1;
}

fn blend_table_0( section_5 : u32,  index_5 : u32,  width_7 : u32,  table_0 : u32) -> f32
{
    var code_3 : u32 = blend_code_0(section_5, index_5, width_7);
    if(width_7 == u32(32))
    {
        return (bitcast<f32>((code_3)));
    }
    return (bitcast<f32>((BlendStatic_0[table_0 + code_3])));
}

struct BlendAppearance_0
{
     log_scale_0 : vec3<f32>,
     opacity_logit_0 : f32,
};

fn blend_appearance_0( a_0 : BlendAppearance_0,  weight_2 : f32,  log_scale_1 : vec3<f32>,  opacity_logit_1 : f32) -> BlendAppearance_0
{
    var _S4 : BlendAppearance_0 = a_0;
    _S4.log_scale_0 = _S4.log_scale_0 + vec3<f32>(weight_2) * log_scale_1;
    _S4.opacity_logit_0 = _S4.opacity_logit_0 + weight_2 * opacity_logit_1;
    return _S4;
}

fn blended_appearance_0( row_1 : u32) -> BlendAppearance_0
{
    var a_1 : BlendAppearance_0;
    a_1.log_scale_0 = blend_linear3_0(BlendConstants_0.base_log_scale_0, row_1, BlendConstants_0.count_0, BlendConstants_0.base_log_scale_width_0, BlendConstants_0.base_log_scale_scale_0);
    a_1.opacity_logit_0 = blend_table_0(BlendConstants_0.base_opacity_0, row_1, BlendConstants_0.base_opacity_width_0, BlendConstants_0.base_opacity_table_0);
    var _S5 : u32 = BlendStatic_0[BlendConstants_0.appearance_ptr_0 + row_1 + u32(1)];
    var e_1 : u32 = BlendStatic_0[BlendConstants_0.appearance_ptr_0 + row_1];
    for(;;)
    {
        if(e_1 < _S5)
        {
        }
        else
        {
            break;
        }
        var column_1 : u32 = blend_code_0(BlendConstants_0.appearance_column_0, e_1, BlendConstants_0.appearance_column_width_0);
        var weight_3 : f32 = Pose_0[BlendConstants_0.weights_0 + column_1];
        if(weight_3 != 0.0f)
        {
            a_1 = blend_appearance_0(a_1, weight_3, blend_signed3_0(BlendConstants_0.appearance_log_scale_0, u32(3) * e_1, BlendConstants_0.appearance_log_scale_width_0, BlendConstants_0.appearance_log_scale_step_0 + u32(3) * column_1), blend_signed_0(BlendConstants_0.appearance_opacity_0, e_1, BlendConstants_0.appearance_opacity_width_0, BlendConstants_0.appearance_opacity_step_0 + column_1));
        }
        e_1 = e_1 + u32(1);
    }
    return a_1;
}

fn blend_base_sh_0( t_0 : u32,  row_2 : u32) -> vec3<f32>
{
    return blend_linear3_0(BlendConstants_0.base_sh_0, t_0 * BlendConstants_0.count_0 + row_2, BlendConstants_0.count_0, BlendConstants_0.base_sh_width_0, BlendConstants_0.base_sh_scale_0 + u32(2) * t_0);
}

fn blend_sh_0( coefficient_0 : vec3<f32>,  weight_4 : f32,  delta_0 : vec3<f32>) -> vec3<f32>
{
    return coefficient_0 + vec3<f32>(weight_4) * delta_0;
}

fn blend_store_sh_0( k_0 : u32,  row_3 : u32,  coefficient_1 : vec3<f32>)
{
    if(k_0 < (BlendConstants_0.sh_terms_0))
    {
        var at_0 : u32 = u32(3) * k_0 * BlendConstants_0.count_0 + row_3;
        Sh_0[at_0] = coefficient_1.x;
        Sh_0[at_0 + BlendConstants_0.count_0] = coefficient_1.y;
        Sh_0[at_0 + u32(2) * BlendConstants_0.count_0] = coefficient_1.z;
    }
    return;
}

fn blend_sh_from_0( k_1 : u32,  row_4 : u32)
{
    var last_0 : u32 = BlendConstants_0.sh_terms_0 - u32(1);
    var _S6 : u32 = u32(3) * BlendConstants_0.sh_terms_0;
    var t0_0 : u32 = u32(3) * k_1;
    var _S7 : u32 = k_1 + u32(1);
    var t1_0 : u32 = u32(3) * min(_S7, last_0);
    var _S8 : u32 = k_1 + u32(2);
    var t2_0 : u32 = u32(3) * min(_S8, last_0);
    var _S9 : u32 = k_1 + u32(3);
    var t3_0 : u32 = u32(3) * min(_S9, last_0);
    var _S10 : vec3<f32> = blend_base_sh_0(t0_0, row_4);
    var _S11 : vec3<f32> = blend_base_sh_0(t1_0, row_4);
    var _S12 : vec3<f32> = blend_base_sh_0(t2_0, row_4);
    var _S13 : vec3<f32> = blend_base_sh_0(t3_0, row_4);
    var _S14 : u32 = BlendStatic_0[BlendConstants_0.appearance_ptr_0 + row_4 + u32(1)];
    var end_0 : u32;
    if((BlendConstants_0.appearance_sh_width_0) == u32(0))
    {
        end_0 = u32(0);
    }
    else
    {
        end_0 = _S14;
    }
    var _S15 : u32 = BlendStatic_0[BlendConstants_0.appearance_ptr_0 + row_4];
    var c0_0 : vec3<f32> = _S10;
    var c1_0 : vec3<f32> = _S11;
    var c2_0 : vec3<f32> = _S12;
    var c3_0 : vec3<f32> = _S13;
    var e_2 : u32 = _S15;
    for(;;)
    {
        if(e_2 < end_0)
        {
        }
        else
        {
            break;
        }
        var column_2 : u32 = blend_code_0(BlendConstants_0.appearance_column_0, e_2, BlendConstants_0.appearance_column_width_0);
        var weight_5 : f32 = Pose_0[BlendConstants_0.weights_0 + column_2];
        if(weight_5 != 0.0f)
        {
            var at_1 : u32 = _S6 * e_2;
            var step_3 : u32 = BlendConstants_0.appearance_sh_step_0 + _S6 * column_2;
            var _S16 : vec3<f32> = blend_sh_0(c1_0, weight_5, blend_signed3_0(BlendConstants_0.appearance_sh_0, at_1 + t1_0, BlendConstants_0.appearance_sh_width_0, step_3 + t1_0));
            var _S17 : vec3<f32> = blend_sh_0(c2_0, weight_5, blend_signed3_0(BlendConstants_0.appearance_sh_0, at_1 + t2_0, BlendConstants_0.appearance_sh_width_0, step_3 + t2_0));
            var _S18 : vec3<f32> = blend_sh_0(c3_0, weight_5, blend_signed3_0(BlendConstants_0.appearance_sh_0, at_1 + t3_0, BlendConstants_0.appearance_sh_width_0, step_3 + t3_0));
            c0_0 = blend_sh_0(c0_0, weight_5, blend_signed3_0(BlendConstants_0.appearance_sh_0, at_1 + t0_0, BlendConstants_0.appearance_sh_width_0, step_3 + t0_0));
            c1_0 = _S16;
            c2_0 = _S17;
            c3_0 = _S18;
        }
        e_2 = e_2 + u32(1);
    }
    blend_store_sh_0(k_1, row_4, c0_0);
    blend_store_sh_0(_S7, row_4, c1_0);
    blend_store_sh_0(_S8, row_4, c2_0);
    blend_store_sh_0(_S9, row_4, c3_0);
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn blend(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_5 : u32 = id_0.x;
    if(row_5 >= (BlendConstants_0.count_0))
    {
        return;
    }
    var g_2 : BlendGeometry_0 = blended_geometry_0(row_5);
    var a_2 : BlendAppearance_0 = blended_appearance_0(row_5);
    Splats_0[row_5] = vec4<f32>(g_2.mean_0, a_2.opacity_logit_0);
    Splats_0[BlendConstants_0.count_0 + row_5] = g_2.quat_wxyz_0;
    Splats_0[u32(2) * BlendConstants_0.count_0 + row_5] = vec4<f32>(1.0f, 0.0f, 0.0f, a_2.log_scale_0.x);
    Splats_0[u32(3) * BlendConstants_0.count_0 + row_5] = vec4<f32>(0.0f, 1.0f, 0.0f, a_2.log_scale_0.y);
    Splats_0[u32(4) * BlendConstants_0.count_0 + row_5] = vec4<f32>(0.0f, 0.0f, 1.0f, a_2.log_scale_0.z);
    var k_2 : u32 = u32(0);
    for(;;)
    {
        if(k_2 < (BlendConstants_0.sh_terms_0))
        {
        }
        else
        {
            break;
        }
        blend_sh_from_0(k_2, row_5);
        k_2 = k_2 + u32(4);
    }
    return;
}

