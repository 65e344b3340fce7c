// Generated from hlsl/project.hlsl, entry project, by `python -m avatar_shaders`; do not edit.
// Tools: slang 2026.14.1
struct SLANG_ParameterGroup_ProjectConstants_std140_0
{
    @align(16) count_0 : u32,
    @align(4) sh_degree_0 : u32,
    @align(8) near_z_0 : f32,
    @align(4) low_pass_0 : f32,
    @align(16) camera_row0_0 : vec4<f32>,
    @align(16) camera_row1_0 : vec4<f32>,
    @align(16) camera_row2_0 : vec4<f32>,
    @align(16) clip_row0_0 : vec4<f32>,
    @align(16) clip_row1_0 : vec4<f32>,
    @align(16) clip_row2_0 : vec4<f32>,
    @align(16) clip_row3_0 : vec4<f32>,
    @align(16) eye_0 : vec4<f32>,
    @align(16) tan_half_fov_0 : vec2<f32>,
    @align(8) image_size_0 : vec2<f32>,
};

@binding(8) @group(0) var<uniform> ProjectConstants_0 : SLANG_ParameterGroup_ProjectConstants_std140_0;
@binding(0) @group(0) var<storage, read> Splats_0 : array<vec4<f32>>;

@binding(2) @group(0) var<storage, read_write> Projected_0 : array<vec4<f32>>;

@binding(1) @group(0) var<storage, read> Sh_0 : array<f32>;

struct Rows4_0
{
     row0_0 : vec4<f32>,
     row1_0 : vec4<f32>,
     row2_0 : vec4<f32>,
};

struct SplatCamera_0
{
     camera_from_world_0 : Rows4_0,
     clip_x_0 : vec4<f32>,
     clip_y_0 : vec4<f32>,
     clip_z_0 : vec4<f32>,
     clip_w_0 : vec4<f32>,
     tan_half_fov_1 : vec2<f32>,
     size_0 : vec2<f32>,
     low_pass_1 : f32,
     near_z_1 : f32,
};

fn project_camera_0() -> SplatCamera_0
{
    var camera_0 : SplatCamera_0;
    camera_0.camera_from_world_0.row0_0 = ProjectConstants_0.camera_row0_0;
    camera_0.camera_from_world_0.row1_0 = ProjectConstants_0.camera_row1_0;
    camera_0.camera_from_world_0.row2_0 = ProjectConstants_0.camera_row2_0;
    camera_0.clip_x_0 = ProjectConstants_0.clip_row0_0;
    camera_0.clip_y_0 = ProjectConstants_0.clip_row1_0;
    camera_0.clip_z_0 = ProjectConstants_0.clip_row2_0;
    camera_0.clip_w_0 = ProjectConstants_0.clip_row3_0;
    camera_0.tan_half_fov_1 = ProjectConstants_0.tan_half_fov_0;
    camera_0.size_0 = ProjectConstants_0.image_size_0;
    camera_0.low_pass_1 = ProjectConstants_0.low_pass_0;
    camera_0.near_z_1 = ProjectConstants_0.near_z_0;
    return camera_0;
}

fn transform_point_0( m_0 : Rows4_0,  p_0 : vec3<f32>) -> vec3<f32>
{
    var _S1 : f32 = p_0.x;
    var _S2 : f32 = p_0.y;
    var _S3 : f32 = p_0.z;
    return vec3<f32>(m_0.row0_0.x * _S1 + m_0.row0_0.y * _S2 + m_0.row0_0.z * _S3 + m_0.row0_0.w, m_0.row1_0.x * _S1 + m_0.row1_0.y * _S2 + m_0.row1_0.z * _S3 + m_0.row1_0.w, m_0.row2_0.x * _S1 + m_0.row2_0.y * _S2 + m_0.row2_0.z * _S3 + m_0.row2_0.w);
}

struct Rows3_0
{
     row0_1 : vec3<f32>,
     row1_1 : vec3<f32>,
     row2_1 : vec3<f32>,
};

