// Generated from hlsl/bind_surface.hlsl, entry bind_surface, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_BindSurfaceConstants_std140_0
{
    @align(16) count_0 : u32,
    @align(4) vertices_0 : u32,
    @align(8) triangles_0 : u32,
    @align(4) triangle_ids_0 : u32,
    @align(16) triangle_ids_width_0 : u32,
    @align(4) barycentric_0 : u32,
    @align(8) barycentric_width_0 : u32,
    @align(4) barycentric_scale_0 : u32,
    @align(16) displacement_0 : u32,
    @align(4) displacement_width_0 : u32,
    @align(8) displacement_scale_0 : u32,
    @align(4) local_offset_0 : u32,
    @align(16) local_offset_width_0 : u32,
    @align(4) local_offset_scale_0 : u32,
    @align(8) local_quat_0 : u32,
    @align(4) local_quat_width_0 : u32,
    @align(16) local_quat_scale_0 : u32,
    @align(4) position_rule_0 : u32,
    @align(8) rotation_rule_0 : u32,
    @align(4) scale_rule_0 : u32,
    @align(16) sh_direction_0 : u32,
    @align(4) unused_0 : u32,
    @align(8) area_damping_0 : f32,
    @align(4) log_training_per_bundle_0 : f32,
    @align(16) world_row0_0 : vec4<f32>,
    @align(16) world_row1_0 : vec4<f32>,
    @align(16) world_row2_0 : vec4<f32>,
    @align(16) world_quat_wxyz_0 : vec4<f32>,
};

@binding(8) @group(0) var<uniform> BindSurfaceConstants_0 : SLANG_ParameterGroup_BindSurfaceConstants_std140_0;
@binding(0) @group(0) var<storage, read> EmbedStatic_0 : array<u32>;

@binding(2) @group(0) var<storage, read> Triangles_0 : array<vec4<f32>>;

@binding(1) @group(0) var<storage, read> Mesh_0 : array<vec4<f32>>;

@binding(3) @group(0) var<storage, read_write> Splats_0 : array<vec4<f32>>;

fn packed_element_0( word_0 : u32,  bit_0 : u32,  width_0 : u32) -> u32
{
    return (((word_0 >> (((bit_0 & (u32(31))))))) & ((((u32(1) << (width_0))) - u32(1))));
}

fn embed_code_0( section_0 : u32,  index_0 : u32,  width_1 : u32) -> u32
{
    if(width_1 == u32(32))
    {
        return EmbedStatic_0[section_0 + index_0];
    }
    var bit_1 : u32 = index_0 * width_1;
    return packed_element_0(EmbedStatic_0[section_0 + ((bit_1 >> (u32(5))))], bit_1, width_1);
}

fn embed_linear_0( section_1 : u32,  index_1 : u32,  width_2 : u32,  scale_0 : u32) -> f32
{
    var code_0 : u32 = embed_code_0(section_1, index_1, width_2);
    if(width_2 == u32(32))
    {
        return (bitcast<f32>((code_0)));
    }
    return (bitcast<f32>((EmbedStatic_0[scale_0]))) + (bitcast<f32>((EmbedStatic_0[scale_0 + u32(1)]))) * f32(code_0);
}

fn embed_linear3_0( section_2 : u32,  index_2 : u32,  stride_0 : u32,  width_3 : u32,  scale_1 : u32) -> vec3<f32>
{
    return vec3<f32>(embed_linear_0(section_2, index_2, width_3, scale_1), embed_linear_0(section_2, index_2 + stride_0, width_3, scale_1 + u32(2)), embed_linear_0(section_2, index_2 + u32(2) * stride_0, width_3, scale_1 + u32(4)));
}

struct Foot_0
{
     vertex_0 : vec3<u32>,
     weight_0 : vec3<f32>,
};

