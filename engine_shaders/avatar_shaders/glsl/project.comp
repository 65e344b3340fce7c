#version 310 es
// Generated from hlsl/project.hlsl, entry project, by `python -m avatar_shaders`; do not edit.
// Tools: glslang 11:12.0.0, spirv-cross 2021.01.15+1.3.239.0-1
layout(local_size_x = 64, local_size_y = 1, local_size_z = 1) in;

struct Rows3
{
    vec3 row0;
    vec3 row1;
    vec3 row2;
};

struct Rows4
{
    vec4 row0;
    vec4 row1;
    vec4 row2;
};

struct Covariance
{
    float xx;
    float xy;
    float xz;
    float yy;
    float yz;
    float zz;
};

struct SplatCamera
{
    Rows4 camera_from_world;
    vec4 clip_x;
    vec4 clip_y;
    vec4 clip_z;
    vec4 clip_w;
    vec2 tan_half_fov;
    vec2 size;
    float low_pass;
    float near_z;
};

struct SeenSplat
{
    vec2 centre;
    float depth;
    vec3 conic;
    float radius;
    float clip_depth;
};

layout(binding = 8, std140) uniform ProjectConstants
{
    uint count;
    uint sh_degree;
    float near_z;
    float low_pass;
    vec4 camera_row0;
    vec4 camera_row1;
    vec4 camera_row2;
    vec4 clip_row0;
    vec4 clip_row1;
    vec4 clip_row2;
    vec4 clip_row3;
    vec4 eye;
    vec2 tan_half_fov;
    vec2 image_size;
} constants;

layout(binding = 1, std430) readonly buffer Sh
{
    float _data[];
} Sh_1;

layout(binding = 0, std430) readonly buffer Splats
{
    vec4 _data[];
} Splats_1;

layout(binding = 2, std430) buffer Projected
{
    vec4 _data[];
} Projected_1;

SplatCamera project_camera()
{
    SplatCamera camera;
    camera.camera_from_world.row0 = constants.camera_row0;
    camera.camera_from_world.row1 = constants.camera_row1;
    camera.camera_from_world.row2 = constants.camera_row2;
    camera.clip_x = constants.clip_row0;
    camera.clip_y = constants.clip_row1;
    camera.clip_z = constants.clip_row2;
    camera.clip_w = constants.clip_row3;
    camera.tan_half_fov = constants.tan_half_fov;
    camera.size = constants.image_size;
    camera.low_pass = constants.low_pass;
    camera.near_z = constants.near_z;
    return camera;
}

vec3 transform_point(Rows4 m, vec3 p)
{
    return vec3((((m.row0.x * p.x) + (m.row0.y * p.y)) + (m.row0.z * p.z)) + m.row0.w, (((m.row1.x * p.x) + (m.row1.y * p.y)) + (m.row1.z * p.z)) + m.row1.w, (((m.row2.x * p.x) + (m.row2.y * p.y)) + (m.row2.z * p.z)) + m.row2.w);
}

Rows3 matrix_from_quat(vec4 q)
{
    float w = q.x;
    float x = q.y;
    float y = q.z;
    float z = q.w;
    Rows3 r;
    r.row0 = vec3(1.0 - (2.0 * ((y * y) + (z * z))), 2.0 * ((x * y) - (w * z)), 2.0 * ((x * z) + (w * y)));
    r.row1 = vec3(2.0 * ((x * y) + (w * z)), 1.0 - (2.0 * ((x * x) + (z * z))), 2.0 * ((y * z) - (w * x)));
    r.row2 = vec3(2.0 * ((x * z) - (w * y)), 2.0 * ((y * z) + (w * x)), 1.0 - (2.0 * ((x * x) + (y * y))));
    return r;
}