fn matrix_from_quat_0( q_0 : vec4<f32>) -> Rows3_0
{
    var w_0 : f32 = q_0.x;
    var x_0 : f32 = q_0.y;
    var y_0 : f32 = q_0.z;
    var z_0 : f32 = q_0.w;
    var r_0 : Rows3_0;
    var _S4 : f32 = y_0 * y_0;
    var _S5 : f32 = z_0 * z_0;
    var _S6 : f32 = x_0 * y_0;
    var _S7 : f32 = w_0 * z_0;
    var _S8 : f32 = x_0 * z_0;
    var _S9 : f32 = w_0 * y_0;
    r_0.row0_1 = vec3<f32>(1.0f - 2.0f * (_S4 + _S5), 2.0f * (_S6 - _S7), 2.0f * (_S8 + _S9));
    var _S10 : f32 = x_0 * x_0;
    var _S11 : f32 = y_0 * z_0;
    var _S12 : f32 = w_0 * x_0;
    r_0.row1_1 = vec3<f32>(2.0f * (_S6 + _S7), 1.0f - 2.0f * (_S10 + _S5), 2.0f * (_S11 - _S12));
    r_0.row2_1 = vec3<f32>(2.0f * (_S8 - _S9), 2.0f * (_S11 + _S12), 1.0f - 2.0f * (_S10 + _S4));
    return r_0;
}

struct Covariance_0
{
     xx_0 : f32,
     xy_0 : f32,
     xz_0 : f32,
     yy_0 : f32,
     yz_0 : f32,
     zz_0 : f32,
};

fn covariance_0( scale_0 : vec3<f32>,  quat_wxyz_0 : vec4<f32>) -> Covariance_0
{
    var r_1 : Rows3_0 = matrix_from_quat_0(quat_wxyz_0);
    var m0_0 : vec3<f32> = r_1.row0_1 * scale_0;
    var m1_0 : vec3<f32> = r_1.row1_1 * scale_0;
    var m2_0 : vec3<f32> = r_1.row2_1 * scale_0;
    var s_0 : Covariance_0;
    s_0.xx_0 = dot(m0_0, m0_0);
    s_0.xy_0 = dot(m0_0, m1_0);
    s_0.xz_0 = dot(m0_0, m2_0);
    s_0.yy_0 = dot(m1_0, m1_0);
    s_0.yz_0 = dot(m1_0, m2_0);
    s_0.zz_0 = dot(m2_0, m2_0);
    return s_0;
}

fn project_form_0( a_0 : vec3<f32>,  s_1 : Covariance_0,  b_0 : vec3<f32>) -> f32
{
    var _S13 : f32 = a_0.x;
    var _S14 : f32 = a_0.y;
    var _S15 : f32 = a_0.z;
    return (_S13 * s_1.xx_0 + _S14 * s_1.xy_0 + _S15 * s_1.xz_0) * b_0.x + (_S13 * s_1.xy_0 + _S14 * s_1.yy_0 + _S15 * s_1.yz_0) * b_0.y + (_S13 * s_1.xz_0 + _S14 * s_1.yz_0 + _S15 * s_1.zz_0) * b_0.z;
}

fn projected_covariance_0( p_1 : vec3<f32>,  s_2 : Covariance_0,  camera_1 : SplatCamera_0) -> vec3<f32>
{
    var focal_0 : vec2<f32> = camera_1.size_0 / (vec2<f32>(2.0f) * camera_1.tan_half_fov_1);
    var limit_0 : vec2<f32> = vec2<f32>(1.29999995231628418f) * camera_1.tan_half_fov_1;
    var _S16 : f32 = p_1.z;
    var _S17 : vec2<f32> = vec2<f32>(_S16);
    var xy_1 : vec2<f32> = min(limit_0, max((vec2<f32>(0) - limit_0), p_1.xy / _S17)) * _S17;
    var w2_0 : vec3<f32> = camera_1.camera_from_world_0.row2_0.xyz;
    var _S18 : f32 = focal_0.x;
    var _S19 : f32 = _S16 * _S16;
    var t0_0 : vec3<f32> = camera_1.camera_from_world_0.row0_0.xyz * vec3<f32>((_S18 / _S16)) + w2_0 * vec3<f32>((- (_S18 * xy_1.x) / _S19));
    var _S20 : f32 = focal_0.y;
    var t1_0 : vec3<f32> = camera_1.camera_from_world_0.row1_0.xyz * vec3<f32>((_S20 / _S16)) + w2_0 * vec3<f32>((- (_S20 * xy_1.y) / _S19));
    return vec3<f32>(project_form_0(t0_0, s_2, t0_0) + camera_1.low_pass_1, project_form_0(t1_0, s_2, t0_0), project_form_0(t1_0, s_2, t1_0) + camera_1.low_pass_1);
}

