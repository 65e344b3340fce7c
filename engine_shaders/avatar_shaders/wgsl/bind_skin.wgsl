// Generated from hlsl/bind_skin.hlsl, entry bind_skin, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_BindSkinConstants_std140_0
{
    @align(16) count_0 : u32,
    @align(4) first_0 : u32,
    @align(8) rows_0 : u32,
    @align(4) corrective_ptr_0 : u32,
    @align(16) corrective_column_0 : u32,
    @align(4) corrective_column_width_0 : u32,
    @align(8) corrective_mean_0 : u32,
    @align(4) corrective_mean_width_0 : u32,
    @align(16) corrective_mean_step_0 : u32,
    @align(4) late_ptr_0 : u32,
    @align(8) late_column_0 : u32,
    @align(4) late_column_width_0 : u32,
    @align(16) late_mean_0 : u32,
    @align(4) late_mean_width_0 : u32,
    @align(8) late_mean_step_0 : u32,
    @align(4) skin_ptr_0 : u32,
    @align(16) skin_column_0 : u32,
    @align(4) skin_column_width_0 : u32,
    @align(8) skin_weight_0 : u32,
    @align(4) skin_weight_width_0 : u32,
    @align(16) skin_weight_step_0 : u32,
    @align(4) features_0 : u32,
    @align(8) late_0 : u32,
    @align(4) joints_0 : u32,
    @align(16) binding_rule_0 : u32,
    @align(4) rotation_rule_0 : u32,
    @align(8) sh_direction_0 : u32,
    @align(4) unused_0 : u32,
    @align(16) group_matrix_row0_0 : vec4<f32>,
    @align(16) group_matrix_row1_0 : vec4<f32>,
    @align(16) group_matrix_row2_0 : vec4<f32>,
    @align(16) group_rotation_row0_0 : vec4<f32>,
    @align(16) group_rotation_row1_0 : vec4<f32>,
    @align(16) group_rotation_row2_0 : vec4<f32>,
    @align(16) world_row0_0 : vec4<f32>,
    @align(16) world_row1_0 : vec4<f32>,
    @align(16) world_row2_0 : vec4<f32>,
    @align(16) world_quat_wxyz_0 : vec4<f32>,
};

@binding(8) @group(0) var<uniform> BindSkinConstants_0 : SLANG_ParameterGroup_BindSkinConstants_std140_0;
@binding(0) @group(0) var<storage, read> BindStatic_0 : array<u32>;

@binding(1) @group(0) var<storage, read> Pose_0 : array<f32>;

@binding(2) @group(0) var<storage, read_write> Splats_0 : array<vec4<f32>>;

struct Rows4_0
{
     row0_0 : vec4<f32>,
     row1_0 : vec4<f32>,
     row2_0 : vec4<f32>,
};

fn skin_none_0() -> Rows4_0
{
    var sum_0 : Rows4_0;
    const _S1 : vec4<f32> = vec4<f32>(0.0f, 0.0f, 0.0f, 0.0f);
    sum_0.row0_0 = _S1;
    sum_0.row1_0 = _S1;
    sum_0.row2_0 = _S1;
    return sum_0;
}

fn packed_element_0( word_0 : u32,  bit_0 : u32,  width_0 : u32) -> u32
{
    return (((word_0 >> (((bit_0 & (u32(31))))))) & ((((u32(1) << (width_0))) - u32(1))));
}

fn bind_code_0( section_0 : u32,  index_0 : u32,  width_1 : u32) -> u32
{
    if(width_1 == u32(32))
    {
        return BindStatic_0[section_0 + index_0];
    }
    var bit_1 : u32 = index_0 * width_1;
    return packed_element_0(BindStatic_0[section_0 + ((bit_1 >> (u32(5))))], bit_1, width_1);
}

fn bind_weight_0( section_1 : u32,  index_1 : u32,  width_2 : u32,  step_0 : u32) -> f32
{
    var code_0 : u32 = bind_code_0(section_1, index_1, width_2);
    if(width_2 == u32(32))
    {
        return (bitcast<f32>((code_0)));
    }
    return (bitcast<f32>((BindStatic_0[step_0]))) * f32(code_0);
}