fn mesh_blend_0( plane_0 : u32,  foot_0 : Foot_0) -> vec4<f32>
{
    var first_0 : u32 = plane_0 * BindSurfaceConstants_0.vertices_0;
    return vec4<f32>(foot_0.weight_0.x) * Mesh_0[first_0 + foot_0.vertex_0.x] + vec4<f32>(foot_0.weight_0.y) * Mesh_0[first_0 + foot_0.vertex_0.y] + vec4<f32>(foot_0.weight_0.z) * Mesh_0[first_0 + foot_0.vertex_0.z];
}

struct Rows3_0
{
     row0_0 : vec3<f32>,
     row1_0 : vec3<f32>,
     row2_0 : vec3<f32>,
};

fn polar_0( m_0 : Rows3_0) -> Rows3_0
{
    var _S1 : Rows3_0 = m_0;
    var step_0 : i32 = i32(0);
    for(;;)
    {
        if(step_0 < i32(3))
        {
        }
        else
        {
            break;
        }
        var c0_0 : vec3<f32> = cross(_S1.row1_0, _S1.row2_0);
        var c1_0 : vec3<f32> = cross(_S1.row2_0, _S1.row0_0);
        var c2_0 : vec3<f32> = cross(_S1.row0_0, _S1.row1_0);
        var _S2 : vec3<f32> = vec3<f32>(dot(_S1.row0_0, c0_0));
        var _S3 : vec3<f32> = vec3<f32>(0.5f);
        _S1.row0_0 = (_S1.row0_0 + c0_0 / _S2) * _S3;
        _S1.row1_0 = (_S1.row1_0 + c1_0 / _S2) * _S3;
        _S1.row2_0 = (_S1.row2_0 + c2_0 / _S2) * _S3;
        step_0 = step_0 + i32(1);
    }
    return _S1;
}

fn quat_from_matrix_0( m_1 : Rows3_0) -> vec4<f32>
{
    var d0_0 : f32 = m_1.row0_0.x;
    var d1_0 : f32 = m_1.row1_0.y;
    var d2_0 : f32 = m_1.row2_0.z;
    var _S4 : f32 = 1.0f + d0_0;
    var _S5 : f32 = 1.0f - d0_0;
    var size_0 : vec4<f32> = sqrt(max(vec4<f32>(_S4 + d1_0 + d2_0, _S4 - d1_0 - d2_0, _S5 + d1_0 - d2_0, _S5 - d1_0 + d2_0), vec4<f32>(0.0f)));
    var _S6 : f32 = m_1.row2_0.y;
    var _S7 : f32 = m_1.row1_0.z;
    var a_0 : f32 = _S6 - _S7;
    var _S8 : f32 = m_1.row0_0.z;
    var _S9 : f32 = m_1.row2_0.x;
    var b_0 : f32 = _S8 - _S9;
    var _S10 : f32 = m_1.row1_0.x;
    var _S11 : f32 = m_1.row0_0.y;
    var c_0 : f32 = _S10 - _S11;
    var d_0 : f32 = _S10 + _S11;
    var e_0 : f32 = _S8 + _S9;
    var f_0 : f32 = _S6 + _S7;
    var _S12 : f32 = size_0.x;
    var _S13 : f32 = size_0.y;
    var _S14 : bool;
    if(_S12 >= _S13)
    {
        _S14 = _S12 >= (size_0.z);
    }
    else
    {
        _S14 = false;
    }
    if(_S14)
    {
        _S14 = _S12 >= (size_0.w);
    }
    else
    {
        _S14 = false;
    }
    if(_S14)
    {
        return vec4<f32>(_S12 * _S12, a_0, b_0, c_0) / vec4<f32>((2.0f * _S12));
    }
    var _S15 : f32 = size_0.z;
    if(_S13 >= _S15)
    {
        _S14 = _S13 >= (size_0.w);
    }
    else
    {
        _S14 = false;
    }
    if(_S14)
    {
        return vec4<f32>(a_0, _S13 * _S13, d_0, e_0) / vec4<f32>((2.0f * _S13));
    }
    var _S16 : f32 = size_0.w;
    if(_S15 >= _S16)
    {
        return vec4<f32>(b_0, d_0, _S15 * _S15, f_0) / vec4<f32>((2.0f * _S15));
    }
    return vec4<f32>(c_0, e_0, f_0, _S16 * _S16) / vec4<f32>((2.0f * _S16));
}