fn is_finite_0( x_1 : f32) -> bool
{
    return (((bitcast<u32>((x_1))) & (u32(2139095040)))) != u32(2139095040);
}

fn touches_image_0( centre_0 : vec2<f32>,  extent_0 : f32,  size_1 : vec2<f32>) -> bool
{
    var _S21 : vec2<f32> = vec2<f32>(16.0f);
    var grid_0 : vec2<f32> = ceil(size_1 / _S21);
    var _S22 : vec2<f32> = vec2<f32>(extent_0);
    var _S23 : vec2<f32> = vec2<f32>(-1.0e+06f);
    var _S24 : vec2<f32> = vec2<f32>(1.0e+06f);
    const _S25 : vec2<f32> = vec2<f32>(0.0f, 0.0f);
    var low_0 : vec2<f32> = clamp(trunc(clamp((centre_0 - _S22) / _S21, _S23, _S24)), _S25, grid_0);
    var high_0 : vec2<f32> = clamp(trunc(clamp((centre_0 + _S22 + _S21 - vec2<f32>(1.0f)) / _S21, _S23, _S24)), _S25, grid_0);
    var _S26 : bool;
    if((high_0.x) > (low_0.x))
    {
        _S26 = (high_0.y) > (low_0.y);
    }
    else
    {
        _S26 = false;
    }
    return _S26;
}

struct SeenSplat_0
{
     centre_1 : vec2<f32>,
     depth_0 : f32,
     conic_0 : vec3<f32>,
     radius_0 : f32,
     clip_depth_0 : f32,
};

fn project_splat_0( mean_0 : vec3<f32>,  scale_1 : vec3<f32>,  quat_wxyz_1 : vec4<f32>,  camera_2 : SplatCamera_0) -> SeenSplat_0
{
    var p_2 : vec3<f32> = transform_point_0(camera_2.camera_from_world_0, mean_0);
    var cov_0 : vec3<f32> = projected_covariance_0(p_2, covariance_0(scale_1, quat_wxyz_1), camera_2);
    var _S27 : f32 = cov_0.x;
    var _S28 : f32 = cov_0.z;
    var _S29 : f32 = cov_0.y;
    var det_0 : f32 = _S27 * _S28 - _S29 * _S29;
    var mid_0 : f32 = 0.5f * (_S27 + _S28);
    var root_0 : f32 = sqrt(max(0.10000000149011612f, mid_0 * mid_0 - det_0));
    var radius_1 : f32 = ceil(3.0f * sqrt(max(mid_0 + root_0, mid_0 - root_0)));
    var at_0 : vec4<f32> = vec4<f32>(mean_0, 1.0f);
    var reciprocal_0 : f32 = 1.0f / (dot(camera_2.clip_w_0, at_0) + 1.00000001168609742e-07f);
    var seen_0 : SeenSplat_0;
    var _S30 : vec2<f32> = vec2<f32>(0.5f);
    var _S31 : vec2<f32> = _S30 * camera_2.size_0;
    seen_0.centre_1 = vec2<f32>(dot(camera_2.clip_x_0, at_0), dot(camera_2.clip_y_0, at_0)) * vec2<f32>(reciprocal_0) * _S31 + (_S31 - _S30);
    var _S32 : f32 = p_2.z;
    seen_0.depth_0 = _S32;
    seen_0.conic_0 = vec3<f32>(_S28, - _S29, _S27) * vec3<f32>((1.0f / det_0));
    var sound_0 : bool;
    if(is_finite_0(det_0))
    {
        sound_0 = (abs(det_0)) > 0.0f;
    }
    else
    {
        sound_0 = false;
    }
    if(sound_0)
    {
        sound_0 = is_finite_0(radius_1);
    }
    else
    {
        sound_0 = false;
    }
    if(sound_0)
    {
        sound_0 = is_finite_0(seen_0.centre_1.x + seen_0.centre_1.y);
    }
    else
    {
        sound_0 = false;
    }
    if(sound_0)
    {
        sound_0 = _S32 > (camera_2.near_z_1);
    }
    else
    {
        sound_0 = false;
    }
    var drawn_0 : bool;
    if(sound_0)
    {
        drawn_0 = touches_image_0(seen_0.centre_1, radius_1, camera_2.size_0);
    }
    else
    {
        drawn_0 = false;
    }
    var _S33 : f32;
    if(drawn_0)
    {
        _S33 = radius_1;
    }
    else
    {
        _S33 = 0.0f;
    }
    seen_0.radius_0 = _S33;
    seen_0.clip_depth_0 = saturate(dot(camera_2.clip_z_0, at_0) * reciprocal_0);
    return seen_0;
}