fn skin_add_0( sum_1 : Rows4_0,  weight_0 : f32,  joint_0 : Rows4_0) -> Rows4_0
{
    var _S2 : Rows4_0 = sum_1;
    var _S3 : vec4<f32> = vec4<f32>(weight_0);
    _S2.row0_0 = _S2.row0_0 + _S3 * joint_0.row0_0;
    _S2.row1_0 = _S2.row1_0 + _S3 * joint_0.row1_0;
    _S2.row2_0 = _S2.row2_0 + _S3 * joint_0.row2_0;
    return _S2;
}

fn bind_skin_matrix_0( row_0 : u32) -> Rows4_0
{
    var _S4 : u32 = BindStatic_0[BindSkinConstants_0.skin_ptr_0 + row_0 + u32(1)];
    var _S5 : u32 = BindStatic_0[BindSkinConstants_0.skin_ptr_0 + row_0];
    var blended_0 : Rows4_0 = skin_none_0();
    var e_0 : u32 = _S5;
    for(;;)
    {
        if(e_0 < _S4)
        {
        }
        else
        {
            break;
        }
        var at_0 : u32 = BindSkinConstants_0.joints_0 + u32(12) * bind_code_0(BindSkinConstants_0.skin_column_0, e_0, BindSkinConstants_0.skin_column_width_0);
        var m_0 : Rows4_0;
        m_0.row0_0 = vec4<f32>(Pose_0[at_0], Pose_0[at_0 + u32(1)], Pose_0[at_0 + u32(2)], Pose_0[at_0 + u32(3)]);
        m_0.row1_0 = vec4<f32>(Pose_0[at_0 + u32(4)], Pose_0[at_0 + u32(5)], Pose_0[at_0 + u32(6)], Pose_0[at_0 + u32(7)]);
        m_0.row2_0 = vec4<f32>(Pose_0[at_0 + u32(8)], Pose_0[at_0 + u32(9)], Pose_0[at_0 + u32(10)], Pose_0[at_0 + u32(11)]);
        var _S6 : Rows4_0 = skin_add_0(blended_0, bind_weight_0(BindSkinConstants_0.skin_weight_0, e_0, BindSkinConstants_0.skin_weight_width_0, BindSkinConstants_0.skin_weight_step_0), m_0);
        var e_1 : u32 = e_0 + u32(1);
        blended_0 = _S6;
        e_0 = e_1;
    }
    return blended_0;
}

struct Rows3_0
{
     row0_1 : vec3<f32>,
     row1_1 : vec3<f32>,
     row2_1 : vec3<f32>,
};

fn linear_part_0( m_1 : Rows4_0) -> Rows3_0
{
    var r_0 : Rows3_0;
    r_0.row0_1 = m_1.row0_0.xyz;
    r_0.row1_1 = m_1.row1_0.xyz;
    r_0.row2_1 = m_1.row2_0.xyz;
    return r_0;
}

fn polar_0( m_2 : Rows3_0) -> Rows3_0
{
    var _S7 : Rows3_0 = m_2;
    var step_1 : i32 = i32(0);
    for(;;)
    {
        if(step_1 < i32(3))
        {
        }
        else
        {
            break;
        }
        var c0_0 : vec3<f32> = cross(_S7.row1_1, _S7.row2_1);
        var c1_0 : vec3<f32> = cross(_S7.row2_1, _S7.row0_1);
        var c2_0 : vec3<f32> = cross(_S7.row0_1, _S7.row1_1);
        var _S8 : vec3<f32> = vec3<f32>(dot(_S7.row0_1, c0_0));
        var _S9 : vec3<f32> = vec3<f32>(0.5f);
        _S7.row0_1 = (_S7.row0_1 + c0_0 / _S8) * _S9;
        _S7.row1_1 = (_S7.row1_1 + c1_0 / _S8) * _S9;
        _S7.row2_1 = (_S7.row2_1 + c2_0 / _S8) * _S9;
        step_1 = step_1 + i32(1);
    }
    return _S7;
}

fn packed_step_count_0( code_1 : u32,  width_3 : u32) -> f32
{
    return f32(code_1) - f32((u32(1) << ((width_3 - u32(1)))));
}

fn bind_signed_0( section_2 : u32,  index_2 : u32,  width_4 : u32,  step_2 : u32) -> f32
{
    if(width_4 == u32(0))
    {
        return 0.0f;
    }
    var code_2 : u32 = bind_code_0(section_2, index_2, width_4);
    if(width_4 == u32(32))
    {
        return (bitcast<f32>((code_2)));
    }
    return (bitcast<f32>((BindStatic_0[step_2]))) * packed_step_count_0(code_2, width_4);
}