fn surface_turn_0( triangle_id_0 : u32,  foot_1 : Foot_0) -> vec4<f32>
{
    if((BindSurfaceConstants_0.rotation_rule_0) == u32(2))
    {
        return Triangles_0[BindSurfaceConstants_0.triangles_0 + triangle_id_0];
    }
    if((BindSurfaceConstants_0.rotation_rule_0) == u32(3))
    {
        var blended_0 : Rows3_0;
        blended_0.row0_0 = mesh_blend_0(u32(2), foot_1).xyz;
        blended_0.row1_0 = mesh_blend_0(u32(3), foot_1).xyz;
        blended_0.row2_0 = mesh_blend_0(u32(4), foot_1).xyz;
        return quat_from_matrix_0(polar_0(blended_0));
    }
    return mesh_blend_0(u32(2), foot_1);
}

fn bind_unit_0( v_0 : vec3<f32>) -> vec3<f32>
{
    return v_0 / vec3<f32>(max(length(v_0), 1.00000000317107685e-30f));
}

fn bind_columns_0( x_0 : vec3<f32>,  y_0 : vec3<f32>,  z_0 : vec3<f32>) -> Rows3_0
{
    var m_2 : Rows3_0;
    m_2.row0_0 = vec3<f32>(x_0.x, y_0.x, z_0.x);
    m_2.row1_0 = vec3<f32>(x_0.y, y_0.y, z_0.y);
    m_2.row2_0 = vec3<f32>(x_0.z, y_0.z, z_0.z);
    return m_2;
}

struct TriangleShape_0
{
     frame_0 : Rows3_0,
     size_1 : f32,
     across_0 : vec3<f32>,
};

fn triangle_by_edge_0( p0_0 : vec3<f32>,  p1_0 : vec3<f32>,  p2_0 : vec3<f32>) -> TriangleShape_0
{
    var e_1 : vec3<f32> = p1_0 - p0_0;
    var f_1 : vec3<f32> = p2_0 - p0_0;
    var t_0 : TriangleShape_0;
    t_0.across_0 = cross(e_1, f_1);
    var a0_0 : vec3<f32> = bind_unit_0(e_1);
    var a1_0 : vec3<f32> = bind_unit_0(cross(a0_0, f_1));
    var a2_0 : vec3<f32> = (vec3<f32>(0) - bind_unit_0(cross(a1_0, a0_0)));
    t_0.frame_0 = bind_columns_0(a0_0, a1_0, a2_0);
    t_0.size_1 = (length(e_1) + abs(dot(a2_0, f_1))) / 2.0f;
    return t_0;
}

fn rotate_0( m_3 : Rows3_0,  v_1 : vec3<f32>) -> vec3<f32>
{
    return vec3<f32>(dot(m_3.row0_0, v_1), dot(m_3.row1_0, v_1), dot(m_3.row2_0, v_1));
}