fn rotate_inverse_0( m_1 : Rows3_0,  v_0 : vec3<f32>) -> vec3<f32>
{
    return m_1.row0_1 * vec3<f32>(v_0.x) + m_1.row1_1 * vec3<f32>(v_0.y) + m_1.row2_1 * vec3<f32>(v_0.z);
}

fn sh_coefficient_0( k_0 : u32,  row_0 : u32) -> vec3<f32>
{
    var at_1 : u32 = u32(3) * k_0 * ProjectConstants_0.count_0 + row_0;
    return vec3<f32>(Sh_0[at_1], Sh_0[at_1 + ProjectConstants_0.count_0], Sh_0[at_1 + u32(2) * ProjectConstants_0.count_0]);
}

fn sh_band0_0( k0_0 : vec3<f32>) -> vec3<f32>
{
    return vec3<f32>(0.282094806432724f) * k0_0;
}

fn sh_band1_0( d_0 : vec3<f32>,  k1_0 : vec3<f32>,  k2_0 : vec3<f32>,  k3_0 : vec3<f32>) -> vec3<f32>
{
    return vec3<f32>((-0.48860251903533936f * d_0.y)) * k1_0 + vec3<f32>((0.48860251903533936f * d_0.z)) * k2_0 + vec3<f32>((-0.48860251903533936f * d_0.x)) * k3_0;
}

fn sh_band2_0( d_1 : vec3<f32>,  k4_0 : vec3<f32>,  k5_0 : vec3<f32>,  k6_0 : vec3<f32>,  k7_0 : vec3<f32>,  k8_0 : vec3<f32>) -> vec3<f32>
{
    var _S34 : f32 = d_1.x;
    var xx_1 : f32 = _S34 * _S34;
    var _S35 : f32 = d_1.y;
    var yy_1 : f32 = _S35 * _S35;
    var _S36 : f32 = d_1.z;
    return vec3<f32>((1.09254848957061768f * (_S34 * _S35))) * k4_0 + vec3<f32>((-1.09254848957061768f * (_S35 * _S36))) * k5_0 + vec3<f32>((0.31539157032966614f * (2.0f * (_S36 * _S36) - xx_1 - yy_1))) * k6_0 + vec3<f32>((-1.09254848957061768f * (_S34 * _S36))) * k7_0 + vec3<f32>((0.54627424478530884f * (xx_1 - yy_1))) * k8_0;
}

fn sh_band3_0( d_2 : vec3<f32>,  k9_0 : vec3<f32>,  k10_0 : vec3<f32>,  k11_0 : vec3<f32>,  k12_0 : vec3<f32>,  k13_0 : vec3<f32>,  k14_0 : vec3<f32>,  k15_0 : vec3<f32>) -> vec3<f32>
{
    var _S37 : f32 = d_2.x;
    var xx_2 : f32 = _S37 * _S37;
    var _S38 : f32 = d_2.y;
    var yy_2 : f32 = _S38 * _S38;
    var _S39 : f32 = d_2.z;
    var zz_1 : f32 = _S39 * _S39;
    var _S40 : f32 = 3.0f * xx_2;
    var _S41 : f32 = 4.0f * zz_1 - xx_2 - yy_2;
    var _S42 : f32 = 3.0f * yy_2;
    return vec3<f32>((-0.59004360437393188f * _S38 * (_S40 - yy_2))) * k9_0 + vec3<f32>((2.89061141014099121f * (_S37 * _S38) * _S39)) * k10_0 + vec3<f32>((-0.4570457935333252f * _S38 * _S41)) * k11_0 + vec3<f32>((0.37317633628845215f * _S39 * (2.0f * zz_1 - _S40 - _S42))) * k12_0 + vec3<f32>((-0.4570457935333252f * _S37 * _S41)) * k13_0 + vec3<f32>((1.44530570507049561f * _S39 * (xx_2 - yy_2))) * k14_0 + vec3<f32>((-0.59004360437393188f * _S37 * (xx_2 - _S42))) * k15_0;
}