fn bind_signed3_0( section_3 : u32,  index_3 : u32,  width_5 : u32,  step_3 : u32) -> vec3<f32>
{
    return vec3<f32>(bind_signed_0(section_3, index_3, width_5, step_3), bind_signed_0(section_3, index_3 + u32(1), width_5, step_3 + u32(1)), bind_signed_0(section_3, index_3 + u32(2), width_5, step_3 + u32(2)));
}

fn bind_corrected_0( mean_0 : vec3<f32>,  row_1 : u32) -> vec3<f32>
{
    var _S10 : u32 = BindStatic_0[BindSkinConstants_0.corrective_ptr_0 + row_1 + u32(1)];
    var e_2 : u32 = BindStatic_0[BindSkinConstants_0.corrective_ptr_0 + row_1];
    var _S11 : vec3<f32> = mean_0;
    for(;;)
    {
        if(e_2 < _S10)
        {
        }
        else
        {
            break;
        }
        var column_0 : u32 = bind_code_0(BindSkinConstants_0.corrective_column_0, e_2, BindSkinConstants_0.corrective_column_width_0);
        var _S12 : vec3<f32> = _S11 + vec3<f32>(Pose_0[BindSkinConstants_0.features_0 + column_0]) * bind_signed3_0(BindSkinConstants_0.corrective_mean_0, u32(3) * e_2, BindSkinConstants_0.corrective_mean_width_0, BindSkinConstants_0.corrective_mean_step_0 + u32(3) * column_0);
        e_2 = e_2 + u32(1);
        _S11 = _S12;
    }
    return _S11;
}

fn late_add_0( posed_0 : vec3<f32>,  weight_1 : f32,  delta_0 : vec3<f32>) -> vec3<f32>
{
    return posed_0 + vec3<f32>(weight_1) * delta_0;
}

fn bind_late_0( row_2 : u32) -> vec3<f32>
{
    var _S13 : u32 = BindStatic_0[BindSkinConstants_0.late_ptr_0 + row_2 + u32(1)];
    var _S14 : u32 = BindStatic_0[BindSkinConstants_0.late_ptr_0 + row_2];
    var sum_2 : vec3<f32> = vec3<f32>(0.0f, 0.0f, 0.0f);
    var e_3 : u32 = _S14;
    for(;;)
    {
        if(e_3 < _S13)
        {
        }
        else
        {
            break;
        }
        var column_1 : u32 = bind_code_0(BindSkinConstants_0.late_column_0, e_3, BindSkinConstants_0.late_column_width_0);
        var _S15 : vec3<f32> = late_add_0(sum_2, Pose_0[BindSkinConstants_0.late_0 + column_1], bind_signed3_0(BindSkinConstants_0.late_mean_0, u32(3) * e_3, BindSkinConstants_0.late_mean_width_0, BindSkinConstants_0.late_mean_step_0 + u32(3) * column_1));
        var e_4 : u32 = e_3 + u32(1);
        sum_2 = _S15;
        e_3 = e_4;
    }
    return sum_2;
}

fn transform_point_0( m_3 : Rows4_0,  p_0 : vec3<f32>) -> vec3<f32>
{
    var _S16 : f32 = p_0.x;
    var _S17 : f32 = p_0.y;
    var _S18 : f32 = p_0.z;
    return vec3<f32>(m_3.row0_0.x * _S16 + m_3.row0_0.y * _S17 + m_3.row0_0.z * _S18 + m_3.row0_0.w, m_3.row1_0.x * _S16 + m_3.row1_0.y * _S17 + m_3.row1_0.z * _S18 + m_3.row1_0.w, m_3.row2_0.x * _S16 + m_3.row2_0.y * _S17 + m_3.row2_0.z * _S18 + m_3.row2_0.w);
}