fn surface_position_0( row_0 : u32,  foot_2 : Foot_0,  size_2 : f32) -> vec3<f32>
{
    var moved_0 : vec3<f32>;
    if((BindSurfaceConstants_0.position_rule_0) == u32(1))
    {
        moved_0 = vec3<f32>(size_2) * rotate_0(triangle_by_edge_0(Mesh_0[foot_2.vertex_0.x].xyz, Mesh_0[foot_2.vertex_0.y].xyz, Mesh_0[foot_2.vertex_0.z].xyz).frame_0, embed_linear3_0(BindSurfaceConstants_0.local_offset_0, row_0, BindSurfaceConstants_0.count_0, BindSurfaceConstants_0.local_offset_width_0, BindSurfaceConstants_0.local_offset_scale_0));
    }
    else
    {
        var normal_0 : vec3<f32> = mesh_blend_0(u32(1), foot_2).xyz;
        if((BindSurfaceConstants_0.position_rule_0) == u32(0))
        {
            moved_0 = bind_unit_0(normal_0);
        }
        else
        {
            moved_0 = normal_0;
        }
        moved_0 = vec3<f32>(embed_linear_0(BindSurfaceConstants_0.displacement_0, row_0, BindSurfaceConstants_0.displacement_width_0, BindSurfaceConstants_0.displacement_scale_0)) * moved_0;
    }
    return mesh_blend_0(u32(0), foot_2).xyz + moved_0;
}

fn bind_unit4_0( v_2 : vec4<f32>) -> vec4<f32>
{
    return v_2 / vec4<f32>(max(sqrt(dot(v_2, v_2)), 1.00000000317107685e-30f));
}

fn quat_multiply_0( a_1 : vec4<f32>,  b_1 : vec4<f32>) -> vec4<f32>
{
    var _S17 : f32 = a_1.x;
    var _S18 : f32 = b_1.x;
    var _S19 : f32 = a_1.y;
    var _S20 : f32 = b_1.y;
    var _S21 : f32 = a_1.z;
    var _S22 : f32 = b_1.z;
    var _S23 : f32 = a_1.w;
    var _S24 : f32 = b_1.w;
    return vec4<f32>(_S17 * _S18 - _S19 * _S20 - _S21 * _S22 - _S23 * _S24, _S17 * _S20 + _S19 * _S18 + _S21 * _S24 - _S23 * _S22, _S17 * _S22 - _S19 * _S24 + _S21 * _S18 + _S23 * _S20, _S17 * _S24 + _S19 * _S22 - _S21 * _S20 + _S23 * _S18);
}

fn matrix_from_quat_0( q_0 : vec4<f32>) -> Rows3_0
{
    var w_0 : f32 = q_0.x;
    var x_1 : f32 = q_0.y;
    var y_1 : f32 = q_0.z;
    var z_1 : f32 = q_0.w;
    var r_0 : Rows3_0;
    var _S25 : f32 = y_1 * y_1;
    var _S26 : f32 = z_1 * z_1;
    var _S27 : f32 = x_1 * y_1;
    var _S28 : f32 = w_0 * z_1;
    var _S29 : f32 = x_1 * z_1;
    var _S30 : f32 = w_0 * y_1;
    r_0.row0_0 = vec3<f32>(1.0f - 2.0f * (_S25 + _S26), 2.0f * (_S27 - _S28), 2.0f * (_S29 + _S30));
    var _S31 : f32 = x_1 * x_1;
    var _S32 : f32 = y_1 * z_1;
    var _S33 : f32 = w_0 * x_1;
    r_0.row1_0 = vec3<f32>(2.0f * (_S27 + _S28), 1.0f - 2.0f * (_S31 + _S26), 2.0f * (_S32 - _S33));
    r_0.row2_0 = vec3<f32>(2.0f * (_S29 - _S30), 2.0f * (_S32 + _S33), 1.0f - 2.0f * (_S31 + _S25));
    return r_0;
}

struct BoundSplat_0
{
     mean_0 : vec3<f32>,
     quat_wxyz_0 : vec4<f32>,
     sh_rotation_0 : Rows3_0,
};

fn bind_by_turn_0( mean_1 : vec3<f32>,  turn_0 : vec4<f32>,  local_quat_wxyz_0 : vec4<f32>) -> BoundSplat_0
{
    var unit_turn_0 : vec4<f32> = bind_unit4_0(turn_0);
    var b_2 : BoundSplat_0;
    b_2.mean_0 = mean_1;
    b_2.quat_wxyz_0 = quat_multiply_0(unit_turn_0, local_quat_wxyz_0);
    b_2.sh_rotation_0 = matrix_from_quat_0(unit_turn_0);
    return b_2;
}

