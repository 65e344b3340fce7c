// Generated from hlsl/bind_triangles.hlsl, entry bind_triangles, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_BindTrianglesConstants_std140_0
{
    @align(16) triangles_0 : u32,
    @align(4) vertices_0 : u32,
    @align(8) corners_0 : u32,
    @align(4) corners_width_0 : u32,
    @align(16) canonical_0 : u32,
    @align(4) canonical_width_0 : u32,
    @align(8) canonical_scale_0 : u32,
    @align(4) rotation_rule_0 : u32,
    @align(16) quaternion_sign_0 : u32,
};

@binding(8) @group(0) var<uniform> BindTrianglesConstants_0 : SLANG_ParameterGroup_BindTrianglesConstants_std140_0;
@binding(0) @group(0) var<storage, read> SurfaceStatic_0 : array<u32>;

@binding(1) @group(0) var<storage, read> Mesh_0 : array<vec4<f32>>;

@binding(2) @group(0) var<storage, read_write> Triangles_0 : array<vec4<f32>>;

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

fn corner_0( plane_0 : u32,  row_0 : u32) -> u32
{
    return surface_code_0(BindTrianglesConstants_0.corners_0, plane_0 * BindTrianglesConstants_0.triangles_0 + row_0, BindTrianglesConstants_0.corners_width_0);
}

fn surface_linear_0( section_1 : u32,  index_1 : u32,  width_2 : u32,  scale_0 : u32) -> f32
{
    var code_0 : u32 = surface_code_0(section_1, index_1, width_2);
    if(width_2 == u32(32))
    {
        return (bitcast<f32>((code_0)));
    }
    return (bitcast<f32>((SurfaceStatic_0[scale_0]))) + (bitcast<f32>((SurfaceStatic_0[scale_0 + u32(1)]))) * f32(code_0);
}

fn surface_linear3_0( section_2 : u32,  index_2 : u32,  stride_0 : u32,  width_3 : u32,  scale_1 : u32) -> vec3<f32>
{
    return vec3<f32>(surface_linear_0(section_2, index_2, width_3, scale_1), surface_linear_0(section_2, index_2 + stride_0, width_3, scale_1 + u32(2)), surface_linear_0(section_2, index_2 + u32(2) * stride_0, width_3, scale_1 + u32(4)));
}

fn canonical_position_0( vertex_0 : u32) -> vec3<f32>
{
    return surface_linear3_0(BindTrianglesConstants_0.canonical_0, vertex_0, BindTrianglesConstants_0.vertices_0, BindTrianglesConstants_0.canonical_width_0, BindTrianglesConstants_0.canonical_scale_0);
}

fn bind_unit_0( v_0 : vec3<f32>) -> vec3<f32>
{
    return v_0 / vec3<f32>(max(length(v_0), 1.00000000317107685e-30f));
}

struct Rows3_0
{
     row0_0 : vec3<f32>,
     row1_0 : vec3<f32>,
     row2_0 : vec3<f32>,
};

fn bind_columns_0( x_0 : vec3<f32>,  y_0 : vec3<f32>,  z_0 : vec3<f32>) -> Rows3_0
{
    var m_0 : Rows3_0;
    m_0.row0_0 = vec3<f32>(x_0.x, y_0.x, z_0.x);
    m_0.row1_0 = vec3<f32>(x_0.y, y_0.y, z_0.y);
    m_0.row2_0 = vec3<f32>(x_0.z, y_0.z, z_0.z);
    return m_0;
}

struct TriangleShape_0
{
     frame_0 : Rows3_0,
     size_0 : f32,
     across_0 : vec3<f32>,
};

