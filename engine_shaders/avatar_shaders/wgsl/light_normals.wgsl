// Generated from hlsl/light_normals.hlsl, entry light_normals, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_LightNormalsConstants_std140_0
{
    @align(16) world_quat_wxyz_0 : vec4<f32>,
    @align(16) count_0 : u32,
    @align(4) triangles_0 : u32,
    @align(8) triangle_ids_0 : u32,
    @align(4) triangle_ids_width_0 : u32,
    @align(16) local_quat_0 : u32,
    @align(4) local_quat_width_0 : u32,
    @align(8) local_quat_scale_0 : u32,
    @align(4) normal_0 : u32,
    @align(16) normal_width_0 : u32,
    @align(4) normal_scale_0 : u32,
};

@binding(8) @group(0) var<uniform> LightNormalsConstants_0 : SLANG_ParameterGroup_LightNormalsConstants_std140_0;
@binding(0) @group(0) var<storage, read> EmbedStatic_0 : array<u32>;

@binding(2) @group(0) var<storage, read> Triangles_0 : array<vec4<f32>>;

@binding(1) @group(0) var<storage, read> LightStatic_0 : array<u32>;

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

fn light_code_0( section_3 : u32,  index_3 : u32,  width_4 : u32) -> u32
{
    if(width_4 == u32(32))
    {
        return LightStatic_0[section_3 + index_3];
    }
    var bit_2 : u32 = index_3 * width_4;
    return packed_element_0(LightStatic_0[section_3 + ((bit_2 >> (u32(5))))], bit_2, width_4);
}

fn light_linear_0( section_4 : u32,  index_4 : u32,  width_5 : u32,  scale_2 : u32) -> f32
{
    var code_1 : u32 = light_code_0(section_4, index_4, width_5);
    if(width_5 == u32(32))
    {
        return (bitcast<f32>((code_1)));
    }
    return (bitcast<f32>((LightStatic_0[scale_2]))) + (bitcast<f32>((LightStatic_0[scale_2 + u32(1)]))) * f32(code_1);
}

fn light_linear3_0( section_5 : u32,  index_5 : u32,  stride_1 : u32,  width_6 : u32,  scale_3 : u32) -> vec3<f32>
{
    return vec3<f32>(light_linear_0(section_5, index_5, width_6, scale_3), light_linear_0(section_5, index_5 + stride_1, width_6, scale_3 + u32(2)), light_linear_0(section_5, index_5 + u32(2) * stride_1, width_6, scale_3 + u32(4)));
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

@compute
@workgroup_size(64, 1, 1)
fn light_normals(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_0 : u32 = id_0.x;
    if(row_0 >= (LightNormalsConstants_0.count_0))
    {
        return;
    }
    var own_0 : vec4<f32> = vec4<f32>(embed_linear_0(LightNormalsConstants_0.local_quat_0, row_0, LightNormalsConstants_0.local_quat_width_0, LightNormalsConstants_0.local_quat_scale_0), embed_linear3_0(LightNormalsConstants_0.local_quat_0, LightNormalsConstants_0.count_0 + row_0, LightNormalsConstants_0.count_0, LightNormalsConstants_0.local_quat_width_0, LightNormalsConstants_0.local_quat_scale_0 + u32(2)));
    Splats_0[u32(5) * LightNormalsConstants_0.count_0 + row_0] = vec4<f32>(rotate_0(matrix_from_quat_0(LightNormalsConstants_0.world_quat_wxyz_0), rotate_0(matrix_from_quat_0(Triangles_0[LightNormalsConstants_0.triangles_0 + embed_code_0(LightNormalsConstants_0.triangle_ids_0, row_0, LightNormalsConstants_0.triangle_ids_width_0)]), rotate_0(matrix_from_quat_0(own_0 / vec4<f32>(max(length(own_0), 9.999999960041972e-13f))), light_linear3_0(LightNormalsConstants_0.normal_0, row_0, LightNormalsConstants_0.count_0, LightNormalsConstants_0.normal_width_0, LightNormalsConstants_0.normal_scale_0)))), 0.0f);
    return;
}