fn identity_rows_0() -> Rows3_0
{
    var r_1 : Rows3_0;
    r_1.row0_0 = vec3<f32>(1.0f, 0.0f, 0.0f);
    r_1.row1_0 = vec3<f32>(0.0f, 1.0f, 0.0f);
    r_1.row2_0 = vec3<f32>(0.0f, 0.0f, 1.0f);
    return r_1;
}

struct Rows4_0
{
     row0_1 : vec4<f32>,
     row1_1 : vec4<f32>,
     row2_1 : vec4<f32>,
};

fn transform_point_0( m_4 : Rows4_0,  p_0 : vec3<f32>) -> vec3<f32>
{
    var _S34 : f32 = p_0.x;
    var _S35 : f32 = p_0.y;
    var _S36 : f32 = p_0.z;
    return vec3<f32>(m_4.row0_1.x * _S34 + m_4.row0_1.y * _S35 + m_4.row0_1.z * _S36 + m_4.row0_1.w, m_4.row1_1.x * _S34 + m_4.row1_1.y * _S35 + m_4.row1_1.z * _S36 + m_4.row1_1.w, m_4.row2_1.x * _S34 + m_4.row2_1.y * _S35 + m_4.row2_1.z * _S36 + m_4.row2_1.w);
}

fn linear_part_0( m_5 : Rows4_0) -> Rows3_0
{
    var r_2 : Rows3_0;
    r_2.row0_0 = m_5.row0_1.xyz;
    r_2.row1_0 = m_5.row1_1.xyz;
    r_2.row2_0 = m_5.row2_1.xyz;
    return r_2;
}

fn rotate_inverse_0( m_6 : Rows3_0,  v_3 : vec3<f32>) -> vec3<f32>
{
    return m_6.row0_0 * vec3<f32>(v_3.x) + m_6.row1_0 * vec3<f32>(v_3.y) + m_6.row2_0 * vec3<f32>(v_3.z);
}

fn multiply_0( a_2 : Rows3_0,  b_3 : Rows3_0) -> Rows3_0
{
    var r_3 : Rows3_0;
    r_3.row0_0 = rotate_inverse_0(b_3, a_2.row0_0);
    r_3.row1_0 = rotate_inverse_0(b_3, a_2.row1_0);
    r_3.row2_0 = rotate_inverse_0(b_3, a_2.row2_0);
    return r_3;
}

fn bind_place_0( b_4 : BoundSplat_0,  world_0 : Rows4_0,  world_quat_wxyz_1 : vec4<f32>) -> BoundSplat_0
{
    var _S37 : BoundSplat_0 = b_4;
    _S37.mean_0 = transform_point_0(world_0, _S37.mean_0);
    _S37.quat_wxyz_0 = quat_multiply_0(world_quat_wxyz_1, _S37.quat_wxyz_0);
    _S37.sh_rotation_0 = multiply_0(linear_part_0(world_0), _S37.sh_rotation_0);
    return _S37;
}

fn scale_log_area_0( log_scale_0 : vec3<f32>,  area_0 : f32,  canonical_area_0 : f32,  damping_0 : f32,  log_training_per_bundle_1 : f32) -> vec3<f32>
{
    var _S38 : vec3<f32> = vec3<f32>(log_training_per_bundle_1);
    return (log_scale_0 + _S38) * vec3<f32>(((area_0 + damping_0) / (canonical_area_0 + damping_0))) - _S38;
}

fn scale_linear_0( log_scale_1 : vec3<f32>,  size_3 : f32,  canonical_size_0 : f32) -> vec3<f32>
{
    return log_scale_1 + vec3<f32>(log(max(size_3, 1.00000000317107685e-30f) / canonical_size_0));
}