fn quat_from_matrix_0( m_4 : Rows3_0) -> vec4<f32>
{
    var d0_0 : f32 = m_4.row0_1.x;
    var d1_0 : f32 = m_4.row1_1.y;
    var d2_0 : f32 = m_4.row2_1.z;
    var _S19 : f32 = 1.0f + d0_0;
    var _S20 : f32 = 1.0f - d0_0;
    var size_0 : vec4<f32> = sqrt(max(vec4<f32>(_S19 + d1_0 + d2_0, _S19 - d1_0 - d2_0, _S20 + d1_0 - d2_0, _S20 - d1_0 + d2_0), vec4<f32>(0.0f)));
    var _S21 : f32 = m_4.row2_1.y;
    var _S22 : f32 = m_4.row1_1.z;
    var a_0 : f32 = _S21 - _S22;
    var _S23 : f32 = m_4.row0_1.z;
    var _S24 : f32 = m_4.row2_1.x;
    var b_0 : f32 = _S23 - _S24;
    var _S25 : f32 = m_4.row1_1.x;
    var _S26 : f32 = m_4.row0_1.y;
    var c_0 : f32 = _S25 - _S26;
    var d_0 : f32 = _S25 + _S26;
    var e_5 : f32 = _S23 + _S24;
    var f_0 : f32 = _S21 + _S22;
    var _S27 : f32 = size_0.x;
    var _S28 : f32 = size_0.y;
    var _S29 : bool;
    if(_S27 >= _S28)
    {
        _S29 = _S27 >= (size_0.z);
    }
    else
    {
        _S29 = false;
    }
    if(_S29)
    {
        _S29 = _S27 >= (size_0.w);
    }
    else
    {
        _S29 = false;
    }
    if(_S29)
    {
        return vec4<f32>(_S27 * _S27, a_0, b_0, c_0) / vec4<f32>((2.0f * _S27));
    }
    var _S30 : f32 = size_0.z;
    if(_S28 >= _S30)
    {
        _S29 = _S28 >= (size_0.w);
    }
    else
    {
        _S29 = false;
    }
    if(_S29)
    {
        return vec4<f32>(a_0, _S28 * _S28, d_0, e_5) / vec4<f32>((2.0f * _S28));
    }
    var _S31 : f32 = size_0.w;
    if(_S30 >= _S31)
    {
        return vec4<f32>(b_0, d_0, _S30 * _S30, f_0) / vec4<f32>((2.0f * _S30));
    }
    return vec4<f32>(c_0, e_5, f_0, _S31 * _S31) / vec4<f32>((2.0f * _S31));
}

fn quat_multiply_0( a_1 : vec4<f32>,  b_1 : vec4<f32>) -> vec4<f32>
{
    var _S32 : f32 = a_1.x;
    var _S33 : f32 = b_1.x;
    var _S34 : f32 = a_1.y;
    var _S35 : f32 = b_1.y;
    var _S36 : f32 = a_1.z;
    var _S37 : f32 = b_1.z;
    var _S38 : f32 = a_1.w;
    var _S39 : f32 = b_1.w;
    return vec4<f32>(_S32 * _S33 - _S34 * _S35 - _S36 * _S37 - _S38 * _S39, _S32 * _S35 + _S34 * _S33 + _S36 * _S39 - _S38 * _S37, _S32 * _S37 - _S34 * _S39 + _S36 * _S33 + _S38 * _S35, _S32 * _S39 + _S34 * _S37 - _S36 * _S35 + _S38 * _S33);
}

struct BoundSplat_0
{
     mean_1 : vec3<f32>,
     quat_wxyz_0 : vec4<f32>,
     sh_rotation_0 : Rows3_0,
};

fn bind_by_matrix_0( transform_0 : Rows4_0,  rotation_0 : Rows3_0,  mean_2 : vec3<f32>,  late_1 : vec3<f32>,  quat_wxyz_1 : vec4<f32>) -> BoundSplat_0
{
    var b_2 : BoundSplat_0;
    b_2.mean_1 = transform_point_0(transform_0, mean_2) + late_1;
    b_2.quat_wxyz_0 = quat_multiply_0(quat_from_matrix_0(rotation_0), quat_wxyz_1);
    b_2.sh_rotation_0 = rotation_0;
    return b_2;
}

fn identity_rows_0() -> Rows3_0
{
    var r_1 : Rows3_0;
    r_1.row0_1 = vec3<f32>(1.0f, 0.0f, 0.0f);
    r_1.row1_1 = vec3<f32>(0.0f, 1.0f, 0.0f);
    r_1.row2_1 = vec3<f32>(0.0f, 0.0f, 1.0f);
    return r_1;
}