Covariance covariance(vec3 scale, vec4 quat_wxyz)
{
    vec4 param = quat_wxyz;
    Rows3 r = matrix_from_quat(param);
    vec3 m0 = r.row0 * scale;
    vec3 m1 = r.row1 * scale;
    vec3 m2 = r.row2 * scale;
    Covariance s;
    s.xx = dot(m0, m0);
    s.xy = dot(m0, m1);
    s.xz = dot(m0, m2);
    s.yy = dot(m1, m1);
    s.yz = dot(m1, m2);
    s.zz = dot(m2, m2);
    return s;
}

float project_form(vec3 a, Covariance s, vec3 b)
{
    float x = ((a.x * s.xx) + (a.y * s.xy)) + (a.z * s.xz);
    float y = ((a.x * s.xy) + (a.y * s.yy)) + (a.z * s.yz);
    float z = ((a.x * s.xz) + (a.y * s.yz)) + (a.z * s.zz);
    return ((x * b.x) + (y * b.y)) + (z * b.z);
}

vec3 projected_covariance(vec3 p, Covariance s, SplatCamera camera)
{
    vec2 focal = camera.size / (camera.tan_half_fov * 2.0);
    vec2 limit = camera.tan_half_fov * 1.2999999523162841796875;
    vec2 xy = min(limit, max(-limit, p.xy / vec2(p.z))) * p.z;
    vec3 w0 = camera.camera_from_world.row0.xyz;
    vec3 w1 = camera.camera_from_world.row1.xyz;
    vec3 w2 = camera.camera_from_world.row2.xyz;
    vec3 t0 = (w0 * (focal.x / p.z)) + (w2 * ((-(focal.x * xy.x)) / (p.z * p.z)));
    vec3 t1 = (w1 * (focal.y / p.z)) + (w2 * ((-(focal.y * xy.y)) / (p.z * p.z)));
    vec3 param = t0;
    Covariance param_1 = s;
    vec3 param_2 = t0;
    vec3 param_3 = t1;
    Covariance param_4 = s;
    vec3 param_5 = t0;
    vec3 param_6 = t1;
    Covariance param_7 = s;
    vec3 param_8 = t1;
    return vec3(project_form(param, param_1, param_2) + camera.low_pass, project_form(param_3, param_4, param_5), project_form(param_6, param_7, param_8) + camera.low_pass);
}

bool is_finite(float x)
{
    return (floatBitsToUint(x) & 2139095040u) != 2139095040u;
}

bool touches_image(vec2 centre, float extent, vec2 size)
{
    vec2 grid = ceil(size / vec2(16.0));
    vec2 low = clamp((centre - vec2(extent)) / vec2(16.0), vec2(-1000000.0), vec2(1000000.0));
    vec2 high = clamp((((centre + vec2(extent)) + vec2(16.0)) - vec2(1.0)) / vec2(16.0), vec2(-1000000.0), vec2(1000000.0));
    low = clamp(trunc(low), vec2(0.0), grid);
    high = clamp(trunc(high), vec2(0.0), grid);
    return (high.x > low.x) && (high.y > low.y);
}

SeenSplat project_splat(vec3 mean, vec3 scale, vec4 quat_wxyz, SplatCamera camera)
{
    Rows4 param = camera.camera_from_world;
    vec3 param_1 = mean;
    vec3 p = transform_point(param, param_1);
    vec3 param_2 = scale;
    vec4 param_3 = quat_wxyz;
    vec3 param_4 = p;
    Covariance param_5 = covariance(param_2, param_3);
    SplatCamera param_6 = camera;
    vec3 cov = projected_covariance(param_4, param_5, param_6);
    float det = (cov.x * cov.z) - (cov.y * cov.y);
    float mid = 0.5 * (cov.x + cov.z);
    float root = sqrt(max(0.100000001490116119384765625, (mid * mid) - det));
    float radius = ceil(3.0 * sqrt(max(mid + root, mid - root)));
    vec4 at = vec4(mean, 1.0);
    float reciprocal = 1.0 / (dot(camera.clip_w, at) + 1.0000000116860974230803549289703e-07);
    vec2 ndc = vec2(dot(camera.clip_x, at), dot(camera.clip_y, at)) * reciprocal;
    SeenSplat seen;
    seen.centre = (ndc * (camera.size * 0.5)) + ((camera.size * 0.5) - vec2(0.5));
    seen.depth = p.z;
    seen.conic = vec3(cov.z, -cov.y, cov.x) * (1.0 / det);
    float param_7 = det;
    float param_8 = radius;
    float param_9 = seen.centre.x + seen.centre.y;
    bool sound = ((is_finite(param_7) && (abs(det) > 0.0)) && is_finite(param_8)) && is_finite(param_9);
    vec2 param_10 = seen.centre;
    float param_11 = radius;
    vec2 param_12 = camera.size;
    bool drawn = (sound && (p.z > camera.near_z)) && touches_image(param_10, param_11, param_12);
    seen.radius = drawn ? radius : 0.0;
    seen.clip_depth = clamp(dot(camera.clip_z, at) * reciprocal, 0.0, 1.0);
    return seen;
}