fn surface_scale_0( log_scale_2 : vec3<f32>,  size_4 : f32,  canonical_0 : f32) -> vec3<f32>
{
    if((BindSurfaceConstants_0.scale_rule_0) == u32(1))
    {
        return scale_log_area_0(log_scale_2, size_4, canonical_0, BindSurfaceConstants_0.area_damping_0, BindSurfaceConstants_0.log_training_per_bundle_0);
    }
    if((BindSurfaceConstants_0.scale_rule_0) == u32(2))
    {
        return scale_linear_0(log_scale_2, size_4, canonical_0);
    }
    return log_scale_2;
}

@compute
@workgroup_size(64, 1, 1)
fn bind_surface(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_1 : u32 = id_0.x;
    if(row_1 >= (BindSurfaceConstants_0.count_0))
    {
        return;
    }
    var t_1 : u32 = embed_code_0(BindSurfaceConstants_0.triangle_ids_0, row_1, BindSurfaceConstants_0.triangle_ids_width_0);
    var rest_0 : vec4<f32> = Triangles_0[u32(2) * BindSurfaceConstants_0.triangles_0 + t_1];
    var foot_3 : Foot_0;
    foot_3.vertex_0 = vec3<u32>(rest_0.yzw);
    foot_3.weight_0 = embed_linear3_0(BindSurfaceConstants_0.barycentric_0, row_1, BindSurfaceConstants_0.count_0, BindSurfaceConstants_0.barycentric_width_0, BindSurfaceConstants_0.barycentric_scale_0);
    var size_5 : f32 = Triangles_0[t_1].w;
    var b_5 : BoundSplat_0 = bind_by_turn_0(surface_position_0(row_1, foot_3, size_5), surface_turn_0(t_1, foot_3), vec4<f32>(embed_linear_0(BindSurfaceConstants_0.local_quat_0, row_1, BindSurfaceConstants_0.local_quat_width_0, BindSurfaceConstants_0.local_quat_scale_0), embed_linear3_0(BindSurfaceConstants_0.local_quat_0, BindSurfaceConstants_0.count_0 + row_1, BindSurfaceConstants_0.count_0, BindSurfaceConstants_0.local_quat_width_0, BindSurfaceConstants_0.local_quat_scale_0 + u32(2))));
    if((BindSurfaceConstants_0.sh_direction_0) == u32(1))
    {
        b_5.sh_rotation_0 = identity_rows_0();
    }
    var world_1 : Rows4_0;
    world_1.row0_1 = BindSurfaceConstants_0.world_row0_0;
    world_1.row1_1 = BindSurfaceConstants_0.world_row1_0;
    world_1.row2_1 = BindSurfaceConstants_0.world_row2_0;
    b_5 = bind_place_0(b_5, world_1, BindSurfaceConstants_0.world_quat_wxyz_0);
    var log_scale_3 : vec3<f32> = surface_scale_0(vec3<f32>(Splats_0[u32(2) * BindSurfaceConstants_0.count_0 + row_1].w, Splats_0[u32(3) * BindSurfaceConstants_0.count_0 + row_1].w, Splats_0[u32(4) * BindSurfaceConstants_0.count_0 + row_1].w), size_5, rest_0.x);
    Splats_0[row_1] = vec4<f32>(b_5.mean_0, Splats_0[row_1].w);
    Splats_0[BindSurfaceConstants_0.count_0 + row_1] = b_5.quat_wxyz_0;
    Splats_0[u32(2) * BindSurfaceConstants_0.count_0 + row_1] = vec4<f32>(b_5.sh_rotation_0.row0_0, log_scale_3.x);
    Splats_0[u32(3) * BindSurfaceConstants_0.count_0 + row_1] = vec4<f32>(b_5.sh_rotation_0.row1_0, log_scale_3.y);
    Splats_0[u32(4) * BindSurfaceConstants_0.count_0 + row_1] = vec4<f32>(b_5.sh_rotation_0.row2_0, log_scale_3.z);
    return;
}

