// Generated from hlsl/shadow_mesh.hlsl, entry shadow_mesh, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_ShadowMeshConstants_std140_0
{
    @align(16) triangles_0 : u32,
    @align(4) vertices_0 : u32,
    @align(8) corners_0 : u32,
    @align(4) corners_width_0 : u32,
    @align(16) world_row0_0 : vec4<f32>,
    @align(16) world_row1_0 : vec4<f32>,
    @align(16) world_row2_0 : vec4<f32>,
    @align(16) shadow_row0_0 : vec4<f32>,
    @align(16) shadow_row1_0 : vec4<f32>,
    @align(16) shadow_row2_0 : vec4<f32>,
    @align(16) shadow_row3_0 : vec4<f32>,
};

@binding(8) @group(0) var<uniform> ShadowMeshConstants_0 : SLANG_ParameterGroup_ShadowMeshConstants_std140_0;
@binding(0) @group(0) var<storage, read> CornerStatic_0 : array<u32>;

@binding(1) @group(0) var<storage, read> Mesh_0 : array<vec4<f32>>;

@binding(2) @group(0) var<storage, read_write> Shadow_0 : array<atomic<u32>>;

fn packed_element_0( word_0 : u32,  bit_0 : u32,  width_0 : u32) -> u32
{
    return (((word_0 >> (((bit_0 & (u32(31))))))) & ((((u32(1) << (width_0))) - u32(1))));
}

fn corner_code_0( section_0 : u32,  index_0 : u32,  width_1 : u32) -> u32
{
    if(width_1 == u32(32))
    {
        return CornerStatic_0[section_0 + index_0];
    }
    var bit_1 : u32 = index_0 * width_1;
    return packed_element_0(CornerStatic_0[section_0 + ((bit_1 >> (u32(5))))], bit_1, width_1);
}

struct Rows4_0
{
     row0_0 : vec4<f32>,
     row1_0 : vec4<f32>,
     row2_0 : vec4<f32>,
};

fn transform_point_0( m_0 : Rows4_0,  p_0 : vec3<f32>) -> vec3<f32>
{
    var _S1 : f32 = p_0.x;
    var _S2 : f32 = p_0.y;
    var _S3 : f32 = p_0.z;
    return vec3<f32>(m_0.row0_0.x * _S1 + m_0.row0_0.y * _S2 + m_0.row0_0.z * _S3 + m_0.row0_0.w, m_0.row1_0.x * _S1 + m_0.row1_0.y * _S2 + m_0.row1_0.z * _S3 + m_0.row1_0.w, m_0.row2_0.x * _S1 + m_0.row2_0.y * _S2 + m_0.row2_0.z * _S3 + m_0.row2_0.w);
}

struct ShadowPoint_0
{
     texel_0 : vec2<f32>,
     distance_0 : f32,
     scale_0 : f32,
};

fn shadow_point_0( x_0 : vec3<f32>,  row0_1 : vec4<f32>,  row1_1 : vec4<f32>,  row2_1 : vec4<f32>,  row3_0 : vec4<f32>) -> ShadowPoint_0
{
    var at_0 : vec4<f32> = vec4<f32>(x_0, 1.0f);
    var p_1 : ShadowPoint_0;
    var _S4 : f32 = 1.0f / dot(row3_0, at_0);
    p_1.scale_0 = _S4;
    p_1.texel_0 = vec2<f32>(dot(row0_1, at_0), dot(row1_1, at_0)) * vec2<f32>(_S4);
    p_1.distance_0 = dot(row2_1, at_0);
    return p_1;
}

fn shadow_corner_0( at_1 : u32) -> ShadowPoint_0
{
    var world_0 : Rows4_0;
    world_0.row0_0 = ShadowMeshConstants_0.world_row0_0;
    world_0.row1_0 = ShadowMeshConstants_0.world_row1_0;
    world_0.row2_0 = ShadowMeshConstants_0.world_row2_0;
    return shadow_point_0(transform_point_0(world_0, Mesh_0[corner_code_0(ShadowMeshConstants_0.corners_0, at_1, ShadowMeshConstants_0.corners_width_0)].xyz), ShadowMeshConstants_0.shadow_row0_0, ShadowMeshConstants_0.shadow_row1_0, ShadowMeshConstants_0.shadow_row2_0, ShadowMeshConstants_0.shadow_row3_0);
}

fn shadow_side_0( from_0 : vec2<f32>,  to_0 : vec2<f32>,  at_2 : vec2<f32>) -> f32
{
    var _S5 : f32 = from_0.x;
    var _S6 : f32 = from_0.y;
    return (to_0.x - _S5) * (at_2.y - _S6) - (to_0.y - _S6) * (at_2.x - _S5);
}

@compute
@workgroup_size(64, 1, 1)
fn shadow_mesh(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var t_0 : u32 = id_0.x;
    if(t_0 >= (ShadowMeshConstants_0.triangles_0))
    {
        return;
    }
    var a_0 : ShadowPoint_0 = shadow_corner_0(t_0);
    var b_0 : ShadowPoint_0 = shadow_corner_0(ShadowMeshConstants_0.triangles_0 + t_0);
    var c_0 : ShadowPoint_0 = shadow_corner_0(u32(2) * ShadowMeshConstants_0.triangles_0 + t_0);
    var area_0 : f32 = shadow_side_0(a_0.texel_0, b_0.texel_0, c_0.texel_0);
    var _S7 : bool;
    if(!((min(a_0.distance_0, min(b_0.distance_0, c_0.distance_0))) > 0.0f))
    {
        _S7 = true;
    }
    else
    {
        _S7 = !((abs(area_0)) > 0.0f);
    }
    if(_S7)
    {
        return;
    }
    var low_0 : vec2<f32> = clamp(ceil(min(a_0.texel_0, min(b_0.texel_0, c_0.texel_0))), vec2<f32>(0.0f), vec2<f32>(256.0f));
    var _S8 : vec2<f32> = clamp(floor(max(a_0.texel_0, max(b_0.texel_0, c_0.texel_0))), vec2<f32>(-1.0f), min(low_0 + vec2<f32>(128.0f), vec2<f32>(255.0f)));
    var y_0 : f32 = low_0.y;
    for(;;)
    {
        if(y_0 <= (_S8.y))
        {
        }
        else
        {
            break;
        }
        var x_1 : f32 = low_0.x;
        for(;;)
        {
            if(x_1 <= (_S8.x))
            {
            }
            else
            {
                break;
            }
            var at_3 : vec2<f32> = vec2<f32>(x_1, y_0);
            var u_0 : f32 = shadow_side_0(b_0.texel_0, c_0.texel_0, at_3) / area_0;
            var v_0 : f32 = shadow_side_0(c_0.texel_0, a_0.texel_0, at_3) / area_0;
            var w_0 : f32 = shadow_side_0(a_0.texel_0, b_0.texel_0, at_3) / area_0;
            if((min(u_0, min(v_0, w_0))) >= 0.0f)
            {
                var _S9 : u32 = atomicMin(&(Shadow_0[u32(y_0) * u32(256) + u32(x_1)]), (bitcast<u32>((u_0 * a_0.distance_0 + v_0 * b_0.distance_0 + w_0 * c_0.distance_0))));
            }
            x_1 = x_1 + 1.0f;
        }
        y_0 = y_0 + 1.0f;
    }
    return;
}

