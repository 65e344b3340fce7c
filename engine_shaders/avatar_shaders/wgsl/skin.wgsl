// Generated from hlsl/skin.hlsl, entry skin, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_SkinConstants_std140_0
{
    @align(16) first_0 : u32,
    @align(4) count_0 : u32,
    @align(8) late_ptr_0 : u32,
    @align(4) late_column_0 : u32,
    @align(16) late_column_width_0 : u32,
    @align(4) late_position_0 : u32,
    @align(8) late_position_width_0 : u32,
    @align(4) late_position_step_0 : u32,
    @align(16) skin_ptr_0 : u32,
    @align(4) skin_column_0 : u32,
    @align(8) skin_column_width_0 : u32,
    @align(4) skin_weight_0 : u32,
    @align(16) skin_weight_width_0 : u32,
    @align(4) skin_weight_step_0 : u32,
    @align(8) late_0 : u32,
    @align(4) joints_0 : u32,
};

@binding(8) @group(0) var<uniform> SkinConstants_0 : SLANG_ParameterGroup_SkinConstants_std140_0;
@binding(0) @group(0) var<storage, read> SkinStatic_0 : array<u32>;

@binding(1) @group(0) var<storage, read> Pose_0 : array<f32>;

@binding(2) @group(0) var<storage, read_write> Mesh_0 : array<vec4<f32>>;

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

fn skinned_code_0( section_0 : u32,  index_0 : u32,  width_1 : u32) -> u32
{
    if(width_1 == u32(32))
    {
        return SkinStatic_0[section_0 + index_0];
    }
    var bit_1 : u32 = index_0 * width_1;
    return packed_element_0(SkinStatic_0[section_0 + ((bit_1 >> (u32(5))))], bit_1, width_1);
}

fn skinned_weight_0( section_1 : u32,  index_1 : u32,  width_2 : u32,  step_0 : u32) -> f32
{
    var code_0 : u32 = skinned_code_0(section_1, index_1, width_2);
    if(width_2 == u32(32))
    {
        return (bitcast<f32>((code_0)));
    }
    return (bitcast<f32>((SkinStatic_0[step_0]))) * f32(code_0);
}

fn skin_joint_0( joint_0 : u32) -> Rows4_0
{
    var at_0 : u32 = SkinConstants_0.joints_0 + u32(12) * joint_0;
    var m_0 : Rows4_0;
    m_0.row0_0 = vec4<f32>(Pose_0[at_0], Pose_0[at_0 + u32(1)], Pose_0[at_0 + u32(2)], Pose_0[at_0 + u32(3)]);
    m_0.row1_0 = vec4<f32>(Pose_0[at_0 + u32(4)], Pose_0[at_0 + u32(5)], Pose_0[at_0 + u32(6)], Pose_0[at_0 + u32(7)]);
    m_0.row2_0 = vec4<f32>(Pose_0[at_0 + u32(8)], Pose_0[at_0 + u32(9)], Pose_0[at_0 + u32(10)], Pose_0[at_0 + u32(11)]);
    return m_0;
}

fn skin_add_0( sum_1 : Rows4_0,  weight_0 : f32,  joint_1 : Rows4_0) -> Rows4_0
{
    var _S2 : Rows4_0 = sum_1;
    var _S3 : vec4<f32> = vec4<f32>(weight_0);
    _S2.row0_0 = _S2.row0_0 + _S3 * joint_1.row0_0;
    _S2.row1_0 = _S2.row1_0 + _S3 * joint_1.row1_0;
    _S2.row2_0 = _S2.row2_0 + _S3 * joint_1.row2_0;
    return _S2;
}

fn transform_point_0( m_1 : Rows4_0,  p_0 : vec3<f32>) -> vec3<f32>
{
    var _S4 : f32 = p_0.x;
    var _S5 : f32 = p_0.y;
    var _S6 : f32 = p_0.z;
    return vec3<f32>(m_1.row0_0.x * _S4 + m_1.row0_0.y * _S5 + m_1.row0_0.z * _S6 + m_1.row0_0.w, m_1.row1_0.x * _S4 + m_1.row1_0.y * _S5 + m_1.row1_0.z * _S6 + m_1.row1_0.w, m_1.row2_0.x * _S4 + m_1.row2_0.y * _S5 + m_1.row2_0.z * _S6 + m_1.row2_0.w);
}

