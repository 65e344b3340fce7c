// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#include "../pack/contracts.h"

namespace avatar {
namespace {

const StorageBuffer morph_storage[] = {{"MorphStatic", 0, 4, true}, {"Pose", 1, 4, true}, {"Mesh", 2, 16, false}};
const Member morph_members[] = {
    {"first", 0, ConstantType::uint}, {"count", 4, ConstantType::uint}, {"vertices", 8, ConstantType::uint},
    {"template_position", 12, ConstantType::uint}, {"template_position_width", 16, ConstantType::uint},
    {"template_position_scale", 20, ConstantType::uint}, {"morph_ptr", 24, ConstantType::uint},
    {"morph_column", 28, ConstantType::uint}, {"morph_column_width", 32, ConstantType::uint},
    {"morph_position", 36, ConstantType::uint}, {"morph_position_width", 40, ConstantType::uint},
    {"morph_position_step", 44, ConstantType::uint}, {"corrective_ptr", 48, ConstantType::uint},
    {"corrective_column", 52, ConstantType::uint}, {"corrective_column_width", 56, ConstantType::uint},
    {"corrective_position", 60, ConstantType::uint}, {"corrective_position_width", 64, ConstantType::uint},
    {"corrective_position_step", 68, ConstantType::uint}, {"weights", 72, ConstantType::uint},
    {"features", 76, ConstantType::uint},
};
const Most list_0[] = {{"count", 4194240}, {"vertices", 16777216}};
const NamePair list_1[] = {{"first+count", "vertices"}};
const NamePair list_2[] = {{"weights", "weights"}, {"features", "features"}};
const char* const list_3[] = {"vertices"};
const Same list_4[] = {{"Mesh", {list_3, 1}}};
const Touched list_5[] = {{"Mesh", "3*vertices", {nullptr, 0}}};
const uint32_t list_6[] = {0, 8, 16, 32};
const uint32_t list_7[] = {32};
const uint32_t list_8[] = {8, 16, 32};
const SectionContract list_9[] = {
    {"template_position", "MorphStatic", SectionKind::linear, "3*count", "template_position_width", {list_6, 4}, nullptr, 0, "template_position_scale", "2*3", {nullptr, 0}},
    {"morph_ptr", "MorphStatic", SectionKind::pointer, "count+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"morph_column", "MorphStatic", SectionKind::index, "#morph_ptr", "morph_column_width", {list_8, 3}, "#weights", 0, nullptr, nullptr, {nullptr, 0}},
    {"morph_position", "MorphStatic", SectionKind::signed_, "3*#morph_ptr", "morph_position_width", {list_6, 4}, nullptr, 0, "morph_position_step", "3*#weights", {nullptr, 0}},
    {"corrective_ptr", "MorphStatic", SectionKind::pointer, "count+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"corrective_column", "MorphStatic", SectionKind::index, "#corrective_ptr", "corrective_column_width", {list_8, 3}, "#features", 0, nullptr, nullptr, {nullptr, 0}},
    {"corrective_position", "MorphStatic", SectionKind::signed_, "3*#corrective_ptr", "corrective_position_width", {list_6, 4}, nullptr, 0, "corrective_position_step", "3*#features", {nullptr, 0}},
};
const Contract morph_access = {
    "count", {list_0, 2}, {nullptr, 0}, {list_1, 1}, {list_2, 2}, {list_4, 1}, nullptr, {nullptr, 0}, {list_5, 1},
    {list_9, 7},
};

const StorageBuffer skin_storage[] = {{"SkinStatic", 0, 4, true}, {"Pose", 1, 4, true}, {"Mesh", 2, 16, false}};
const Member skin_members[] = {
    {"first", 0, ConstantType::uint}, {"count", 4, ConstantType::uint}, {"late_ptr", 8, ConstantType::uint},
    {"late_column", 12, ConstantType::uint}, {"late_column_width", 16, ConstantType::uint},
    {"late_position", 20, ConstantType::uint}, {"late_position_width", 24, ConstantType::uint},
    {"late_position_step", 28, ConstantType::uint}, {"skin_ptr", 32, ConstantType::uint},
    {"skin_column", 36, ConstantType::uint}, {"skin_column_width", 40, ConstantType::uint},
    {"skin_weight", 44, ConstantType::uint}, {"skin_weight_width", 48, ConstantType::uint},
    {"skin_weight_step", 52, ConstantType::uint}, {"late", 56, ConstantType::uint},
    {"joints", 60, ConstantType::uint},
};
const Most list_10[] = {{"count", 4194240}};
const NamePair list_11[] = {{"late", "late"}, {"joints", "joints"}};
const Touched list_12[] = {{"Mesh", "first+count", {nullptr, 0}}};
const SectionContract list_13[] = {
    {"late_ptr", "SkinStatic", SectionKind::pointer, "count+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"late_column", "SkinStatic", SectionKind::index, "#late_ptr", "late_column_width", {list_8, 3}, "#late", 0, nullptr, nullptr, {nullptr, 0}},
    {"late_position", "SkinStatic", SectionKind::signed_, "3*#late_ptr", "late_position_width", {list_6, 4}, nullptr, 0, "late_position_step", "3*#late", {nullptr, 0}},
    {"skin_ptr", "SkinStatic", SectionKind::pointer, "count+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"skin_column", "SkinStatic", SectionKind::index, "#skin_ptr", "skin_column_width", {list_8, 3}, "#joints", 0, nullptr, nullptr, {nullptr, 0}},
    {"skin_weight", "SkinStatic", SectionKind::weight, "#skin_ptr", "skin_weight_width", {list_6, 4}, nullptr, 0, "skin_weight_step", "1", {nullptr, 0}},
};
const Contract skin_access = {
    "count", {list_10, 1}, {nullptr, 0}, {nullptr, 0}, {list_11, 2}, {nullptr, 0}, nullptr, {nullptr, 0},
    {list_12, 1}, {list_13, 6},
};

const StorageBuffer blend_storage[] = {
    {"BlendStatic", 0, 4, true}, {"Pose", 1, 4, true}, {"Splats", 2, 16, false}, {"Sh", 3, 4, false},
};
const Member blend_members[] = {
    {"count", 0, ConstantType::uint}, {"sh_terms", 4, ConstantType::uint}, {"weights", 8, ConstantType::uint},
    {"base_mean", 12, ConstantType::uint}, {"base_mean_width", 16, ConstantType::uint},
    {"base_mean_scale", 20, ConstantType::uint}, {"base_log_scale", 24, ConstantType::uint},
    {"base_log_scale_width", 28, ConstantType::uint}, {"base_log_scale_scale", 32, ConstantType::uint},
    {"base_quat", 36, ConstantType::uint}, {"base_quat_width", 40, ConstantType::uint},
    {"base_quat_scale", 44, ConstantType::uint}, {"base_opacity", 48, ConstantType::uint},
    {"base_opacity_width", 52, ConstantType::uint}, {"base_opacity_table", 56, ConstantType::uint},
    {"base_sh", 60, ConstantType::uint}, {"base_sh_width", 64, ConstantType::uint},
    {"base_sh_scale", 68, ConstantType::uint}, {"geometry_ptr", 72, ConstantType::uint},
    {"geometry_column", 76, ConstantType::uint}, {"geometry_column_width", 80, ConstantType::uint},
    {"geometry_mean", 84, ConstantType::uint}, {"geometry_mean_width", 88, ConstantType::uint},
    {"geometry_mean_step", 92, ConstantType::uint}, {"geometry_quat", 96, ConstantType::uint},
    {"geometry_quat_width", 100, ConstantType::uint}, {"geometry_quat_step", 104, ConstantType::uint},
    {"appearance_ptr", 108, ConstantType::uint}, {"appearance_column", 112, ConstantType::uint},
    {"appearance_column_width", 116, ConstantType::uint}, {"appearance_log_scale", 120, ConstantType::uint},
    {"appearance_log_scale_width", 124, ConstantType::uint}, {"appearance_log_scale_step", 128, ConstantType::uint},
    {"appearance_opacity", 132, ConstantType::uint}, {"appearance_opacity_width", 136, ConstantType::uint},
    {"appearance_opacity_step", 140, ConstantType::uint}, {"appearance_sh", 144, ConstantType::uint},
    {"appearance_sh_width", 148, ConstantType::uint}, {"appearance_sh_step", 152, ConstantType::uint},
    {"unused", 156, ConstantType::uint},
};
const uint32_t list_14[] = {1, 4, 9, 16};
const Values list_15[] = {{"sh_terms", {list_14, 4}}};
const NamePair list_16[] = {{"weights", "weights"}};
const char* const list_17[] = {"count"};
const Same list_18[] = {{"Splats", {list_17, 1}}, {"Sh", {list_17, 1}}};
const char* const list_19[] = {"sh_terms"};
const Touched list_20[] = {{"Splats", "5*count", {nullptr, 0}}, {"Sh", "3*sh_terms*count", {nullptr, 0}}};
const SectionContract list_21[] = {
    {"base_mean", "BlendStatic", SectionKind::linear, "3*count", "base_mean_width", {list_6, 4}, nullptr, 0, "base_mean_scale", "2*3", {nullptr, 0}},
    {"base_log_scale", "BlendStatic", SectionKind::linear, "3*count", "base_log_scale_width", {list_6, 4}, nullptr, 0, "base_log_scale_scale", "2*3", {nullptr, 0}},
    {"base_quat", "BlendStatic", SectionKind::linear, "4*count", "base_quat_width", {list_6, 4}, nullptr, 0, "base_quat_scale", "2*4", {nullptr, 0}},
    {"base_opacity", "BlendStatic", SectionKind::table, "count", "base_opacity_width", {list_6, 4}, nullptr, 0, "base_opacity_table", nullptr, {nullptr, 0}},
    {"base_sh", "BlendStatic", SectionKind::linear, "3*sh_terms*count", "base_sh_width", {list_6, 4}, nullptr, 0, "base_sh_scale", "2*3*sh_terms", {nullptr, 0}},
    {"geometry_ptr", "BlendStatic", SectionKind::pointer, "count+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"geometry_column", "BlendStatic", SectionKind::index, "#geometry_ptr", "geometry_column_width", {list_8, 3}, "#weights", 0, nullptr, nullptr, {nullptr, 0}},
    {"geometry_mean", "BlendStatic", SectionKind::signed_, "3*#geometry_ptr", "geometry_mean_width", {list_6, 4}, nullptr, 0, "geometry_mean_step", "3*#weights", {nullptr, 0}},
    {"geometry_quat", "BlendStatic", SectionKind::signed_, "4*#geometry_ptr", "geometry_quat_width", {list_6, 4}, nullptr, 0, "geometry_quat_step", "4*#weights", {nullptr, 0}},
    {"appearance_ptr", "BlendStatic", SectionKind::pointer, "count+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"appearance_column", "BlendStatic", SectionKind::index, "#appearance_ptr", "appearance_column_width", {list_8, 3}, "#weights", 0, nullptr, nullptr, {nullptr, 0}},
    {"appearance_log_scale", "BlendStatic", SectionKind::signed_, "3*#appearance_ptr", "appearance_log_scale_width", {list_6, 4}, nullptr, 0, "appearance_log_scale_step", "3*#weights", {nullptr, 0}},
    {"appearance_opacity", "BlendStatic", SectionKind::signed_, "1*#appearance_ptr", "appearance_opacity_width", {list_6, 4}, nullptr, 0, "appearance_opacity_step", "1*#weights", {nullptr, 0}},
    {"appearance_sh", "BlendStatic", SectionKind::signed_, "3*sh_terms*#appearance_ptr", "appearance_sh_width", {list_6, 4}, nullptr, 0, "appearance_sh_step", "3*sh_terms*#weights", {nullptr, 0}},
};
const Contract blend_access = {
    "count", {list_10, 1}, {list_15, 1}, {nullptr, 0}, {list_16, 1}, {list_18, 2}, "count", {list_19, 1},
    {list_20, 2}, {list_21, 14},
};

const StorageBuffer bind_skin_storage[] = {
    {"BindStatic", 0, 4, true}, {"Pose", 1, 4, true}, {"Splats", 2, 16, false},
};
const Member bind_skin_members[] = {
    {"count", 0, ConstantType::uint}, {"first", 4, ConstantType::uint}, {"rows", 8, ConstantType::uint},
    {"corrective_ptr", 12, ConstantType::uint}, {"corrective_column", 16, ConstantType::uint},
    {"corrective_column_width", 20, ConstantType::uint}, {"corrective_mean", 24, ConstantType::uint},
    {"corrective_mean_width", 28, ConstantType::uint}, {"corrective_mean_step", 32, ConstantType::uint},
    {"late_ptr", 36, ConstantType::uint}, {"late_column", 40, ConstantType::uint},
    {"late_column_width", 44, ConstantType::uint}, {"late_mean", 48, ConstantType::uint},
    {"late_mean_width", 52, ConstantType::uint}, {"late_mean_step", 56, ConstantType::uint},
    {"skin_ptr", 60, ConstantType::uint}, {"skin_column", 64, ConstantType::uint},
    {"skin_column_width", 68, ConstantType::uint}, {"skin_weight", 72, ConstantType::uint},
    {"skin_weight_width", 76, ConstantType::uint}, {"skin_weight_step", 80, ConstantType::uint},
    {"features", 84, ConstantType::uint}, {"late", 88, ConstantType::uint}, {"joints", 92, ConstantType::uint},
    {"binding_rule", 96, ConstantType::uint}, {"rotation_rule", 100, ConstantType::uint},
    {"sh_direction", 104, ConstantType::uint}, {"unused", 108, ConstantType::uint},
    {"group_matrix_row0", 112, ConstantType::float4}, {"group_matrix_row1", 128, ConstantType::float4},
    {"group_matrix_row2", 144, ConstantType::float4}, {"group_rotation_row0", 160, ConstantType::float4},
    {"group_rotation_row1", 176, ConstantType::float4}, {"group_rotation_row2", 192, ConstantType::float4},
    {"world_row0", 208, ConstantType::float4}, {"world_row1", 224, ConstantType::float4},
    {"world_row2", 240, ConstantType::float4}, {"world_quat_wxyz", 256, ConstantType::float4},
};
const Most list_22[] = {{"count", 4194240}, {"rows", 4194240}};
const uint32_t list_23[] = {0, 1, 2, 3};
const uint32_t list_24[] = {4, 5, 6};
const uint32_t list_25[] = {0, 1};
const Values list_26[] = {
    {"binding_rule", {list_23, 4}}, {"rotation_rule", {list_24, 3}}, {"sh_direction", {list_25, 2}},
};
const NamePair list_27[] = {{"first+rows", "count"}};
const NamePair list_28[] = {{"features", "features"}, {"late", "late"}, {"joints", "joints"}};
const Same list_29[] = {{"Splats", {list_17, 1}}};
const Touched list_30[] = {{"Splats", "5*count", {nullptr, 0}}};
const SectionContract list_31[] = {
    {"corrective_ptr", "BindStatic", SectionKind::pointer, "count+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"corrective_column", "BindStatic", SectionKind::index, "#corrective_ptr", "corrective_column_width", {list_8, 3}, "#features", 0, nullptr, nullptr, {nullptr, 0}},
    {"corrective_mean", "BindStatic", SectionKind::signed_, "3*#corrective_ptr", "corrective_mean_width", {list_6, 4}, nullptr, 0, "corrective_mean_step", "3*#features", {nullptr, 0}},
    {"late_ptr", "BindStatic", SectionKind::pointer, "count+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"late_column", "BindStatic", SectionKind::index, "#late_ptr", "late_column_width", {list_8, 3}, "#late", 0, nullptr, nullptr, {nullptr, 0}},
    {"late_mean", "BindStatic", SectionKind::signed_, "3*#late_ptr", "late_mean_width", {list_6, 4}, nullptr, 0, "late_mean_step", "3*#late", {nullptr, 0}},
    {"skin_ptr", "BindStatic", SectionKind::pointer, "count+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"skin_column", "BindStatic", SectionKind::index, "#skin_ptr", "skin_column_width", {list_8, 3}, "#joints", 0, nullptr, nullptr, {nullptr, 0}},
    {"skin_weight", "BindStatic", SectionKind::weight, "#skin_ptr", "skin_weight_width", {list_6, 4}, nullptr, 0, "skin_weight_step", "1", {nullptr, 0}},
};
const Contract bind_skin_access = {
    "rows", {list_22, 2}, {list_26, 3}, {list_27, 1}, {list_28, 3}, {list_29, 1}, "count", {nullptr, 0}, {list_30, 1},
    {list_31, 9},
};

const StorageBuffer bind_triangles_storage[] = {
    {"SurfaceStatic", 0, 4, true}, {"Mesh", 1, 16, true}, {"Triangles", 2, 16, false},
};
const Member bind_triangles_members[] = {
    {"triangles", 0, ConstantType::uint}, {"vertices", 4, ConstantType::uint}, {"corners", 8, ConstantType::uint},
    {"corners_width", 12, ConstantType::uint}, {"canonical", 16, ConstantType::uint},
    {"canonical_width", 20, ConstantType::uint}, {"canonical_scale", 24, ConstantType::uint},
    {"rotation_rule", 28, ConstantType::uint}, {"quaternion_sign", 32, ConstantType::uint},
};
const Most list_32[] = {{"triangles", 4194240}, {"vertices", 16777216}};
const uint32_t list_33[] = {0, 1, 2};
const Values list_34[] = {{"rotation_rule", {list_23, 4}}, {"quaternion_sign", {list_33, 3}}};
const char* const list_35[] = {"triangles", "vertices", "rotation_rule"};
const Same list_36[] = {{"Mesh", {list_3, 1}}, {"Triangles", {list_35, 3}}};
const Touched list_37[] = {{"Mesh", "3*vertices", {nullptr, 0}}, {"Triangles", "3*triangles", {nullptr, 0}}};
const SectionContract list_38[] = {
    {"corners", "SurfaceStatic", SectionKind::index, "3*triangles", "corners_width", {list_8, 3}, "vertices", 0, nullptr, nullptr, {nullptr, 0}},
    {"canonical", "SurfaceStatic", SectionKind::linear, "3*vertices", "canonical_width", {list_6, 4}, nullptr, 0, "canonical_scale", "2*3", {nullptr, 0}},
};
const Contract bind_triangles_access = {
    "triangles", {list_32, 2}, {list_34, 2}, {nullptr, 0}, {nullptr, 0}, {list_36, 2}, nullptr, {nullptr, 0},
    {list_37, 2}, {list_38, 2},
};

const StorageBuffer bind_vertices_storage[] = {
    {"SurfaceStatic", 0, 4, true}, {"Triangles", 1, 16, true}, {"Pose", 2, 4, true}, {"Mesh", 3, 16, false},
};
const Member bind_vertices_members[] = {
    {"vertices", 0, ConstantType::uint}, {"triangles", 4, ConstantType::uint},
    {"vertex_triangle_ptr", 8, ConstantType::uint}, {"vertex_triangle", 12, ConstantType::uint},
    {"vertex_triangle_width", 16, ConstantType::uint}, {"normal_floor", 20, ConstantType::float1},
    {"quaternion_floor", 24, ConstantType::float1}, {"rotation_rule", 28, ConstantType::uint},
    {"skin_ptr", 32, ConstantType::uint}, {"skin_column", 36, ConstantType::uint},
    {"skin_column_width", 40, ConstantType::uint}, {"skin_weight", 44, ConstantType::uint},
    {"skin_weight_width", 48, ConstantType::uint}, {"skin_weight_step", 52, ConstantType::uint},
    {"joints", 56, ConstantType::uint},
};
const Most list_39[] = {{"triangles", 4194240}, {"vertices", 4194240}};
const Values list_40[] = {{"rotation_rule", {list_23, 4}}};
const NamePair list_41[] = {{"joints", "joints"}};
const Values list_42[] = {{"rotation_rule", {list_33, 3}}};
const uint32_t list_43[] = {3};
const Values list_44[] = {{"rotation_rule", {list_43, 1}}};
const Touched list_45[] = {
    {"Mesh", "3*vertices", {list_42, 1}}, {"Mesh", "5*vertices", {list_44, 1}},
    {"Triangles", "3*triangles", {nullptr, 0}},
};
const SectionContract list_46[] = {
    {"vertex_triangle_ptr", "SurfaceStatic", SectionKind::pointer, "vertices+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"vertex_triangle", "SurfaceStatic", SectionKind::index, "#vertex_triangle_ptr", "vertex_triangle_width", {list_8, 3}, "triangles", 0, nullptr, nullptr, {nullptr, 0}},
    {"skin_ptr", "SurfaceStatic", SectionKind::pointer, "vertices+1", nullptr, {list_7, 1}, nullptr, 65536, nullptr, nullptr, {nullptr, 0}},
    {"skin_column", "SurfaceStatic", SectionKind::index, "#skin_ptr", "skin_column_width", {list_8, 3}, "#joints", 0, nullptr, nullptr, {nullptr, 0}},
    {"skin_weight", "SurfaceStatic", SectionKind::weight, "#skin_ptr", "skin_weight_width", {list_6, 4}, nullptr, 0, "skin_weight_step", "1", {nullptr, 0}},
};
const Contract bind_vertices_access = {
    "vertices", {list_39, 2}, {list_40, 1}, {nullptr, 0}, {list_41, 1}, {list_36, 2}, nullptr, {nullptr, 0},
    {list_45, 3}, {list_46, 5},
};

const StorageBuffer bind_surface_storage[] = {
    {"EmbedStatic", 0, 4, true}, {"Mesh", 1, 16, true}, {"Triangles", 2, 16, true}, {"Splats", 3, 16, false},
};
const Member bind_surface_members[] = {
    {"count", 0, ConstantType::uint}, {"vertices", 4, ConstantType::uint}, {"triangles", 8, ConstantType::uint},
    {"triangle_ids", 12, ConstantType::uint}, {"triangle_ids_width", 16, ConstantType::uint},
    {"barycentric", 20, ConstantType::uint}, {"barycentric_width", 24, ConstantType::uint},
    {"barycentric_scale", 28, ConstantType::uint}, {"displacement", 32, ConstantType::uint},
    {"displacement_width", 36, ConstantType::uint}, {"displacement_scale", 40, ConstantType::uint},
    {"local_offset", 44, ConstantType::uint}, {"local_offset_width", 48, ConstantType::uint},
    {"local_offset_scale", 52, ConstantType::uint}, {"local_quat", 56, ConstantType::uint},
    {"local_quat_width", 60, ConstantType::uint}, {"local_quat_scale", 64, ConstantType::uint},
    {"position_rule", 68, ConstantType::uint}, {"rotation_rule", 72, ConstantType::uint},
    {"scale_rule", 76, ConstantType::uint}, {"sh_direction", 80, ConstantType::uint},
    {"unused", 84, ConstantType::uint}, {"area_damping", 88, ConstantType::float1},
    {"log_training_per_bundle", 92, ConstantType::float1}, {"world_row0", 96, ConstantType::float4},
    {"world_row1", 112, ConstantType::float4}, {"world_row2", 128, ConstantType::float4},
    {"world_quat_wxyz", 144, ConstantType::float4},
};
const Most list_47[] = {{"count", 4194240}, {"triangles", 4194240}, {"vertices", 16777216}};
const Values list_48[] = {
    {"position_rule", {list_33, 3}}, {"rotation_rule", {list_23, 4}}, {"scale_rule", {list_33, 3}},
    {"sh_direction", {list_25, 2}},
};
const Same list_49[] = {{"Splats", {list_17, 1}}, {"Mesh", {list_3, 1}}, {"Triangles", {list_35, 3}}};
const Touched list_50[] = {
    {"Mesh", "3*vertices", {list_42, 1}}, {"Mesh", "5*vertices", {list_44, 1}},
    {"Triangles", "3*triangles", {nullptr, 0}}, {"Splats", "5*count", {nullptr, 0}},
};
const uint32_t list_51[] = {0, 2};
const Values list_52[] = {{"position_rule", {list_51, 2}}};
const uint32_t list_53[] = {1};
const Values list_54[] = {{"position_rule", {list_53, 1}}};
const SectionContract list_55[] = {
    {"triangle_ids", "EmbedStatic", SectionKind::index, "count", "triangle_ids_width", {list_8, 3}, "triangles", 0, nullptr, nullptr, {nullptr, 0}},
    {"barycentric", "EmbedStatic", SectionKind::linear, "3*count", "barycentric_width", {list_6, 4}, nullptr, 0, "barycentric_scale", "2*3", {nullptr, 0}},
    {"displacement", "EmbedStatic", SectionKind::linear, "1*count", "displacement_width", {list_6, 4}, nullptr, 0, "displacement_scale", "2*1", {list_52, 1}},
    {"local_offset", "EmbedStatic", SectionKind::linear, "3*count", "local_offset_width", {list_6, 4}, nullptr, 0, "local_offset_scale", "2*3", {list_54, 1}},
    {"local_quat", "EmbedStatic", SectionKind::linear, "4*count", "local_quat_width", {list_6, 4}, nullptr, 0, "local_quat_scale", "2*4", {nullptr, 0}},
};
const Contract bind_surface_access = {
    "count", {list_47, 3}, {list_48, 4}, {nullptr, 0}, {nullptr, 0}, {list_49, 3}, "count", {nullptr, 0},
    {list_50, 4}, {list_55, 5},
};

const StorageBuffer activate_storage[] = {{"Splats", 0, 16, false}};
const Member activate_members[] = {{"count", 0, ConstantType::uint}};
const Contract activate_access = {
    "count", {list_10, 1}, {nullptr, 0}, {nullptr, 0}, {nullptr, 0}, {list_29, 1}, "count", {nullptr, 0},
    {list_30, 1}, {nullptr, 0},
};

const StorageBuffer project_storage[] = {{"Splats", 0, 16, true}, {"Sh", 1, 4, true}, {"Projected", 2, 16, false}};
const Member project_members[] = {
    {"count", 0, ConstantType::uint}, {"sh_degree", 4, ConstantType::uint}, {"near_z", 8, ConstantType::float1},
    {"low_pass", 12, ConstantType::float1}, {"camera_row0", 16, ConstantType::float4},
    {"camera_row1", 32, ConstantType::float4}, {"camera_row2", 48, ConstantType::float4},
    {"clip_row0", 64, ConstantType::float4}, {"clip_row1", 80, ConstantType::float4},
    {"clip_row2", 96, ConstantType::float4}, {"clip_row3", 112, ConstantType::float4},
    {"eye", 128, ConstantType::float4}, {"tan_half_fov", 144, ConstantType::float2},
    {"image_size", 152, ConstantType::float2},
};
const Values list_56[] = {{"sh_degree", {list_23, 4}}};
const Same list_57[] = {{"Splats", {list_17, 1}}, {"Projected", {list_17, 1}}, {"Sh", {list_17, 1}}};
const uint32_t list_58[] = {0};
const Values list_59[] = {{"sh_degree", {list_58, 1}}};
const Values list_60[] = {{"sh_degree", {list_53, 1}}};
const uint32_t list_61[] = {2};
const Values list_62[] = {{"sh_degree", {list_61, 1}}};
const Values list_63[] = {{"sh_degree", {list_43, 1}}};
const Touched list_64[] = {
    {"Splats", "5*count", {nullptr, 0}}, {"Projected", "3*count", {nullptr, 0}}, {"Sh", "3*count", {list_59, 1}},
    {"Sh", "12*count", {list_60, 1}}, {"Sh", "27*count", {list_62, 1}}, {"Sh", "48*count", {list_63, 1}},
};
const Contract project_access = {
    "count", {list_10, 1}, {list_56, 1}, {nullptr, 0}, {nullptr, 0}, {list_57, 3}, "count", {nullptr, 0},
    {list_64, 6}, {nullptr, 0},
};

const StorageBuffer shadow_clear_storage[] = {{"Shadow", 0, 4, false}};
const Member shadow_clear_members[] = {{"texels", 0, ConstantType::uint}};
const Most list_65[] = {{"texels", 4194240}};
const uint32_t list_66[] = {65536};
const Values list_67[] = {{"texels", {list_66, 1}}};
const Touched list_68[] = {{"Shadow", "65536", {nullptr, 0}}};
const Contract shadow_clear_access = {
    "texels", {list_65, 1}, {list_67, 1}, {nullptr, 0}, {nullptr, 0}, {nullptr, 0}, nullptr, {nullptr, 0},
    {list_68, 1}, {nullptr, 0},
};

const StorageBuffer shadow_mesh_storage[] = {
    {"CornerStatic", 0, 4, true}, {"Mesh", 1, 16, true}, {"Shadow", 2, 4, false},
};
const Member shadow_mesh_members[] = {
    {"triangles", 0, ConstantType::uint}, {"vertices", 4, ConstantType::uint}, {"corners", 8, ConstantType::uint},
    {"corners_width", 12, ConstantType::uint}, {"world_row0", 16, ConstantType::float4},
    {"world_row1", 32, ConstantType::float4}, {"world_row2", 48, ConstantType::float4},
    {"shadow_row0", 64, ConstantType::float4}, {"shadow_row1", 80, ConstantType::float4},
    {"shadow_row2", 96, ConstantType::float4}, {"shadow_row3", 112, ConstantType::float4},
};
const Touched list_69[] = {{"Mesh", "vertices", {nullptr, 0}}, {"Shadow", "65536", {nullptr, 0}}};
const SectionContract list_70[] = {
    {"corners", "CornerStatic", SectionKind::index, "3*triangles", "corners_width", {list_8, 3}, "vertices", 0, nullptr, nullptr, {nullptr, 0}},
};
const Contract shadow_mesh_access = {
    "triangles", {list_32, 2}, {nullptr, 0}, {nullptr, 0}, {nullptr, 0}, {list_4, 1}, nullptr, {nullptr, 0},
    {list_69, 2}, {list_70, 1},
};

const StorageBuffer shadow_storage[] = {{"Splats", 0, 16, true}, {"Shadow", 1, 4, false}};
const Member shadow_members[] = {
    {"shadow_row0", 0, ConstantType::float4}, {"shadow_row1", 16, ConstantType::float4},
    {"shadow_row2", 32, ConstantType::float4}, {"shadow_row3", 48, ConstantType::float4},
    {"count", 64, ConstantType::uint},
};
const Touched list_71[] = {{"Splats", "5*count", {nullptr, 0}}, {"Shadow", "65536", {nullptr, 0}}};
const Contract shadow_access = {
    "count", {list_10, 1}, {nullptr, 0}, {nullptr, 0}, {nullptr, 0}, {list_29, 1}, "count", {nullptr, 0},
    {list_71, 2}, {nullptr, 0},
};

const StorageBuffer light_normals_storage[] = {
    {"EmbedStatic", 0, 4, true}, {"LightStatic", 1, 4, true}, {"Triangles", 2, 16, true}, {"Splats", 3, 16, false},
};
const Member light_normals_members[] = {
    {"world_quat_wxyz", 0, ConstantType::float4}, {"count", 16, ConstantType::uint},
    {"triangles", 20, ConstantType::uint}, {"triangle_ids", 24, ConstantType::uint},
    {"triangle_ids_width", 28, ConstantType::uint}, {"local_quat", 32, ConstantType::uint},
    {"local_quat_width", 36, ConstantType::uint}, {"local_quat_scale", 40, ConstantType::uint},
    {"normal", 44, ConstantType::uint}, {"normal_width", 48, ConstantType::uint},
    {"normal_scale", 52, ConstantType::uint},
};
const Most list_72[] = {{"count", 4194240}, {"triangles", 4194240}};
const char* const list_73[] = {"triangles"};
const Same list_74[] = {{"Splats", {list_17, 1}}, {"Triangles", {list_73, 1}}};
const Touched list_75[] = {{"Splats", "6*count", {nullptr, 0}}, {"Triangles", "3*triangles", {nullptr, 0}}};
const SectionContract list_76[] = {
    {"triangle_ids", "EmbedStatic", SectionKind::index, "count", "triangle_ids_width", {list_8, 3}, "triangles", 0, nullptr, nullptr, {nullptr, 0}},
    {"local_quat", "EmbedStatic", SectionKind::linear, "4*count", "local_quat_width", {list_6, 4}, nullptr, 0, "local_quat_scale", "2*4", {nullptr, 0}},
    {"normal", "LightStatic", SectionKind::linear, "3*count", "normal_width", {list_6, 4}, nullptr, 0, "normal_scale", "2*3", {nullptr, 0}},
};
const Contract light_normals_access = {
    "count", {list_72, 2}, {nullptr, 0}, {nullptr, 0}, {nullptr, 0}, {list_74, 2}, "count", {nullptr, 0},
    {list_75, 2}, {list_76, 3},
};

const StorageBuffer light_storage[] = {
    {"LightStatic", 0, 4, true}, {"Splats", 1, 16, true}, {"Shadow", 2, 4, true}, {"Projected", 3, 16, false},
};
const Member light_members[] = {
    {"count", 0, ConstantType::uint}, {"normal", 4, ConstantType::uint}, {"normal_width", 8, ConstantType::uint},
    {"normal_scale", 12, ConstantType::uint}, {"turn_row0", 16, ConstantType::float4},
    {"turn_row1", 32, ConstantType::float4}, {"turn_row2", 48, ConstantType::float4},
    {"capture_ambient0", 64, ConstantType::float4}, {"capture_ambient1", 80, ConstantType::float4},
    {"capture_ambient2", 96, ConstantType::float4}, {"capture_ambient3", 112, ConstantType::float4},
    {"capture_ambient4", 128, ConstantType::float4}, {"capture_ambient5", 144, ConstantType::float4},
    {"capture_ambient6", 160, ConstantType::float4}, {"capture_ambient7", 176, ConstantType::float4},
    {"capture_ambient8", 192, ConstantType::float4}, {"scene_ambient0", 208, ConstantType::float4},
    {"scene_ambient1", 224, ConstantType::float4}, {"scene_ambient2", 240, ConstantType::float4},
    {"scene_ambient3", 256, ConstantType::float4}, {"scene_ambient4", 272, ConstantType::float4},
    {"scene_ambient5", 288, ConstantType::float4}, {"scene_ambient6", 304, ConstantType::float4},
    {"scene_ambient7", 320, ConstantType::float4}, {"scene_ambient8", 336, ConstantType::float4},
    {"place0", 352, ConstantType::float4}, {"place1", 368, ConstantType::float4},
    {"place2", 384, ConstantType::float4}, {"place3", 400, ConstantType::float4},
    {"colour0", 416, ConstantType::float4}, {"colour1", 432, ConstantType::float4},
    {"colour2", 448, ConstantType::float4}, {"colour3", 464, ConstantType::float4},
    {"shadow_row0", 480, ConstantType::float4}, {"shadow_row1", 496, ConstantType::float4},
    {"shadow_row2", 512, ConstantType::float4}, {"shadow_row3", 528, ConstantType::float4},
    {"shadow_offset", 544, ConstantType::float4}, {"turned", 560, ConstantType::uint},
};
const Values list_77[] = {{"turned", {list_25, 2}}};
const Same list_78[] = {{"Splats", {list_17, 1}}, {"Projected", {list_17, 1}}};
const Values list_79[] = {{"turned", {list_53, 1}}};
const Touched list_80[] = {
    {"Splats", "5*count", {nullptr, 0}}, {"Splats", "6*count", {list_79, 1}}, {"Projected", "3*count", {nullptr, 0}},
    {"Shadow", "65536", {nullptr, 0}},
};
const SectionContract list_81[] = {
    {"normal", "LightStatic", SectionKind::linear, "3*count", "normal_width", {list_6, 4}, nullptr, 0, "normal_scale", "2*3", {nullptr, 0}},
};
const Contract light_access = {
    "count", {list_10, 1}, {list_77, 1}, {nullptr, 0}, {nullptr, 0}, {list_78, 2}, "count", {nullptr, 0},
    {list_80, 4}, {list_81, 1},
};

const StorageBuffer sort_keys_storage[] = {{"Projected", 0, 16, true}, {"Pairs", 1, 8, false}};
const Member sort_keys_members[] = {{"count", 0, ConstantType::uint}, {"first", 4, ConstantType::uint}};
const StorageBuffer sort_count_storage[] = {{"Pairs", 0, 8, true}, {"Counts", 1, 4, false}};
const Member sort_count_members[] = {
    {"count", 0, ConstantType::uint}, {"groups", 4, ConstantType::uint}, {"shift", 8, ConstantType::uint},
};
const StorageBuffer sort_scan_storage[] = {{"Counts", 0, 4, false}};
const Member sort_scan_members[] = {{"total", 0, ConstantType::uint}};
const StorageBuffer sort_scatter_storage[] = {
    {"Pairs", 0, 8, true}, {"Counts", 1, 4, true}, {"PairsOut", 2, 8, false},
};
const Member sort_scatter_members[] = {
    {"count", 0, ConstantType::uint}, {"groups", 4, ConstantType::uint}, {"shift", 8, ConstantType::uint},
};
const StorageBuffer raster_gather_storage[] = {
    {"Projected", 0, 16, true}, {"Pairs", 1, 8, true}, {"Quads", 2, 16, false},
};
const Member raster_gather_members[] = {
    {"count", 0, ConstantType::uint}, {"begin", 4, ConstantType::uint}, {"piece_count", 8, ConstantType::uint},
    {"first", 12, ConstantType::uint}, {"chunk_count", 16, ConstantType::uint}, {"reverse", 20, ConstantType::uint},
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
    {"shadow_clear", "shadow", 64, 8, 16, {shadow_clear_storage, 1}, {shadow_clear_members, 1}, &shadow_clear_access},
    {"shadow_mesh", "shadow", 64, 8, 128, {shadow_mesh_storage, 3}, {shadow_mesh_members, 11}, &shadow_mesh_access},
    {"shadow", "shadow", 64, 8, 80, {shadow_storage, 2}, {shadow_members, 5}, &shadow_access},
    {"light_normals", "light", 64, 8, 64, {light_normals_storage, 4}, {light_normals_members, 11}, &light_normals_access},
    {"light", "light", 64, 8, 576, {light_storage, 4}, {light_members, 39}, &light_access},
    {"sort_keys", "sort", 64, 8, 16, {sort_keys_storage, 2}, {sort_keys_members, 2}, nullptr},
    {"sort_count", "sort", 64, 8, 16, {sort_count_storage, 2}, {sort_count_members, 3}, nullptr},
    {"sort_scan", "sort", 128, 8, 16, {sort_scan_storage, 1}, {sort_scan_members, 1}, nullptr},
    {"sort_scatter", "sort", 64, 8, 16, {sort_scatter_storage, 3}, {sort_scatter_members, 3}, nullptr},
    {"raster_gather", "raster", 64, 8, 32, {raster_gather_storage, 3}, {raster_gather_members, 6}, nullptr},
};
const uint32_t interface_count = 19;

}  // namespace avatar