fn triangle_by_edge_0( p0_0 : vec3<f32>,  p1_0 : vec3<f32>,  p2_0 : vec3<f32>) -> TriangleShape_0
{
    var e_0 : vec3<f32> = p1_0 - p0_0;
    var f_0 : vec3<f32> = p2_0 - p0_0;
    var t_0 : TriangleShape_0;
    t_0.across_0 = cross(e_0, f_0);
    var a0_0 : vec3<f32> = bind_unit_0(e_0);
    var a1_0 : vec3<f32> = bind_unit_0(cross(a0_0, f_0));
    var a2_0 : vec3<f32> = (vec3<f32>(0) - bind_unit_0(cross(a1_0, a0_0)));
    t_0.frame_0 = bind_columns_0(a0_0, a1_0, a2_0);
    t_0.size_0 = (length(e_0) + abs(dot(a2_0, f_0))) / 2.0f;
    return t_0;
}

fn quat_from_matrix_0( m_1 : Rows3_0) -> vec4<f32>
{
    var d0_0 : f32 = m_1.row0_0.x;
    var d1_0 : f32 = m_1.row1_0.y;
    var d2_0 : f32 = m_1.row2_0.z;
    var _S1 : f32 = 1.0f + d0_0;
    var _S2 : f32 = 1.0f - d0_0;
    var size_1 : vec4<f32> = sqrt(max(vec4<f32>(_S1 + d1_0 + d2_0, _S1 - d1_0 - d2_0, _S2 + d1_0 - d2_0, _S2 - d1_0 + d2_0), vec4<f32>(0.0f)));
    var _S3 : f32 = m_1.row2_0.y;
    var _S4 : f32 = m_1.row1_0.z;
    var a_0 : f32 = _S3 - _S4;
    var _S5 : f32 = m_1.row0_0.z;
    var _S6 : f32 = m_1.row2_0.x;
    var b_0 : f32 = _S5 - _S6;
    var _S7 : f32 = m_1.row1_0.x;
    var _S8 : f32 = m_1.row0_0.y;
    var c_0 : f32 = _S7 - _S8;
    var d_0 : f32 = _S7 + _S8;
    var e_1 : f32 = _S5 + _S6;
    var f_1 : f32 = _S3 + _S4;
    var _S9 : f32 = size_1.x;
    var _S10 : f32 = size_1.y;
    var _S11 : bool;
    if(_S9 >= _S10)
    {
        _S11 = _S9 >= (size_1.z);
    }
    else
    {
        _S11 = false;
    }
    if(_S11)
    {
        _S11 = _S9 >= (size_1.w);
    }
    else
    {
        _S11 = false;
    }
    if(_S11)
    {
        return vec4<f32>(_S9 * _S9, a_0, b_0, c_0) / vec4<f32>((2.0f * _S9));
    }
    var _S12 : f32 = size_1.z;
    if(_S10 >= _S12)
    {
        _S11 = _S10 >= (size_1.w);
    }
    else
    {
        _S11 = false;
    }
    if(_S11)
    {
        return vec4<f32>(a_0, _S10 * _S10, d_0, e_1) / vec4<f32>((2.0f * _S10));
    }
    var _S13 : f32 = size_1.w;
    if(_S12 >= _S13)
    {
        return vec4<f32>(b_0, d_0, _S12 * _S12, f_1) / vec4<f32>((2.0f * _S12));
    }
    return vec4<f32>(c_0, e_1, f_1, _S13 * _S13) / vec4<f32>((2.0f * _S13));
}

fn triangle_by_area_0( p0_1 : vec3<f32>,  p1_1 : vec3<f32>,  p2_1 : vec3<f32>) -> TriangleShape_0
{
    var e_2 : vec3<f32> = p1_1 - p0_1;
    var t_1 : TriangleShape_0;
    var _S14 : vec3<f32> = cross(e_2, p2_1 - p0_1);
    t_1.across_0 = _S14;
    var x_1 : vec3<f32> = bind_unit_0(cross(e_2, bind_unit_0(_S14)));
    t_1.frame_0 = bind_columns_0(x_1, bind_unit_0(cross(e_2, x_1)), bind_unit_0(e_2));
    t_1.size_0 = length(_S14) / 2.0f;
    return t_1;
}