fn packed_step_count_0( code_1 : u32,  width_3 : u32) -> f32
{
    return f32(code_1) - f32((u32(1) << ((width_3 - u32(1)))));
}

fn skinned_signed_0( section_2 : u32,  index_2 : u32,  width_4 : u32,  step_1 : u32) -> f32
{
    if(width_4 == u32(0))
    {
        return 0.0f;
    }
    var code_2 : u32 = skinned_code_0(section_2, index_2, width_4);
    if(width_4 == u32(32))
    {
        return (bitcast<f32>((code_2)));
    }
    return (bitcast<f32>((SkinStatic_0[step_1]))) * packed_step_count_0(code_2, width_4);
}

fn skinned_signed3_0( section_3 : u32,  index_3 : u32,  width_5 : u32,  step_2 : u32) -> vec3<f32>
{
    return vec3<f32>(skinned_signed_0(section_3, index_3, width_5, step_2), skinned_signed_0(section_3, index_3 + u32(1), width_5, step_2 + u32(1)), skinned_signed_0(section_3, index_3 + u32(2), width_5, step_2 + u32(2)));
}

fn late_add_0( posed_0 : vec3<f32>,  weight_1 : f32,  delta_0 : vec3<f32>) -> vec3<f32>
{
    return posed_0 + vec3<f32>(weight_1) * delta_0;
}

@compute
@workgroup_size(64, 1, 1)
fn skin(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_0 : u32 = id_0.x;
    if(row_0 >= (SkinConstants_0.count_0))
    {
        return;
    }
    var _S7 : u32 = SkinStatic_0[SkinConstants_0.skin_ptr_0 + row_0 + u32(1)];
    var _S8 : u32 = SkinStatic_0[SkinConstants_0.skin_ptr_0 + row_0];
    var blended_0 : Rows4_0 = skin_none_0();
    var e_0 : u32 = _S8;
    for(;;)
    {
        if(e_0 < _S7)
        {
        }
        else
        {
            break;
        }
        var _S9 : Rows4_0 = skin_add_0(blended_0, skinned_weight_0(SkinConstants_0.skin_weight_0, e_0, SkinConstants_0.skin_weight_width_0, SkinConstants_0.skin_weight_step_0), skin_joint_0(skinned_code_0(SkinConstants_0.skin_column_0, e_0, SkinConstants_0.skin_column_width_0)));
        var e_1 : u32 = e_0 + u32(1);
        blended_0 = _S9;
        e_0 = e_1;
    }
    var _S10 : u32 = SkinStatic_0[SkinConstants_0.late_ptr_0 + row_0 + u32(1)];
    var _S11 : u32 = SkinStatic_0[SkinConstants_0.late_ptr_0 + row_0];
    var posed_1 : vec3<f32> = transform_point_0(blended_0, Mesh_0[SkinConstants_0.first_0 + row_0].xyz);
    var l_0 : u32 = _S11;
    for(;;)
    {
        if(l_0 < _S10)
        {
        }
        else
        {
            break;
        }
        var column_0 : u32 = skinned_code_0(SkinConstants_0.late_column_0, l_0, SkinConstants_0.late_column_width_0);
        var _S12 : vec3<f32> = late_add_0(posed_1, Pose_0[SkinConstants_0.late_0 + column_0], skinned_signed3_0(SkinConstants_0.late_position_0, u32(3) * l_0, SkinConstants_0.late_position_width_0, SkinConstants_0.late_position_step_0 + u32(3) * column_0));
        var l_1 : u32 = l_0 + u32(1);
        posed_1 = _S12;
        l_0 = l_1;
    }
    Mesh_0[SkinConstants_0.first_0 + row_0] = vec4<f32>(posed_1, 1.0f);
    return;
}

