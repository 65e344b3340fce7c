// Generated from hlsl/bind_vertices.hlsl, entry bind_vertices, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_BindVerticesConstants_std140_0
{
    @align(16) vertices_0 : u32,
    @align(4) triangles_0 : u32,
    @align(8) vertex_triangle_ptr_0 : u32,
    @align(4) vertex_triangle_0 : u32,
    @align(16) vertex_triangle_width_0 : u32,
    @align(4) normal_floor_0 : f32,
    @align(8) quaternion_floor_0 : f32,
    @align(4) rotation_rule_0 : u32,
    @align(16) skin_ptr_0 : u32,
    @align(4) skin_column_0 : u32,
    @align(8) skin_column_width_0 : u32,
    @align(4) skin_weight_0 : u32,
    @align(16) skin_weight_width_0 : u32,
    @align(4) skin_weight_step_0 : u32,
    @align(8) joints_0 : u32,
};

@binding(8) @group(0) var<uniform> BindVerticesConstants_0 : SLANG_ParameterGroup_BindVerticesConstants_std140_0;
@binding(0) @group(0) var<storage, read> SurfaceStatic_0 : array<u32>;

@binding(1) @group(0) var<storage, read> Triangles_0 : array<vec4<f32>>;

@binding(3) @group(0) var<storage, read_write> Mesh_0 : array<vec4<f32>>;

@binding(2) @group(0) var<storage, read> Pose_0 : array<f32>;

fn packed_element_0( word_0 : u32,  bit_0 : u32,  width_0 : u32) -> u32
{
    return (((word_0 >> (((bit_0 & (u32(31))))))) & ((((u32(1) << (width_0))) - u32(1))));
}

fn surface_code_0( section_0 : u32,  index_0 : u32,  width_1 : u32) -> u32
{
    if(width_1 == u32(32))
    {
        return SurfaceStatic_0[section_0 + index_0];
    }
    var bit_1 : u32 = index_0 * width_1;
    return packed_element_0(SurfaceStatic_0[section_0 + ((bit_1 >> (u32(5))))], bit_1, width_1);
}

fn vertex_normal_0( sum_across_0 : vec3<f32>,  normal_floor_1 : f32) -> vec3<f32>
{
    return sum_across_0 / vec3<f32>(max(length(sum_across_0), normal_floor_1));
}

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

fn surface_weight_0( section_1 : u32,  index_1 : u32,  width_2 : u32,  step_0 : u32) -> f32
{
    var code_0 : u32 = surface_code_0(section_1, index_1, width_2);
    if(width_2 == u32(32))
    {
        return (bitcast<f32>((code_0)));
    }
    return (bitcast<f32>((SurfaceStatic_0[step_0]))) * f32(code_0);
}

fn vertex_joint_0( joint_0 : u32) -> Rows4_0
{
    var at_0 : u32 = BindVerticesConstants_0.joints_0 + u32(12) * joint_0;
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

fn vertex_skin_matrix_0( row_0 : u32) -> Rows4_0
{
    var _S4 : u32 = SurfaceStatic_0[BindVerticesConstants_0.skin_ptr_0 + row_0 + u32(1)];
    var _S5 : u32 = SurfaceStatic_0[BindVerticesConstants_0.skin_ptr_0 + row_0];
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
        var _S6 : Rows4_0 = skin_add_0(blended_0, surface_weight_0(BindVerticesConstants_0.skin_weight_0, e_0, BindVerticesConstants_0.skin_weight_width_0, BindVerticesConstants_0.skin_weight_step_0), vertex_joint_0(surface_code_0(BindVerticesConstants_0.skin_column_0, e_0, BindVerticesConstants_0.skin_column_width_0)));
        var e_1 : u32 = e_0 + u32(1);
        blended_0 = _S6;
        e_0 = e_1;
    }
    return blended_0;
}

fn vertex_quat_mean_0( sum_turn_0 : vec4<f32>,  sum_area_0 : f32) -> vec4<f32>
{
    return sum_turn_0 / vec4<f32>(max(sum_area_0, 1.00000000317107685e-30f));
}

fn vertex_quat_0( sum_turn_1 : vec4<f32>,  quaternion_floor_1 : f32) -> vec4<f32>
{
    return sum_turn_1 / vec4<f32>(max(sqrt(dot(sum_turn_1, sum_turn_1)), quaternion_floor_1));
}

@compute
@workgroup_size(64, 1, 1)
fn bind_vertices(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_1 : u32 = id_0.x;
    if(row_1 >= (BindVerticesConstants_0.vertices_0))
    {
        return;
    }
    const _S7 : vec3<f32> = vec3<f32>(0.0f, 0.0f, 0.0f);
    const _S8 : vec4<f32> = vec4<f32>(0.0f, 0.0f, 0.0f, 0.0f);
    var _S9 : u32 = SurfaceStatic_0[BindVerticesConstants_0.vertex_triangle_ptr_0 + row_1 + u32(1)];
    var e_2 : u32 = SurfaceStatic_0[BindVerticesConstants_0.vertex_triangle_ptr_0 + row_1];
    var across_0 : vec3<f32> = _S7;
    var turn_0 : vec4<f32> = _S8;
    var area_0 : f32 = 0.0f;
    for(;;)
    {
        if(e_2 < _S9)
        {
        }
        else
        {
            break;
        }
        var t_0 : u32 = surface_code_0(BindVerticesConstants_0.vertex_triangle_0, e_2, BindVerticesConstants_0.vertex_triangle_width_0);
        var canonical_size_0 : f32 = Triangles_0[u32(2) * BindVerticesConstants_0.triangles_0 + t_0].x;
        var across_1 : vec3<f32> = across_0 + Triangles_0[t_0].xyz;
        var turn_1 : vec4<f32> = turn_0 + vec4<f32>(canonical_size_0) * Triangles_0[BindVerticesConstants_0.triangles_0 + t_0];
        var area_1 : f32 = area_0 + canonical_size_0;
        e_2 = e_2 + u32(1);
        across_0 = across_1;
        turn_0 = turn_1;
        area_0 = area_1;
    }
    Mesh_0[BindVerticesConstants_0.vertices_0 + row_1] = vec4<f32>(vertex_normal_0(across_0, BindVerticesConstants_0.normal_floor_0), 0.0f);
    if((BindVerticesConstants_0.rotation_rule_0) == u32(3))
    {
        var blended_1 : Rows4_0 = vertex_skin_matrix_0(row_1);
        Mesh_0[u32(2) * BindVerticesConstants_0.vertices_0 + row_1] = blended_1.row0_0;
        Mesh_0[u32(3) * BindVerticesConstants_0.vertices_0 + row_1] = blended_1.row1_0;
        Mesh_0[u32(4) * BindVerticesConstants_0.vertices_0 + row_1] = blended_1.row2_0;
    }
    else
    {
        if((BindVerticesConstants_0.rotation_rule_0) == u32(1))
        {
            Mesh_0[u32(2) * BindVerticesConstants_0.vertices_0 + row_1] = vertex_quat_mean_0(turn_0, area_0);
        }
        else
        {
            Mesh_0[u32(2) * BindVerticesConstants_0.vertices_0 + row_1] = vertex_quat_0(turn_0, BindVerticesConstants_0.quaternion_floor_0);
        }
    }
    return;
}