fn splat_colour_0( d_3 : vec3<f32>,  row_1 : u32) -> vec3<f32>
{
    var colour_0 : vec3<f32> = sh_band0_0(sh_coefficient_0(u32(0), row_1));
    var colour_1 : vec3<f32>;
    if((ProjectConstants_0.sh_degree_0) > u32(0))
    {
        colour_1 = colour_0 + sh_band1_0(d_3, sh_coefficient_0(u32(1), row_1), sh_coefficient_0(u32(2), row_1), sh_coefficient_0(u32(3), row_1));
    }
    else
    {
        colour_1 = colour_0;
    }
    if((ProjectConstants_0.sh_degree_0) > u32(1))
    {
        colour_1 = colour_1 + sh_band2_0(d_3, sh_coefficient_0(u32(4), row_1), sh_coefficient_0(u32(5), row_1), sh_coefficient_0(u32(6), row_1), sh_coefficient_0(u32(7), row_1), sh_coefficient_0(u32(8), row_1));
    }
    if((ProjectConstants_0.sh_degree_0) > u32(2))
    {
        colour_1 = colour_1 + sh_band3_0(d_3, sh_coefficient_0(u32(9), row_1), sh_coefficient_0(u32(10), row_1), sh_coefficient_0(u32(11), row_1), sh_coefficient_0(u32(12), row_1), sh_coefficient_0(u32(13), row_1), sh_coefficient_0(u32(14), row_1), sh_coefficient_0(u32(15), row_1));
    }
    return max(colour_1 + vec3<f32>(0.5f), vec3<f32>(0.0f));
}

@compute
@workgroup_size(64, 1, 1)
fn project(@builtin(global_invocation_id) id_0 : vec3<u32>)
{
    var row_2 : u32 = id_0.x;
    if(row_2 >= (ProjectConstants_0.count_0))
    {
        return;
    }
    var mean_1 : vec4<f32> = Splats_0[row_2];
    var row0_2 : vec4<f32> = Splats_0[u32(2) * ProjectConstants_0.count_0 + row_2];
    var row1_2 : vec4<f32> = Splats_0[u32(3) * ProjectConstants_0.count_0 + row_2];
    var row2_2 : vec4<f32> = Splats_0[u32(4) * ProjectConstants_0.count_0 + row_2];
    var _S43 : vec3<f32> = mean_1.xyz;
    var seen_1 : SeenSplat_0 = project_splat_0(_S43, vec3<f32>(row0_2.w, row1_2.w, row2_2.w), Splats_0[ProjectConstants_0.count_0 + row_2], project_camera_0());
    if(!((seen_1.radius_0) > 0.0f))
    {
        const _S44 : vec4<f32> = vec4<f32>(0.0f, 0.0f, 0.0f, 0.0f);
        Projected_0[row_2] = _S44;
        Projected_0[ProjectConstants_0.count_0 + row_2] = _S44;
        Projected_0[u32(2) * ProjectConstants_0.count_0 + row_2] = _S44;
        return;
    }
    var sh_rotation_0 : Rows3_0;
    sh_rotation_0.row0_1 = row0_2.xyz;
    sh_rotation_0.row1_1 = row1_2.xyz;
    sh_rotation_0.row2_1 = row2_2.xyz;
    var towards_0 : vec3<f32> = _S43 - ProjectConstants_0.eye_0.xyz;
    var d_4 : vec3<f32> = rotate_inverse_0(sh_rotation_0, towards_0 / vec3<f32>(length(towards_0)));
    Projected_0[row_2] = vec4<f32>(seen_1.centre_1, seen_1.depth_0, mean_1.w);
    Projected_0[ProjectConstants_0.count_0 + row_2] = vec4<f32>(seen_1.conic_0, seen_1.radius_0);
    Projected_0[u32(2) * ProjectConstants_0.count_0 + row_2] = vec4<f32>(splat_colour_0(d_4, row_2), seen_1.clip_depth_0);
    return;
}

