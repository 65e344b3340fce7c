// Generated from hlsl/morph.hlsl, entry morph, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_MorphConstants_std140_0
{
    @align(16) first_0 : u32,
    @align(4) count_0 : u32,
    @align(8) vertices_0 : u32,
    @align(4) template_position_0 : u32,
    @align(16) template_position_width_0 : u32,
    @align(4) template_position_scale_0 : u32,
    @align(8) morph_ptr_0 : u32,
    @align(4) morph_column_0 : u32,
    @align(16) morph_column_width_0 : u32,
    @align(4) morph_position_0 : u32,
    @align(8) morph_position_width_0 : u32,
    @align(4) morph_position_step_0 : u32,
    @align(16) corrective_ptr_0 : u32,
    @align(4) corrective_column_0 : u32,
    @align(8) corrective_column_width_0 : u32,
    @align(4) corrective_position_0 : u32,
    @align(16) corrective_position_width_0 : u32,
    @align(4) corrective_position_step_0 : u32,
    @align(8) weights_0 : u32,
    @align(4) features_0 : u32,
};

@binding(8) @group(0) var<uniform> MorphConstants_0 : SLANG_ParameterGroup_MorphConstants_std140_0;
@binding(0) @group(0) var<storage, read> MorphStatic_0 : array<u32>;

@binding(2) @group(0) var<storage, read_write> Mesh_0 : array<vec4<f32>>;

@binding(1) @group(0) var<storage, read> Pose_0 : array<f32>;

fn packed_element_0( word_0 : u32,  bit_0 : u32,  width_0 : u32) -> u32
{
    return (((word_0 >> (((bit_0 & (u32(31))))))) & ((((u32(1) << (width_0))) - u32(1))));
}

fn morph_code_0( section_0 : u32,  index_0 : u32,  width_1 : u32) -> u32
{
    if(width_1 == u32(32))
    {
        return MorphStatic_0[section_0 + index_0];
    }
    var bit_1 : u32 = index_0 * width_1;
    return packed_element_0(MorphStatic_0[section_0 + ((bit_1 >> (u32(5))))], bit_1, width_1);
}

fn morph_linear_0( section_1 : u32,  index_1 : u32,  width_2 : u32,  scale_0 : u32) -> f32
{
    var code_0 : u32 = morph_code_0(section_1, index_1, width_2);
    if(width_2 == u32(32))
    {
        return (bitcast<f32>((code_0)));
    }
    return (bitcast<f32>((MorphStatic_0[scale_0]))) + (bitcast<f32>((MorphStatic_0[scale_0 + u32(1)]))) * f32(code_0);
}

fn morph_linear3_0( section_2 : u32,  index_2 : u32,  stride_0 : u32,  width_3 : u32,  scale_1 : u32) -> vec3<f32>
{
    return vec3<f32>(morph_linear_0(section_2, index_2, width_3, scale_1), morph_linear_0(section_2, index_2 + stride_0, width_3, scale_1 + u32(2)), morph_linear_0(section_2, index_2 + u32(2) * stride_0, width_3, scale_1 + u32(4)));
}

fn packed_step_count_0( code_1 : u32,  width_4 : u32) -> f32
{
    return f32(code_1) - f32((u32(1) << ((width_4 - u32(1)))));
}

fn morph_signed_0( section_3 : u32,  index_3 : u32,  width_5 : u32,  step_0 : u32) -> f32
{
    if(width_5 == u32(0))
    {
        return 0.0f;
    }
    var code_2 : u32 = morph_code_0(section_3, index_3, width_5);
    if(width_5 == u32(32))
    {
        return (bitcast<f32>((code_2)));
    }
    return (bitcast<f32>((MorphStatic_0[step_0]))) * packed_step_count_0(code_2, width_5);
}

fn morph_signed3_0( section_4 : u32,  index_4 : u32,  width_6 : u32,  step_1 : u32) -> vec3<f32>
{
    return vec3<f32>(morph_signed_0(section_4, index_4, width_6, step_1), morph_signed_0(section_4, index_4 + u32(1), width_6, step_1 + u32(1)), morph_signed_0(section_4, index_4 + u32(2), width_6, step_1 + u32(2)));
}

fn morph_add_0( position_0 : vec3<f32>,  weight_0 : f32,  delta_0 : vec3<f32>) -> vec3<f32>
{
    return position_0 + vec3<f32>(weight_0) * delta_0;
}

fn morphed_0( position_1 : vec3<f32>,  row_0 : u32) -> vec3<f32>
{
    var _S1 : u32 = MorphStatic_0[MorphConstants_0.morph_ptr_0 + row_0 + u32(1)];
    var _S2 : u32 = MorphStatic_0[MorphConstants_0.morph_ptr_0 + row_0];
    var _S3 : vec3<f32> = position_1;
    var e_0 : u32 = _S2;
    for(;;)
    {
        if(e_0 < _S1)
        {
        }
        else
        {
            break;
        }
        var column_0 : u32 = morph_code_0(MorphConstants_0.morph_column_0, e_0, MorphConstants_0.morph_column_width_0);
        var weight_1 : f32 = Pose_0[MorphConstants_0.weights_0 + column_0];
        if(weight_1 != 0.0f)
        {
            _S3 = morph_add_0(_S3, weight_1, morph_signed3_0(MorphConstants_0.morph_position_0, u32(3) * e_0, MorphConstants_0.morph_position_width_0, MorphConstants_0.morph_position_step_0 + u32(3) * column_0));
        }
        e_0 = e_0 + u32(1);
    }
    return _S3;
}

fn corrected_0( position_2 : vec3<f32>,  row_1 : u32) -> vec3<f32>
{
    var _S4 : u32 = MorphStatic_0[MorphConstants_0.corrective_ptr_0 + row_1 + u32(1)];
    var _S5 : u32 = MorphStatic_0[MorphConstants_0.corrective_ptr_0 + row_1];
    var _S6 : vec3<f32> = position_2;
    var e_1 : u32 = _S5;
    for(;;)
    {
        if(e_1 < _S4)
        {
        }
        else
        {
            break;
        }
        var column_1 : u32 = morph_code_0(MorphConstants_0.corrective_column_0, e_1, MorphConstants_0.corrective_column_width_0);
        var feature_0 : f32 = Pose_0[MorphConstants_0.features_0 + column_1];
        if(feature_0 != 0.0f)
        {
            _S6 = morph_add_0(_S6, feature_0, morph_signed3_0(MorphConstants_0.corrective_position_0, u32(3) * e_1, MorphConstants_0.corrective_position_width_0, MorphConstants_0.corrective_position_step_0 + u32(3) * column_1));
        }
        e_1 = e_1 + u32(1);
    }
    return _S6;
}

@compute
@workgroup_size(64, 1, 1)
fn morph(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_2 : u32 = id_0.x;
    if(row_2 >= (MorphConstants_0.count_0))
    {
        return;
    }
    Mesh_0[MorphConstants_0.first_0 + row_2] = vec4<f32>(corrected_0(morphed_0(morph_linear3_0(MorphConstants_0.template_position_0, row_2, MorphConstants_0.count_0, MorphConstants_0.template_position_width_0, MorphConstants_0.template_position_scale_0), row_2), row_2), 1.0f);
    return;
}