fn rotate_0( m_2 : Rows3_0,  v_1 : vec3<f32>) -> vec3<f32>
{
    return vec3<f32>(dot(m_2.row0_0, v_1), dot(m_2.row1_0, v_1), dot(m_2.row2_0, v_1));
}

fn multiply_transposed_0( a_1 : Rows3_0,  b_1 : Rows3_0) -> Rows3_0
{
    var r_0 : Rows3_0;
    r_0.row0_0 = rotate_0(b_1, a_1.row0_0);
    r_0.row1_0 = rotate_0(b_1, a_1.row1_0);
    r_0.row2_0 = rotate_0(b_1, a_1.row2_0);
    return r_0;
}

fn triangle_turn_0( frame_1 : Rows3_0,  canonical_frame_0 : Rows3_0,  quaternion_sign_1 : u32) -> vec4<f32>
{
    var turn_0 : vec4<f32> = quat_from_matrix_0(multiply_transposed_0(frame_1, canonical_frame_0));
    var negative_0 : bool;
    if(quaternion_sign_1 == u32(1))
    {
        negative_0 = (turn_0.x) < 0.0f;
    }
    else
    {
        negative_0 = false;
    }
    if(quaternion_sign_1 == u32(2))
    {
        negative_0 = (max(turn_0.z, turn_0.w)) > (max(turn_0.x, turn_0.y));
    }
    else
    {
    }
    var _S15 : vec4<f32>;
    if(negative_0)
    {
        _S15 = (vec4<f32>(0) - turn_0);
    }
    else
    {
        _S15 = turn_0;
    }
    return _S15;
}

@compute
@workgroup_size(64, 1, 1)
fn bind_triangles(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_1 : u32 = id_0.x;
    if(row_1 >= (BindTrianglesConstants_0.triangles_0))
    {
        return;
    }
    var v0_0 : u32 = corner_0(u32(0), row_1);
    var v1_0 : u32 = corner_0(u32(1), row_1);
    var v2_0 : u32 = corner_0(u32(2), row_1);
    var p0_2 : vec3<f32> = Mesh_0[v0_0].xyz;
    var p1_2 : vec3<f32> = Mesh_0[v1_0].xyz;
    var p2_2 : vec3<f32> = Mesh_0[v2_0].xyz;
    var c0_0 : vec3<f32> = canonical_position_0(v0_0);
    var c1_0 : vec3<f32> = canonical_position_0(v1_0);
    var c2_0 : vec3<f32> = canonical_position_0(v2_0);
    var shape_0 : TriangleShape_0;
    var rest_0 : TriangleShape_0;
    var turn_1 : vec4<f32>;
    if((BindTrianglesConstants_0.rotation_rule_0) == u32(2))
    {
        var shape_1 : TriangleShape_0 = triangle_by_edge_0(p0_2, p1_2, p2_2);
        var _S16 : TriangleShape_0 = triangle_by_edge_0(c0_0, c1_0, c2_0);
        var _S17 : vec4<f32> = quat_from_matrix_0(shape_1.frame_0);
        shape_0 = shape_1;
        turn_1 = _S17;
        rest_0 = _S16;
    }
    else
    {
        var shape_2 : TriangleShape_0 = triangle_by_area_0(p0_2, p1_2, p2_2);
        var rest_1 : TriangleShape_0 = triangle_by_area_0(c0_0, c1_0, c2_0);
        var _S18 : vec4<f32> = triangle_turn_0(shape_2.frame_0, rest_1.frame_0, BindTrianglesConstants_0.quaternion_sign_0);
        shape_0 = shape_2;
        turn_1 = _S18;
        rest_0 = rest_1;
    }
    Triangles_0[row_1] = vec4<f32>(shape_0.across_0, shape_0.size_0);
    Triangles_0[BindTrianglesConstants_0.triangles_0 + row_1] = turn_1;
    Triangles_0[u32(2) * BindTrianglesConstants_0.triangles_0 + row_1] = vec4<f32>(rest_0.size_0, f32(v0_0), f32(v1_0), f32(v2_0));
    return;
}

