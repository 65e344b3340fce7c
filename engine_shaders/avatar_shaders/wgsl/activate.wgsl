// Generated from hlsl/activate.hlsl, entry activate, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_ActivateConstants_std140_0
{
    @align(16) count_0 : u32,
};

@binding(8) @group(0) var<uniform> ActivateConstants_0 : SLANG_ParameterGroup_ActivateConstants_std140_0;
@binding(0) @group(0) var<storage, read_write> Splats_0 : array<vec4<f32>>;

fn activate_opacity_0( opacity_logit_0 : f32) -> f32
{
    var e_0 : f32 = exp(- abs(opacity_logit_0));
    var _S1 : f32;
    if(opacity_logit_0 >= 0.0f)
    {
        _S1 = 1.0f;
    }
    else
    {
        _S1 = e_0;
    }
    return _S1 / (1.0f + e_0);
}

fn activate_quat_0( quat_wxyz_0 : vec4<f32>) -> vec4<f32>
{
    return quat_wxyz_0 / vec4<f32>(max(sqrt(dot(quat_wxyz_0, quat_wxyz_0)), 9.999999960041972e-13f));
}

fn activate_scale_0( log_scale_0 : vec3<f32>) -> vec3<f32>
{
    return exp(log_scale_0);
}

@compute
@workgroup_size(64, 1, 1)
fn activate(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_0 : u32 = id_0.x;
    if(row_0 >= (ActivateConstants_0.count_0))
    {
        return;
    }
    Splats_0[row_0] = vec4<f32>(Splats_0[row_0].xyz, activate_opacity_0(Splats_0[row_0].w));
    Splats_0[ActivateConstants_0.count_0 + row_0] = activate_quat_0(Splats_0[ActivateConstants_0.count_0 + row_0]);
    var row1_0 : vec4<f32> = Splats_0[u32(3) * ActivateConstants_0.count_0 + row_0];
    var row2_0 : vec4<f32> = Splats_0[u32(4) * ActivateConstants_0.count_0 + row_0];
    var scale_0 : vec3<f32> = activate_scale_0(vec3<f32>(Splats_0[u32(2) * ActivateConstants_0.count_0 + row_0].w, Splats_0[u32(3) * ActivateConstants_0.count_0 + row_0].w, Splats_0[u32(4) * ActivateConstants_0.count_0 + row_0].w));
    Splats_0[u32(2) * ActivateConstants_0.count_0 + row_0] = vec4<f32>(Splats_0[u32(2) * ActivateConstants_0.count_0 + row_0].xyz, scale_0.x);
    Splats_0[u32(3) * ActivateConstants_0.count_0 + row_0] = vec4<f32>(row1_0.xyz, scale_0.y);
    Splats_0[u32(4) * ActivateConstants_0.count_0 + row_0] = vec4<f32>(row2_0.xyz, scale_0.z);
    return;
}

