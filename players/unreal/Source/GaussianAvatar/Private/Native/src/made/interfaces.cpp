// Copy of players/native/src/made/interfaces.cpp by `python -m avatar_shaders`; do not edit.
// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#include "../pack/contracts.h"

namespace avatar {
namespace {

const StorageBuffer morph_storage[] = {
    {"MorphStatic", 0, 4, true},
    {"Pose", 1, 4, true},
    {"Mesh", 2, 16, false},
};
const Member morph_members[] = {
    {"first", 0, ConstantType::uint},
    {"count", 4, ConstantType::uint},
    {"vertices", 8, ConstantType::uint},
    {"template_position", 12, ConstantType::uint},
    {"template_position_width", 16, ConstantType::uint},
    {"template_position_scale", 20, ConstantType::uint},
    {"morph_ptr", 24, ConstantType::uint},
    {"morph_column", 28, ConstantType::uint},
    {"morph_column_width", 32, ConstantType::uint},
    {"morph_position", 36, ConstantType::uint},
    {"morph_position_width", 40, ConstantType::uint},
    {"morph_position_step", 44, ConstantType::uint},
    {"corrective_ptr", 48, ConstantType::uint},
    {"corrective_column", 52, ConstantType::uint},
    {"corrective_column_width", 56, ConstantType::uint},
    {"corrective_position", 60, ConstantType::uint},
    {"corrective_position_width", 64, ConstantType::uint},
    {"corrective_position_step", 68, ConstantType::uint},
    {"weights", 72, ConstantType::uint},
    {"features", 76, ConstantType::uint},
};
const Most morph_0[] = {
    {"count", 4194240},
    {"vertices", 16777216},
};
const NamePair morph_1[] = {
    {"first+count", "vertices"},
};
const NamePair morph_2[] = {
    {"weights", "weights"},
    {"features", "features"},
};
const char* const morph_3[] = {
    "vertices",
};
const Same morph_4[] = {
    {"Mesh", {morph_3, 1}},
};
const Touched morph_5[] = {
    {"Mesh", "3*vertices", {nullptr, 0}},
};
const uint32_t morph_6[] = {0, 8, 16, 32};
const uint32_t morph_7[] = {32};
const uint32_t morph_8[] = {8, 16, 32};
const SectionContract morph_9[] = {
    {"template_position", "MorphStatic", SectionKind::linear, "3*count", "template_position_width", {morph_6, 4}, nullptr, 0, "template_position_scale", "2*3", {nullptr, 0}},
    {"morph_ptr", "MorphStatic", SectionKind::pointer, "count+1", nullptr, {morph_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"morph_column", "MorphStatic", SectionKind::index, "#morph_ptr", "morph_column_width", {morph_8, 3}, "#weights", 0, nullptr, nullptr, {nullptr, 0}},
    {"morph_position", "MorphStatic", SectionKind::signed_, "3*#morph_ptr", "morph_position_width", {morph_6, 4}, nullptr, 0, "morph_position_step", "3*#weights", {nullptr, 0}},
    {"corrective_ptr", "MorphStatic", SectionKind::pointer, "count+1", nullptr, {morph_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"corrective_column", "MorphStatic", SectionKind::index, "#corrective_ptr", "corrective_column_width", {morph_8, 3}, "#features", 0, nullptr, nullptr, {nullptr, 0}},
    {"corrective_position", "MorphStatic", SectionKind::signed_, "3*#corrective_ptr", "corrective_position_width", {morph_6, 4}, nullptr, 0, "corrective_position_step", "3*#features", {nullptr, 0}},
};
const Contract morph_access = {
    "count",
    {morph_0, 2},
    {nullptr, 0},
    {morph_1, 1},
    {morph_2, 2},
    {morph_4, 1},
    nullptr,
    {nullptr, 0},
    {morph_5, 1},
    {morph_9, 7},
};

const StorageBuffer skin_storage[] = {
    {"SkinStatic", 0, 4, true},
    {"Pose", 1, 4, true},
    {"Mesh", 2, 16, false},
};
const Member skin_members[] = {
    {"first", 0, ConstantType::uint},
    {"count", 4, ConstantType::uint},
    {"late_ptr", 8, ConstantType::uint},
    {"late_column", 12, ConstantType::uint},
    {"late_column_width", 16, ConstantType::uint},
    {"late_position", 20, ConstantType::uint},
    {"late_position_width", 24, ConstantType::uint},
    {"late_position_step", 28, ConstantType::uint},
    {"skin_ptr", 32, ConstantType::uint},
    {"skin_column", 36, ConstantType::uint},
    {"skin_column_width", 40, ConstantType::uint},
    {"skin_weight", 44, ConstantType::uint},
    {"skin_weight_width", 48, ConstantType::uint},
    {"skin_weight_step", 52, ConstantType::uint},
    {"late", 56, ConstantType::uint},
    {"joints", 60, ConstantType::uint},
};
const Most skin_0[] = {
    {"count", 4194240},
};
const NamePair skin_1[] = {
    {"late", "late"},
    {"joints", "joints"},
};
const Touched skin_2[] = {
    {"Mesh", "first+count", {nullptr, 0}},
};
const uint32_t skin_3[] = {32};
const uint32_t skin_4[] = {8, 16, 32};
const uint32_t skin_5[] = {0, 8, 16, 32};
const SectionContract skin_6[] = {
    {"late_ptr", "SkinStatic", SectionKind::pointer, "count+1", nullptr, {skin_3, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"late_column", "SkinStatic", SectionKind::index, "#late_ptr", "late_column_width", {skin_4, 3}, "#late", 0, nullptr, nullptr, {nullptr, 0}},
    {"late_position", "SkinStatic", SectionKind::signed_, "3*#late_ptr", "late_position_width", {skin_5, 4}, nullptr, 0, "late_position_step", "3*#late", {nullptr, 0}},
    {"skin_ptr", "SkinStatic", SectionKind::pointer, "count+1", nullptr, {skin_3, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"skin_column", "SkinStatic", SectionKind::index, "#skin_ptr", "skin_column_width", {skin_4, 3}, "#joints", 0, nullptr, nullptr, {nullptr, 0}},
    {"skin_weight", "SkinStatic", SectionKind::weight, "#skin_ptr", "skin_weight_width", {skin_5, 4}, nullptr, 0, "skin_weight_step", "1", {nullptr, 0}},
};
const Contract skin_access = {
    "count",
    {skin_0, 1},
    {nullptr, 0},
    {nullptr, 0},
    {skin_1, 2},
    {nullptr, 0},
    nullptr,
    {nullptr, 0},
    {skin_2, 1},
    {skin_6, 6},
};

const StorageBuffer blend_storage[] = {
    {"BlendStatic", 0, 4, true},
    {"Pose", 1, 4, true},
    {"Splats", 2, 16, false},
    {"Sh", 3, 4, false},
};
const Member blend_members[] = {
    {"count", 0, ConstantType::uint},
    {"sh_terms", 4, ConstantType::uint},
    {"weights", 8, ConstantType::uint},
    {"base_mean", 12, ConstantType::uint},
    {"base_mean_width", 16, ConstantType::uint},
    {"base_mean_scale", 20, ConstantType::uint},
    {"base_log_scale", 24, ConstantType::uint},
    {"base_log_scale_width", 28, ConstantType::uint},
    {"base_log_scale_scale", 32, ConstantType::uint},
    {"base_quat", 36, ConstantType::uint},
    {"base_quat_width", 40, ConstantType::uint},
    {"base_quat_scale", 44, ConstantType::uint},
    {"base_opacity", 48, ConstantType::uint},
    {"base_opacity_width", 52, ConstantType::uint},
    {"base_opacity_table", 56, ConstantType::uint},
    {"base_sh", 60, ConstantType::uint},
    {"base_sh_width", 64, ConstantType::uint},
    {"base_sh_scale", 68, ConstantType::uint},
    {"geometry_ptr", 72, ConstantType::uint},
    {"geometry_column", 76, ConstantType::uint},
    {"geometry_column_width", 80, ConstantType::uint},
    {"geometry_mean", 84, ConstantType::uint},
    {"geometry_mean_width", 88, ConstantType::uint},
    {"geometry_mean_step", 92, ConstantType::uint},
    {"geometry_quat", 96, ConstantType::uint},
    {"geometry_quat_width", 100, ConstantType::uint},
    {"geometry_quat_step", 104, ConstantType::uint},
    {"appearance_ptr", 108, ConstantType::uint},
    {"appearance_column", 112, ConstantType::uint},
    {"appearance_column_width", 116, ConstantType::uint},
    {"appearance_log_scale", 120, ConstantType::uint},
    {"appearance_log_scale_width", 124, ConstantType::uint},
    {"appearance_log_scale_step", 128, ConstantType::uint},
    {"appearance_opacity", 132, ConstantType::uint},
    {"appearance_opacity_width", 136, ConstantType::uint},
    {"appearance_opacity_step", 140, ConstantType::uint},
    {"appearance_sh", 144, ConstantType::uint},
    {"appearance_sh_width", 148, ConstantType::uint},
    {"appearance_sh_step", 152, ConstantType::uint},
    {"unused", 156, ConstantType::uint},
};
const Most blend_0[] = {
    {"count", 4194240},
};
const uint32_t blend_1[] = {1, 4, 9, 16};
const Values blend_2[] = {
    {"sh_terms", {blend_1, 4}},
};
const NamePair blend_3[] = {
    {"weights", "weights"},
};
const char* const blend_4[] = {
    "count",
};
const Same blend_5[] = {
    {"Splats", {blend_4, 1}},
    {"Sh", {blend_4, 1}},
};
const char* const blend_6[] = {
    "sh_terms",
};
const Touched blend_7[] = {
    {"Splats", "5*count", {nullptr, 0}},
    {"Sh", "3*sh_terms*count", {nullptr, 0}},
};
const uint32_t blend_8[] = {0, 8, 16, 32};
const uint32_t blend_9[] = {32};
const uint32_t blend_10[] = {8, 16, 32};
const SectionContract blend_11[] = {
    {"base_mean", "BlendStatic", SectionKind::linear, "3*count", "base_mean_width", {blend_8, 4}, nullptr, 0, "base_mean_scale", "2*3", {nullptr, 0}},
    {"base_log_scale", "BlendStatic", SectionKind::linear, "3*count", "base_log_scale_width", {blend_8, 4}, nullptr, 0, "base_log_scale_scale", "2*3", {nullptr, 0}},
    {"base_quat", "BlendStatic", SectionKind::linear, "4*count", "base_quat_width", {blend_8, 4}, nullptr, 0, "base_quat_scale", "2*4", {nullptr, 0}},
    {"base_opacity", "BlendStatic", SectionKind::table, "count", "base_opacity_width", {blend_8, 4}, nullptr, 0, "base_opacity_table", nullptr, {nullptr, 0}},
    {"base_sh", "BlendStatic", SectionKind::linear, "3*sh_terms*count", "base_sh_width", {blend_8, 4}, nullptr, 0, "base_sh_scale", "2*3*sh_terms", {nullptr, 0}},
    {"geometry_ptr", "BlendStatic", SectionKind::pointer, "count+1", nullptr, {blend_9, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"geometry_column", "BlendStatic", SectionKind::index, "#geometry_ptr", "geometry_column_width", {blend_10, 3}, "#weights", 0, nullptr, nullptr, {nullptr, 0}},
    {"geometry_mean", "BlendStatic", SectionKind::signed_, "3*#geometry_ptr", "geometry_mean_width", {blend_8, 4}, nullptr, 0, "geometry_mean_step", "3*#weights", {nullptr, 0}},
    {"geometry_quat", "BlendStatic", SectionKind::signed_, "4*#geometry_ptr", "geometry_quat_width", {blend_8, 4}, nullptr, 0, "geometry_quat_step", "4*#weights", {nullptr, 0}},
    {"appearance_ptr", "BlendStatic", SectionKind::pointer, "count+1", nullptr, {blend_9, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"appearance_column", "BlendStatic", SectionKind::index, "#appearance_ptr", "appearance_column_width", {blend_10, 3}, "#weights", 0, nullptr, nullptr, {nullptr, 0}},
    {"appearance_log_scale", "BlendStatic", SectionKind::signed_, "3*#appearance_ptr", "appearance_log_scale_width", {blend_8, 4}, nullptr, 0, "appearance_log_scale_step", "3*#weights", {nullptr, 0}},
    {"appearance_opacity", "BlendStatic", SectionKind::signed_, "1*#appearance_ptr", "appearance_opacity_width", {blend_8, 4}, nullptr, 0, "appearance_opacity_step", "1*#weights", {nullptr, 0}},
    {"appearance_sh", "BlendStatic", SectionKind::signed_, "3*sh_terms*#appearance_ptr", "appearance_sh_width", {blend_8, 4}, nullptr, 0, "appearance_sh_step", "3*sh_terms*#weights", {nullptr, 0}},
};
const Contract blend_access = {
    "count",
    {blend_0, 1},
    {blend_2, 1},
    {nullptr, 0},
    {blend_3, 1},
    {blend_5, 2},
    "count",
    {blend_6, 1},
    {blend_7, 2},
    {blend_11, 14},
};

const StorageBuffer bind_skin_storage[] = {
    {"BindStatic", 0, 4, true},
    {"Pose", 1, 4, true},
    {"Splats", 2, 16, false},
};
const Member bind_skin_members[] = {
    {"count", 0, ConstantType::uint},
    {"first", 4, ConstantType::uint},
    {"rows", 8, ConstantType::uint},
    {"corrective_ptr", 12, ConstantType::uint},
    {"corrective_column", 16, ConstantType::uint},
    {"corrective_column_width", 20, ConstantType::uint},
    {"corrective_mean", 24, ConstantType::uint},
    {"corrective_mean_width", 28, ConstantType::uint},
    {"corrective_mean_step", 32, ConstantType::uint},
    {"late_ptr", 36, ConstantType::uint},
    {"late_column", 40, ConstantType::uint},
    {"late_column_width", 44, ConstantType::uint},
    {"late_mean", 48, ConstantType::uint},
    {"late_mean_width", 52, ConstantType::uint},
    {"late_mean_step", 56, ConstantType::uint},
    {"skin_ptr", 60, ConstantType::uint},
    {"skin_column", 64, ConstantType::uint},
    {"skin_column_width", 68, ConstantType::uint},
    {"skin_weight", 72, ConstantType::uint},
    {"skin_weight_width", 76, ConstantType::uint},
    {"skin_weight_step", 80, ConstantType::uint},
    {"features", 84, ConstantType::uint},
    {"late", 88, ConstantType::uint},
    {"joints", 92, ConstantType::uint},
    {"binding_rule", 96, ConstantType::uint},
    {"rotation_rule", 100, ConstantType::uint},
    {"sh_direction", 104, ConstantType::uint},
    {"unused", 108, ConstantType::uint},
    {"group_matrix_row0", 112, ConstantType::float4},
    {"group_matrix_row1", 128, ConstantType::float4},
    {"group_matrix_row2", 144, ConstantType::float4},
    {"group_rotation_row0", 160, ConstantType::float4},
    {"group_rotation_row1", 176, ConstantType::float4},
    {"group_rotation_row2", 192, ConstantType::float4},
    {"world_row0", 208, ConstantType::float4},
    {"world_row1", 224, ConstantType::float4},
    {"world_row2", 240, ConstantType::float4},
    {"world_quat_wxyz", 256, ConstantType::float4},
};
const Most bind_skin_0[] = {
    {"count", 4194240},
    {"rows", 4194240},
};
const uint32_t bind_skin_1[] = {0, 1, 2, 3};
const uint32_t bind_skin_2[] = {4, 5, 6};
const uint32_t bind_skin_3[] = {0, 1};
const Values bind_skin_4[] = {
    {"binding_rule", {bind_skin_1, 4}},
    {"rotation_rule", {bind_skin_2, 3}},
    {"sh_direction", {bind_skin_3, 2}},
};
const NamePair bind_skin_5[] = {
    {"first+rows", "count"},
};
const NamePair bind_skin_6[] = {
    {"features", "features"},
    {"late", "late"},
    {"joints", "joints"},
};
const char* const bind_skin_7[] = {
    "count",
};
const Same bind_skin_8[] = {
    {"Splats", {bind_skin_7, 1}},
};
const Touched bind_skin_9[] = {
    {"Splats", "5*count", {nullptr, 0}},
};
const uint32_t bind_skin_10[] = {32};
const uint32_t bind_skin_11[] = {8, 16, 32};
const uint32_t bind_skin_12[] = {0, 8, 16, 32};
const SectionContract bind_skin_13[] = {
    {"corrective_ptr", "BindStatic", SectionKind::pointer, "count+1", nullptr, {bind_skin_10, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"corrective_column", "BindStatic", SectionKind::index, "#corrective_ptr", "corrective_column_width", {bind_skin_11, 3}, "#features", 0, nullptr, nullptr, {nullptr, 0}},
    {"corrective_mean", "BindStatic", SectionKind::signed_, "3*#corrective_ptr", "corrective_mean_width", {bind_skin_12, 4}, nullptr, 0, "corrective_mean_step", "3*#features", {nullptr, 0}},
    {"late_ptr", "BindStatic", SectionKind::pointer, "count+1", nullptr, {bind_skin_10, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"late_column", "BindStatic", SectionKind::index, "#late_ptr", "late_column_width", {bind_skin_11, 3}, "#late", 0, nullptr, nullptr, {nullptr, 0}},
    {"late_mean", "BindStatic", SectionKind::signed_, "3*#late_ptr", "late_mean_width", {bind_skin_12, 4}, nullptr, 0, "late_mean_step", "3*#late", {nullptr, 0}},
    {"skin_ptr", "BindStatic", SectionKind::pointer, "count+1", nullptr, {bind_skin_10, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"skin_column", "BindStatic", SectionKind::index, "#skin_ptr", "skin_column_width", {bind_skin_11, 3}, "#joints", 0, nullptr, nullptr, {nullptr, 0}},
    {"skin_weight", "BindStatic", SectionKind::weight, "#skin_ptr", "skin_weight_width", {bind_skin_12, 4}, nullptr, 0, "skin_weight_step", "1", {nullptr, 0}},
};
const Contract bind_skin_access = {
    "rows",
    {bind_skin_0, 2},
    {bind_skin_4, 3},
    {bind_skin_5, 1},
    {bind_skin_6, 3},
    {bind_skin_8, 1},
    "count",
    {nullptr, 0},
    {bind_skin_9, 1},
    {bind_skin_13, 9},
};

const StorageBuffer bind_triangles_storage[] = {
    {"SurfaceStatic", 0, 4, true},
    {"Mesh", 1, 16, true},
    {"Triangles", 2, 16, false},
};
const Member bind_triangles_members[] = {
    {"triangles", 0, ConstantType::uint},
    {"vertices", 4, ConstantType::uint},
    {"corners", 8, ConstantType::uint},
    {"corners_width", 12, ConstantType::uint},
    {"canonical", 16, ConstantType::uint},
    {"canonical_width", 20, ConstantType::uint},
    {"canonical_scale", 24, ConstantType::uint},
    {"rotation_rule", 28, ConstantType::uint},
    {"quaternion_sign", 32, ConstantType::uint},
};
const Most bind_triangles_0[] = {
    {"triangles", 4194240},
    {"vertices", 16777216},
};
const uint32_t bind_triangles_1[] = {0, 1, 2, 3};
const uint32_t bind_triangles_2[] = {0, 1, 2};
const Values bind_triangles_3[] = {
    {"rotation_rule", {bind_triangles_1, 4}},
    {"quaternion_sign", {bind_triangles_2, 3}},
};
const char* const bind_triangles_4[] = {
    "vertices",
};
const char* const bind_triangles_5[] = {
    "triangles",
    "vertices",
    "rotation_rule",
};
const Same bind_triangles_6[] = {
    {"Mesh", {bind_triangles_4, 1}},
    {"Triangles", {bind_triangles_5, 3}},
};
const Touched bind_triangles_7[] = {
    {"Mesh", "3*vertices", {nullptr, 0}},
    {"Triangles", "3*triangles", {nullptr, 0}},
};
const uint32_t bind_triangles_8[] = {8, 16, 32};
const uint32_t bind_triangles_9[] = {0, 8, 16, 32};
const SectionContract bind_triangles_10[] = {
    {"corners", "SurfaceStatic", SectionKind::index, "3*triangles", "corners_width", {bind_triangles_8, 3}, "vertices", 0, nullptr, nullptr, {nullptr, 0}},
    {"canonical", "SurfaceStatic", SectionKind::linear, "3*vertices", "canonical_width", {bind_triangles_9, 4}, nullptr, 0, "canonical_scale", "2*3", {nullptr, 0}},
};
const Contract bind_triangles_access = {
    "triangles",
    {bind_triangles_0, 2},
    {bind_triangles_3, 2},
    {nullptr, 0},
    {nullptr, 0},
    {bind_triangles_6, 2},
    nullptr,
    {nullptr, 0},
    {bind_triangles_7, 2},
    {bind_triangles_10, 2},
};

const StorageBuffer bind_vertices_storage[] = {
    {"SurfaceStatic", 0, 4, true},
    {"Triangles", 1, 16, true},
    {"Pose", 2, 4, true},
    {"Mesh", 3, 16, false},
};
const Member bind_vertices_members[] = {
    {"vertices", 0, ConstantType::uint},
    {"triangles", 4, ConstantType::uint},
    {"vertex_triangle_ptr", 8, ConstantType::uint},
    {"vertex_triangle", 12, ConstantType::uint},
    {"vertex_triangle_width", 16, ConstantType::uint},
    {"normal_floor", 20, ConstantType::float1},
    {"quaternion_floor", 24, ConstantType::float1},
    {"rotation_rule", 28, ConstantType::uint},
    {"skin_ptr", 32, ConstantType::uint},
    {"skin_column", 36, ConstantType::uint},
    {"skin_column_width", 40, ConstantType::uint},
    {"skin_weight", 44, ConstantType::uint},
    {"skin_weight_width", 48, ConstantType::uint},
    {"skin_weight_step", 52, ConstantType::uint},
    {"joints", 56, ConstantType::uint},
};
const Most bind_vertices_0[] = {
    {"triangles", 4194240},
    {"vertices", 4194240},
};
const uint32_t bind_vertices_1[] = {0, 1, 2, 3};
const Values bind_vertices_2[] = {
    {"rotation_rule", {bind_vertices_1, 4}},
};
const NamePair bind_vertices_3[] = {
    {"joints", "joints"},
};
const char* const bind_vertices_4[] = {
    "vertices",
};
const char* const bind_vertices_5[] = {
    "triangles",
    "vertices",
    "rotation_rule",
};
const Same bind_vertices_6[] = {
    {"Mesh", {bind_vertices_4, 1}},
    {"Triangles", {bind_vertices_5, 3}},
};
const uint32_t bind_vertices_7[] = {0, 1, 2};
const Values bind_vertices_8[] = {
    {"rotation_rule", {bind_vertices_7, 3}},
};
const uint32_t bind_vertices_9[] = {3};
const Values bind_vertices_10[] = {
    {"rotation_rule", {bind_vertices_9, 1}},
};
const Touched bind_vertices_11[] = {
    {"Mesh", "3*vertices", {bind_vertices_8, 1}},
    {"Mesh", "5*vertices", {bind_vertices_10, 1}},
    {"Triangles", "3*triangles", {nullptr, 0}},
};
const uint32_t bind_vertices_12[] = {32};
const uint32_t bind_vertices_13[] = {8, 16, 32};
const uint32_t bind_vertices_14[] = {0, 8, 16, 32};
const SectionContract bind_vertices_15[] = {
    {"vertex_triangle_ptr", "SurfaceStatic", SectionKind::pointer, "vertices+1", nullptr, {bind_vertices_12, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"vertex_triangle", "SurfaceStatic", SectionKind::index, "#vertex_triangle_ptr", "vertex_triangle_width", {bind_vertices_13, 3}, "triangles", 0, nullptr, nullptr, {nullptr, 0}},
    {"skin_ptr", "SurfaceStatic", SectionKind::pointer, "vertices+1", nullptr, {bind_vertices_12, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"skin_column", "SurfaceStatic", SectionKind::index, "#skin_ptr", "skin_column_width", {bind_vertices_13, 3}, "#joints", 0, nullptr, nullptr, {nullptr, 0}},
    {"skin_weight", "SurfaceStatic", SectionKind::weight, "#skin_ptr", "skin_weight_width", {bind_vertices_14, 4}, nullptr, 0, "skin_weight_step", "1", {nullptr, 0}},
};
const Contract bind_vertices_access = {
    "vertices",
    {bind_vertices_0, 2},
    {bind_vertices_2, 1},
    {nullptr, 0},
    {bind_vertices_3, 1},
    {bind_vertices_6, 2},
    nullptr,
    {nullptr, 0},
    {bind_vertices_11, 3},
    {bind_vertices_15, 5},
};

const StorageBuffer bind_surface_storage[] = {
    {"EmbedStatic", 0, 4, true},
    {"Mesh", 1, 16, true},
    {"Triangles", 2, 16, true},
    {"Splats", 3, 16, false},
};
const Member bind_surface_members[] = {
    {"count", 0, ConstantType::uint},
    {"vertices", 4, ConstantType::uint},
    {"triangles", 8, ConstantType::uint},
    {"triangle_ids", 12, ConstantType::uint},
    {"triangle_ids_width", 16, ConstantType::uint},
    {"barycentric", 20, ConstantType::uint},
    {"barycentric_width", 24, ConstantType::uint},
    {"barycentric_scale", 28, ConstantType::uint},
    {"displacement", 32, ConstantType::uint},
    {"displacement_width", 36, ConstantType::uint},
    {"displacement_scale", 40, ConstantType::uint},
    {"local_offset", 44, ConstantType::uint},
    {"local_offset_width", 48, ConstantType::uint},
    {"local_offset_scale", 52, ConstantType::uint},
    {"local_quat", 56, ConstantType::uint},
    {"local_quat_width", 60, ConstantType::uint},
    {"local_quat_scale", 64, ConstantType::uint},
    {"position_rule", 68, ConstantType::uint},
    {"rotation_rule", 72, ConstantType::uint},
    {"scale_rule", 76, ConstantType::uint},
    {"sh_direction", 80, ConstantType::uint},
    {"unused", 84, ConstantType::uint},
    {"area_damping", 88, ConstantType::float1},
    {"log_training_per_bundle", 92, ConstantType::float1},
    {"world_row0", 96, ConstantType::float4},
    {"world_row1", 112, ConstantType::float4},
    {"world_row2", 128, ConstantType::float4},
    {"world_quat_wxyz", 144, ConstantType::float4},
};
const Most bind_surface_0[] = {
    {"count", 4194240},
    {"triangles", 4194240},
    {"vertices", 16777216},
};
const uint32_t bind_surface_1[] = {0, 1, 2};
const uint32_t bind_surface_2[] = {0, 1, 2, 3};
const uint32_t bind_surface_3[] = {0, 1};
const Values bind_surface_4[] = {
    {"position_rule", {bind_surface_1, 3}},
    {"rotation_rule", {bind_surface_2, 4}},
    {"scale_rule", {bind_surface_1, 3}},
    {"sh_direction", {bind_surface_3, 2}},
};
const char* const bind_surface_5[] = {
    "count",
};
const char* const bind_surface_6[] = {
    "vertices",
};
const char* const bind_surface_7[] = {
    "triangles",
    "vertices",
    "rotation_rule",
};
const Same bind_surface_8[] = {
    {"Splats", {bind_surface_5, 1}},
    {"Mesh", {bind_surface_6, 1}},
    {"Triangles", {bind_surface_7, 3}},
};
const Values bind_surface_9[] = {
    {"rotation_rule", {bind_surface_1, 3}},
};
const uint32_t bind_surface_10[] = {3};
const Values bind_surface_11[] = {
    {"rotation_rule", {bind_surface_10, 1}},
};
const Touched bind_surface_12[] = {
    {"Mesh", "3*vertices", {bind_surface_9, 1}},
    {"Mesh", "5*vertices", {bind_surface_11, 1}},
    {"Triangles", "3*triangles", {nullptr, 0}},
    {"Splats", "5*count", {nullptr, 0}},
};
const uint32_t bind_surface_13[] = {8, 16, 32};
const uint32_t bind_surface_14[] = {0, 8, 16, 32};
const uint32_t bind_surface_15[] = {0, 2};
const Values bind_surface_16[] = {
    {"position_rule", {bind_surface_15, 2}},
};
const uint32_t bind_surface_17[] = {1};
const Values bind_surface_18[] = {
    {"position_rule", {bind_surface_17, 1}},
};
const SectionContract bind_surface_19[] = {
    {"triangle_ids", "EmbedStatic", SectionKind::index, "count", "triangle_ids_width", {bind_surface_13, 3}, "triangles", 0, nullptr, nullptr, {nullptr, 0}},
    {"barycentric", "EmbedStatic", SectionKind::linear, "3*count", "barycentric_width", {bind_surface_14, 4}, nullptr, 0, "barycentric_scale", "2*3", {nullptr, 0}},
    {"displacement", "EmbedStatic", SectionKind::linear, "1*count", "displacement_width", {bind_surface_14, 4}, nullptr, 0, "displacement_scale", "2*1", {bind_surface_16, 1}},
    {"local_offset", "EmbedStatic", SectionKind::linear, "3*count", "local_offset_width", {bind_surface_14, 4}, nullptr, 0, "local_offset_scale", "2*3", {bind_surface_18, 1}},
    {"local_quat", "EmbedStatic", SectionKind::linear, "4*count", "local_quat_width", {bind_surface_14, 4}, nullptr, 0, "local_quat_scale", "2*4", {nullptr, 0}},
};
const Contract bind_surface_access = {
    "count",
    {bind_surface_0, 3},
    {bind_surface_4, 4},
    {nullptr, 0},
    {nullptr, 0},
    {bind_surface_8, 3},
    "count",
    {nullptr, 0},
    {bind_surface_12, 4},
    {bind_surface_19, 5},
};

const StorageBuffer activate_storage[] = {
    {"Splats", 0, 16, false},
};
const Member activate_members[] = {
    {"count", 0, ConstantType::uint},
};
const Most activate_0[] = {
    {"count", 4194240},
};
const char* const activate_1[] = {
    "count",
};
const Same activate_2[] = {
    {"Splats", {activate_1, 1}},
};
const Touched activate_3[] = {
    {"Splats", "5*count", {nullptr, 0}},
};
const Contract activate_access = {
    "count",
    {activate_0, 1},
    {nullptr, 0},
    {nullptr, 0},
    {nullptr, 0},
    {activate_2, 1},
    "count",
    {nullptr, 0},
    {activate_3, 1},
    {nullptr, 0},
};

const StorageBuffer project_storage[] = {
    {"Splats", 0, 16, true},
    {"Sh", 1, 4, true},
    {"Projected", 2, 16, false},
};
const Member project_members[] = {
    {"count", 0, ConstantType::uint},
    {"sh_degree", 4, ConstantType::uint},
    {"near_z", 8, ConstantType::float1},
    {"low_pass", 12, ConstantType::float1},
    {"camera_row0", 16, ConstantType::float4},
    {"camera_row1", 32, ConstantType::float4},
    {"camera_row2", 48, ConstantType::float4},
    {"clip_row0", 64, ConstantType::float4},
    {"clip_row1", 80, ConstantType::float4},
    {"clip_row2", 96, ConstantType::float4},
    {"clip_row3", 112, ConstantType::float4},
    {"eye", 128, ConstantType::float4},
    {"tan_half_fov", 144, ConstantType::float2},
    {"image_size", 152, ConstantType::float2},
};
const Most project_0[] = {
    {"count", 4194240},
};
const uint32_t project_1[] = {0, 1, 2, 3};
const Values project_2[] = {
    {"sh_degree", {project_1, 4}},
};
const char* const project_3[] = {
    "count",
};
const Same project_4[] = {
    {"Splats", {project_3, 1}},
    {"Projected", {project_3, 1}},
    {"Sh", {project_3, 1}},
};
const uint32_t project_5[] = {0};
const Values project_6[] = {
    {"sh_degree", {project_5, 1}},
};
const uint32_t project_7[] = {1};
const Values project_8[] = {
    {"sh_degree", {project_7, 1}},
};
const uint32_t project_9[] = {2};
const Values project_10[] = {
    {"sh_degree", {project_9, 1}},
};
const uint32_t project_11[] = {3};
const Values project_12[] = {
    {"sh_degree", {project_11, 1}},
};
const Touched project_13[] = {
    {"Splats", "5*count", {nullptr, 0}},
    {"Projected", "3*count", {nullptr, 0}},
    {"Sh", "3*count", {project_6, 1}},
    {"Sh", "12*count", {project_8, 1}},
    {"Sh", "27*count", {project_10, 1}},
    {"Sh", "48*count", {project_12, 1}},
};
const Contract project_access = {
    "count",
    {project_0, 1},
    {project_2, 1},
    {nullptr, 0},
    {nullptr, 0},
    {project_4, 3},
    "count",
    {nullptr, 0},
    {project_13, 6},
    {nullptr, 0},
};

const StorageBuffer sort_keys_storage[] = {
    {"Projected", 0, 16, true},
    {"Pairs", 1, 8, false},
};
const Member sort_keys_members[] = {
    {"count", 0, ConstantType::uint},
    {"first", 4, ConstantType::uint},
};
const StorageBuffer sort_count_storage[] = {
    {"Pairs", 0, 8, true},
    {"Counts", 1, 4, false},
};
const Member sort_count_members[] = {
    {"count", 0, ConstantType::uint},
    {"groups", 4, ConstantType::uint},
    {"shift", 8, ConstantType::uint},
};
const StorageBuffer sort_scan_storage[] = {
    {"Counts", 0, 4, false},
};
const Member sort_scan_members[] = {
    {"total", 0, ConstantType::uint},
};
const StorageBuffer sort_scatter_storage[] = {
    {"Pairs", 0, 8, true},
    {"Counts", 1, 4, true},
    {"PairsOut", 2, 8, false},
};
const Member sort_scatter_members[] = {
    {"count", 0, ConstantType::uint},
    {"groups", 4, ConstantType::uint},
    {"shift", 8, ConstantType::uint},
};
const StorageBuffer raster_gather_storage[] = {
    {"Projected", 0, 16, true},
    {"Pairs", 1, 8, true},
    {"Quads", 2, 16, false},
};
const Member raster_gather_members[] = {
    {"count", 0, ConstantType::uint},
    {"begin", 4, ConstantType::uint},
    {"piece_count", 8, ConstantType::uint},
    {"first", 12, ConstantType::uint},
    {"chunk_count", 16, ConstantType::uint},
    {"reverse", 20, ConstantType::uint},
};
}  // namespace

const Interface interfaces[] = {
    {"morph", "morph", 64, 8, 80, {morph_storage, 3}, {morph_members, 20}, &morph_access},
    {"skin", "skin", 64, 8, 64, {skin_storage, 3}, {skin_members, 16}, &skin_access},
    {"blend", "blend", 64, 8, 160, {blend_storage, 4}, {blend_members, 40}, &blend_access},
    {"bind_skin", "bind", 64, 8, 272, {bind_skin_storage, 3}, {bind_skin_members, 38}, &bind_skin_access},
    {"bind_triangles", "bind", 64, 8, 48, {bind_triangles_storage, 3}, {bind_triangles_members, 9}, &bind_triangles_access},
    {"bind_vertices", "bind", 64, 8, 64, {bind_vertices_storage, 4}, {bind_vertices_members, 15}, &bind_vertices_access},
    {"bind_surface", "bind", 64, 8, 160, {bind_surface_storage, 4}, {bind_surface_members, 28}, &bind_surface_access},
    {"activate", "activate", 64, 8, 16, {activate_storage, 1}, {activate_members, 1}, &activate_access},
    {"project", "project", 64, 8, 160, {project_storage, 3}, {project_members, 14}, &project_access},
    {"sort_keys", "sort", 64, 8, 16, {sort_keys_storage, 2}, {sort_keys_members, 2}, nullptr},
    {"sort_count", "sort", 64, 8, 16, {sort_count_storage, 2}, {sort_count_members, 3}, nullptr},
    {"sort_scan", "sort", 128, 8, 16, {sort_scan_storage, 1}, {sort_scan_members, 1}, nullptr},
    {"sort_scatter", "sort", 64, 8, 16, {sort_scatter_storage, 3}, {sort_scatter_members, 3}, nullptr},
    {"raster_gather", "raster", 64, 8, 32, {raster_gather_storage, 3}, {raster_gather_members, 6}, nullptr},
};
const uint32_t interface_count = 14;

}  // namespace avatar