fn rotate_inverse_0( m_5 : Rows3_0,  v_0 : vec3<f32>) -> vec3<f32>
{
    return m_5.row0_1 * vec3<f32>(v_0.x) + m_5.row1_1 * vec3<f32>(v_0.y) + m_5.row2_1 * vec3<f32>(v_0.z);
}

fn multiply_0( a_2 : Rows3_0,  b_3 : Rows3_0) -> Rows3_0
{
    var r_2 : Rows3_0;
    r_2.row0_1 = rotate_inverse_0(b_3, a_2.row0_1);
    r_2.row1_1 = rotate_inverse_0(b_3, a_2.row1_1);
    r_2.row2_1 = rotate_inverse_0(b_3, a_2.row2_1);
    return r_2;
}

fn bind_place_0( b_4 : BoundSplat_0,  world_0 : Rows4_0,  world_quat_wxyz_1 : vec4<f32>) -> BoundSplat_0
{
    var _S40 : BoundSplat_0 = b_4;
    _S40.mean_1 = transform_point_0(world_0, _S40.mean_1);
    _S40.quat_wxyz_0 = quat_multiply_0(world_quat_wxyz_1, _S40.quat_wxyz_0);
    _S40.sh_rotation_0 = multiply_0(linear_part_0(world_0), _S40.sh_rotation_0);
    return _S40;
}

@compute
@workgroup_size(64, 1, 1)
fn bind_skin(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var _S41 : u32 = id_0.x;
    if(_S41 >= (BindSkinConstants_0.rows_0))
    {
        return;
    }
    var row_3 : u32 = BindSkinConstants_0.first_0 + _S41;
    var transform_1 : Rows4_0;
    transform_1.row0_0 = BindSkinConstants_0.group_matrix_row0_0;
    transform_1.row1_0 = BindSkinConstants_0.group_matrix_row1_0;
    transform_1.row2_0 = BindSkinConstants_0.group_matrix_row2_0;
    var rotation_1 : Rows3_0;
    rotation_1.row0_1 = BindSkinConstants_0.group_rotation_row0_0.xyz;
    rotation_1.row1_1 = BindSkinConstants_0.group_rotation_row1_0.xyz;
    rotation_1.row2_1 = BindSkinConstants_0.group_rotation_row2_0.xyz;
    if((BindSkinConstants_0.binding_rule_0) == u32(1))
    {
        transform_1 = bind_skin_matrix_0(row_3);
        if((BindSkinConstants_0.rotation_rule_0) == u32(4))
        {
            rotation_1 = polar_0(linear_part_0(transform_1));
        }
    }
    var world_1 : Rows4_0;
    world_1.row0_0 = BindSkinConstants_0.world_row0_0;
    world_1.row1_0 = BindSkinConstants_0.world_row1_0;
    world_1.row2_0 = BindSkinConstants_0.world_row2_0;
    var mean_3 : vec4<f32> = Splats_0[row_3];
    var b_5 : BoundSplat_0 = bind_by_matrix_0(transform_1, rotation_1, bind_corrected_0(Splats_0[row_3].xyz, row_3), bind_late_0(row_3), Splats_0[BindSkinConstants_0.count_0 + row_3]);
    if((BindSkinConstants_0.sh_direction_0) == u32(1))
    {
        b_5.sh_rotation_0 = identity_rows_0();
    }
    b_5 = bind_place_0(b_5, world_1, BindSkinConstants_0.world_quat_wxyz_0);
    Splats_0[row_3] = vec4<f32>(b_5.mean_1, mean_3.w);
    Splats_0[BindSkinConstants_0.count_0 + row_3] = b_5.quat_wxyz_0;
    Splats_0[u32(2) * BindSkinConstants_0.count_0 + row_3] = vec4<f32>(b_5.sh_rotation_0.row0_1, Splats_0[u32(2) * BindSkinConstants_0.count_0 + row_3].w);
    Splats_0[u32(3) * BindSkinConstants_0.count_0 + row_3] = vec4<f32>(b_5.sh_rotation_0.row1_1, Splats_0[u32(3) * BindSkinConstants_0.count_0 + row_3].w);
    Splats_0[u32(4) * BindSkinConstants_0.count_0 + row_3] = vec4<f32>(b_5.sh_rotation_0.row2_1, Splats_0[u32(4) * BindSkinConstants_0.count_0 + row_3].w);
    return;
}