vec3 rotate_inverse(Rows3 m, vec3 v)
{
    return ((m.row0 * v.x) + (m.row1 * v.y)) + (m.row2 * v.z);
}

vec3 sh_coefficient(uint k, uint row)
{
    uint at = ((3u * k) * constants.count) + row;
    return vec3(Sh_1._data[at], Sh_1._data[at + constants.count], Sh_1._data[at + (2u * constants.count)]);
}

vec3 sh_band0(vec3 k0)
{
    return k0 * 0.2820948064327239990234375;
}

vec3 sh_band1(vec3 d, vec3 k1, vec3 k2, vec3 k3)
{
    return ((k1 * ((-0.48860251903533935546875) * d.y)) + (k2 * (0.48860251903533935546875 * d.z))) + (k3 * ((-0.48860251903533935546875) * d.x));
}

vec3 sh_band2(vec3 d, vec3 k4, vec3 k5, vec3 k6, vec3 k7, vec3 k8)
{
    float xx = d.x * d.x;
    float yy = d.y * d.y;
    float zz = d.z * d.z;
    return ((((k4 * (1.09254848957061767578125 * (d.x * d.y))) + (k5 * ((-1.09254848957061767578125) * (d.y * d.z)))) + (k6 * (0.3153915703296661376953125 * (((2.0 * zz) - xx) - yy)))) + (k7 * ((-1.09254848957061767578125) * (d.x * d.z)))) + (k8 * (0.546274244785308837890625 * (xx - yy)));
}

vec3 sh_band3(vec3 d, vec3 k9, vec3 k10, vec3 k11, vec3 k12, vec3 k13, vec3 k14, vec3 k15)
{
    float xx = d.x * d.x;
    float yy = d.y * d.y;
    float zz = d.z * d.z;
    vec3 _564 = ((((((k9 * (((-0.590043604373931884765625) * d.y) * ((3.0 * xx) - yy))) + (k10 * ((2.8906114101409912109375 * (d.x * d.y)) * d.z))) + (k11 * (((-0.4570457935333251953125) * d.y) * (((4.0 * zz) - xx) - yy)))) + (k12 * ((0.3731763362884521484375 * d.z) * (((2.0 * zz) - (3.0 * xx)) - (3.0 * yy))))) + (k13 * (((-0.4570457935333251953125) * d.x) * (((4.0 * zz) - xx) - yy)))) + (k14 * ((1.44530570507049560546875 * d.z) * (xx - yy)))) + (k15 * (((-0.590043604373931884765625) * d.x) * (xx - (3.0 * yy))));
    return _564;
}

vec3 splat_colour(vec3 d, uint row)
{
    uint param = 0u;
    uint param_1 = row;
    vec3 param_2 = sh_coefficient(param, param_1);
    vec3 colour = sh_band0(param_2);
    if (constants.sh_degree > 0u)
    {
        uint param_3 = 1u;
        uint param_4 = row;
        uint param_5 = 2u;
        uint param_6 = row;
        uint param_7 = 3u;
        uint param_8 = row;
        vec3 param_9 = d;
        vec3 param_10 = sh_coefficient(param_3, param_4);
        vec3 param_11 = sh_coefficient(param_5, param_6);
        vec3 param_12 = sh_coefficient(param_7, param_8);
        colour += sh_band1(param_9, param_10, param_11, param_12);
    }
    if (constants.sh_degree > 1u)
    {
        uint param_13 = 4u;
        uint param_14 = row;
        uint param_15 = 5u;
        uint param_16 = row;
        uint param_17 = 6u;
        uint param_18 = row;
        uint param_19 = 7u;
        uint param_20 = row;
        uint param_21 = 8u;
        uint param_22 = row;
        vec3 param_23 = d;
        vec3 param_24 = sh_coefficient(param_13, param_14);
        vec3 param_25 = sh_coefficient(param_15, param_16);
        vec3 param_26 = sh_coefficient(param_17, param_18);
        vec3 param_27 = sh_coefficient(param_19, param_20);
        vec3 param_28 = sh_coefficient(param_21, param_22);
        colour += sh_band2(param_23, param_24, param_25, param_26, param_27, param_28);
    }
    if (constants.sh_degree > 2u)
    {
        uint param_29 = 9u;
        uint param_30 = row;
        uint param_31 = 10u;
        uint param_32 = row;
        uint param_33 = 11u;
        uint param_34 = row;
        uint param_35 = 12u;
        uint param_36 = row;
        uint param_37 = 13u;
        uint param_38 = row;
        uint param_39 = 14u;
        uint param_40 = row;
        uint param_41 = 15u;
        uint param_42 = row;
        vec3 param_43 = d;
        vec3 param_44 = sh_coefficient(param_29, param_30);
        vec3 param_45 = sh_coefficient(param_31, param_32);
        vec3 param_46 = sh_coefficient(param_33, param_34);
        vec3 param_47 = sh_coefficient(param_35, param_36);
        vec3 param_48 = sh_coefficient(param_37, param_38);
        vec3 param_49 = sh_coefficient(param_39, param_40);
        vec3 param_50 = sh_coefficient(param_41, param_42);
        colour += sh_band3(param_43, param_44, param_45, param_46, param_47, param_48, param_49, param_50);
    }
    return max(colour + vec3(0.5), vec3(0.0));
}

void _project(uvec3 id)
{
    uint row = id.x;
    if (row >= constants.count)
    {
        return;
    }
    vec4 mean = Splats_1._data[row];
    vec4 row0 = Splats_1._data[(2u * constants.count) + row];
    vec4 row1 = Splats_1._data[(3u * constants.count) + row];
    vec4 row2 = Splats_1._data[(4u * constants.count) + row];
    vec3 param = mean.xyz;
    vec3 param_1 = vec3(row0.w, row1.w, row2.w);
    vec4 param_2 = Splats_1._data[constants.count + row];
    SplatCamera param_3 = project_camera();
    SeenSplat seen = project_splat(param, param_1, param_2, param_3);
    if (!(seen.radius > 0.0))
    {
        Projected_1._data[row] = vec4(0.0);
        Projected_1._data[constants.count + row] = vec4(0.0);
        Projected_1._data[(2u * constants.count) + row] = vec4(0.0);
        return;
    }
    Rows3 sh_rotation;
    sh_rotation.row0 = row0.xyz;
    sh_rotation.row1 = row1.xyz;
    sh_rotation.row2 = row2.xyz;
    vec3 towards = mean.xyz - constants.eye.xyz;
    Rows3 param_4 = sh_rotation;
    vec3 param_5 = towards / vec3(length(towards));
    vec3 d = rotate_inverse(param_4, param_5);
    Projected_1._data[row] = vec4(seen.centre, seen.depth, mean.w);
    Projected_1._data[constants.count + row] = vec4(seen.conic, seen.radius);
    vec3 param_6 = d;
    uint param_7 = row;
    Projected_1._data[(2u * constants.count) + row] = vec4(splat_colour(param_6, param_7), seen.clip_depth);
}

void main()
{
    uvec3 id = gl_GlobalInvocationID;
    uvec3 param = id;
    _project(param);
}

