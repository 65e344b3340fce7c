// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#include "GaussianAvatarKernels.h"

#include "RenderGraphBuilder.h"
#include "RenderGraphUtils.h"

#include <cstring>

IMPLEMENT_GLOBAL_SHADER(FAvatarMorph, "/Plugin/GaussianAvatar/morph.usf", "morph", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarSkin, "/Plugin/GaussianAvatar/skin.usf", "skin", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarBlend, "/Plugin/GaussianAvatar/blend.usf", "blend", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarBindSkin, "/Plugin/GaussianAvatar/bind_skin.usf", "bind_skin", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarBindTriangles, "/Plugin/GaussianAvatar/bind_triangles.usf", "bind_triangles", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarBindVertices, "/Plugin/GaussianAvatar/bind_vertices.usf", "bind_vertices", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarBindSurface, "/Plugin/GaussianAvatar/bind_surface.usf", "bind_surface", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarActivate, "/Plugin/GaussianAvatar/activate.usf", "activate", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarProject, "/Plugin/GaussianAvatar/project.usf", "project", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarSortKeys, "/Plugin/GaussianAvatar/sort_keys.usf", "sort_keys", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarSortCount, "/Plugin/GaussianAvatar/sort_count.usf", "sort_count", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarSortScan, "/Plugin/GaussianAvatar/sort_scan.usf", "sort_scan", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarSortScatter, "/Plugin/GaussianAvatar/sort_scatter.usf", "sort_scatter", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarRasterGather, "/Plugin/GaussianAvatar/raster_gather.usf", "raster_gather", SF_Compute);
IMPLEMENT_GLOBAL_SHADER(FAvatarRasterVertexFetch, "/Plugin/GaussianAvatar/raster.usf", "raster_vertex_fetch", SF_Vertex);
IMPLEMENT_GLOBAL_SHADER(FAvatarRasterPixel, "/Plugin/GaussianAvatar/raster.usf", "raster_pixel", SF_Pixel);
IMPLEMENT_GLOBAL_SHADER(FAvatarUnrealDepthPixel, "/Plugin/GaussianAvatar/unreal_draw.usf", "unreal_depth_pixel", SF_Pixel);
IMPLEMENT_GLOBAL_SHADER(FAvatarUnrealCompositePixel, "/Plugin/GaussianAvatar/unreal_draw.usf", "unreal_composite_pixel", SF_Pixel);

namespace
{
void AddAvatarMorph(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarMorph::FParameters* Parameters = Builder.AllocParameters<FAvatarMorph::FParameters>();
	std::memcpy(&Parameters->first, Block + 0, 4);
	std::memcpy(&Parameters->count, Block + 4, 4);
	std::memcpy(&Parameters->vertices, Block + 8, 4);
	std::memcpy(&Parameters->template_position, Block + 12, 4);
	std::memcpy(&Parameters->template_position_width, Block + 16, 4);
	std::memcpy(&Parameters->template_position_scale, Block + 20, 4);
	std::memcpy(&Parameters->morph_ptr, Block + 24, 4);
	std::memcpy(&Parameters->morph_column, Block + 28, 4);
	std::memcpy(&Parameters->morph_column_width, Block + 32, 4);
	std::memcpy(&Parameters->morph_position, Block + 36, 4);
	std::memcpy(&Parameters->morph_position_width, Block + 40, 4);
	std::memcpy(&Parameters->morph_position_step, Block + 44, 4);
	std::memcpy(&Parameters->corrective_ptr, Block + 48, 4);
	std::memcpy(&Parameters->corrective_column, Block + 52, 4);
	std::memcpy(&Parameters->corrective_column_width, Block + 56, 4);
	std::memcpy(&Parameters->corrective_position, Block + 60, 4);
	std::memcpy(&Parameters->corrective_position_width, Block + 64, 4);
	std::memcpy(&Parameters->corrective_position_step, Block + 68, 4);
	std::memcpy(&Parameters->weights, Block + 72, 4);
	std::memcpy(&Parameters->features, Block + 76, 4);
	Parameters->MorphStatic = Builder.CreateSRV(Buffers[0]);
	Parameters->Pose = Builder.CreateSRV(Buffers[1]);
	Parameters->Mesh = Builder.CreateUAV(Buffers[2]);
	const TShaderMapRef<FAvatarMorph> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("morph"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarSkin(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarSkin::FParameters* Parameters = Builder.AllocParameters<FAvatarSkin::FParameters>();
	std::memcpy(&Parameters->first, Block + 0, 4);
	std::memcpy(&Parameters->count, Block + 4, 4);
	std::memcpy(&Parameters->late_ptr, Block + 8, 4);
	std::memcpy(&Parameters->late_column, Block + 12, 4);
	std::memcpy(&Parameters->late_column_width, Block + 16, 4);
	std::memcpy(&Parameters->late_position, Block + 20, 4);
	std::memcpy(&Parameters->late_position_width, Block + 24, 4);
	std::memcpy(&Parameters->late_position_step, Block + 28, 4);
	std::memcpy(&Parameters->skin_ptr, Block + 32, 4);
	std::memcpy(&Parameters->skin_column, Block + 36, 4);
	std::memcpy(&Parameters->skin_column_width, Block + 40, 4);
	std::memcpy(&Parameters->skin_weight, Block + 44, 4);
	std::memcpy(&Parameters->skin_weight_width, Block + 48, 4);
	std::memcpy(&Parameters->skin_weight_step, Block + 52, 4);
	std::memcpy(&Parameters->late, Block + 56, 4);
	std::memcpy(&Parameters->joints, Block + 60, 4);
	Parameters->SkinStatic = Builder.CreateSRV(Buffers[0]);
	Parameters->Pose = Builder.CreateSRV(Buffers[1]);
	Parameters->Mesh = Builder.CreateUAV(Buffers[2]);
	const TShaderMapRef<FAvatarSkin> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("skin"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarBlend(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarBlend::FParameters* Parameters = Builder.AllocParameters<FAvatarBlend::FParameters>();
	std::memcpy(&Parameters->count, Block + 0, 4);
	std::memcpy(&Parameters->sh_terms, Block + 4, 4);
	std::memcpy(&Parameters->weights, Block + 8, 4);
	std::memcpy(&Parameters->base_mean, Block + 12, 4);
	std::memcpy(&Parameters->base_mean_width, Block + 16, 4);
	std::memcpy(&Parameters->base_mean_scale, Block + 20, 4);
	std::memcpy(&Parameters->base_log_scale, Block + 24, 4);
	std::memcpy(&Parameters->base_log_scale_width, Block + 28, 4);
	std::memcpy(&Parameters->base_log_scale_scale, Block + 32, 4);
	std::memcpy(&Parameters->base_quat, Block + 36, 4);
	std::memcpy(&Parameters->base_quat_width, Block + 40, 4);
	std::memcpy(&Parameters->base_quat_scale, Block + 44, 4);
	std::memcpy(&Parameters->base_opacity, Block + 48, 4);
	std::memcpy(&Parameters->base_opacity_width, Block + 52, 4);
	std::memcpy(&Parameters->base_opacity_table, Block + 56, 4);
	std::memcpy(&Parameters->base_sh, Block + 60, 4);
	std::memcpy(&Parameters->base_sh_width, Block + 64, 4);
	std::memcpy(&Parameters->base_sh_scale, Block + 68, 4);
	std::memcpy(&Parameters->geometry_ptr, Block + 72, 4);
	std::memcpy(&Parameters->geometry_column, Block + 76, 4);
	std::memcpy(&Parameters->geometry_column_width, Block + 80, 4);
	std::memcpy(&Parameters->geometry_mean, Block + 84, 4);
	std::memcpy(&Parameters->geometry_mean_width, Block + 88, 4);
	std::memcpy(&Parameters->geometry_mean_step, Block + 92, 4);
	std::memcpy(&Parameters->geometry_quat, Block + 96, 4);
	std::memcpy(&Parameters->geometry_quat_width, Block + 100, 4);
	std::memcpy(&Parameters->geometry_quat_step, Block + 104, 4);
	std::memcpy(&Parameters->appearance_ptr, Block + 108, 4);
	std::memcpy(&Parameters->appearance_column, Block + 112, 4);
	std::memcpy(&Parameters->appearance_column_width, Block + 116, 4);
	std::memcpy(&Parameters->appearance_log_scale, Block + 120, 4);
	std::memcpy(&Parameters->appearance_log_scale_width, Block + 124, 4);
	std::memcpy(&Parameters->appearance_log_scale_step, Block + 128, 4);
	std::memcpy(&Parameters->appearance_opacity, Block + 132, 4);
	std::memcpy(&Parameters->appearance_opacity_width, Block + 136, 4);
	std::memcpy(&Parameters->appearance_opacity_step, Block + 140, 4);
	std::memcpy(&Parameters->appearance_sh, Block + 144, 4);
	std::memcpy(&Parameters->appearance_sh_width, Block + 148, 4);
	std::memcpy(&Parameters->appearance_sh_step, Block + 152, 4);
	std::memcpy(&Parameters->unused, Block + 156, 4);
	Parameters->BlendStatic = Builder.CreateSRV(Buffers[0]);
	Parameters->Pose = Builder.CreateSRV(Buffers[1]);
	Parameters->Splats = Builder.CreateUAV(Buffers[2]);
	Parameters->Sh = Builder.CreateUAV(Buffers[3]);
	const TShaderMapRef<FAvatarBlend> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("blend"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarBindSkin(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarBindSkin::FParameters* Parameters = Builder.AllocParameters<FAvatarBindSkin::FParameters>();
	std::memcpy(&Parameters->count, Block + 0, 4);
	std::memcpy(&Parameters->first, Block + 4, 4);
	std::memcpy(&Parameters->rows, Block + 8, 4);
	std::memcpy(&Parameters->corrective_ptr, Block + 12, 4);
	std::memcpy(&Parameters->corrective_column, Block + 16, 4);
	std::memcpy(&Parameters->corrective_column_width, Block + 20, 4);
	std::memcpy(&Parameters->corrective_mean, Block + 24, 4);
	std::memcpy(&Parameters->corrective_mean_width, Block + 28, 4);
	std::memcpy(&Parameters->corrective_mean_step, Block + 32, 4);
	std::memcpy(&Parameters->late_ptr, Block + 36, 4);
	std::memcpy(&Parameters->late_column, Block + 40, 4);
	std::memcpy(&Parameters->late_column_width, Block + 44, 4);
	std::memcpy(&Parameters->late_mean, Block + 48, 4);
	std::memcpy(&Parameters->late_mean_width, Block + 52, 4);
	std::memcpy(&Parameters->late_mean_step, Block + 56, 4);
	std::memcpy(&Parameters->skin_ptr, Block + 60, 4);
	std::memcpy(&Parameters->skin_column, Block + 64, 4);
	std::memcpy(&Parameters->skin_column_width, Block + 68, 4);
	std::memcpy(&Parameters->skin_weight, Block + 72, 4);
	std::memcpy(&Parameters->skin_weight_width, Block + 76, 4);
	std::memcpy(&Parameters->skin_weight_step, Block + 80, 4);
	std::memcpy(&Parameters->features, Block + 84, 4);
	std::memcpy(&Parameters->late, Block + 88, 4);
	std::memcpy(&Parameters->joints, Block + 92, 4);
	std::memcpy(&Parameters->binding_rule, Block + 96, 4);
	std::memcpy(&Parameters->rotation_rule, Block + 100, 4);
	std::memcpy(&Parameters->sh_direction, Block + 104, 4);
	std::memcpy(&Parameters->unused, Block + 108, 4);
	std::memcpy(&Parameters->group_matrix_row0, Block + 112, 16);
	std::memcpy(&Parameters->group_matrix_row1, Block + 128, 16);
	std::memcpy(&Parameters->group_matrix_row2, Block + 144, 16);
	std::memcpy(&Parameters->group_rotation_row0, Block + 160, 16);
	std::memcpy(&Parameters->group_rotation_row1, Block + 176, 16);
	std::memcpy(&Parameters->group_rotation_row2, Block + 192, 16);
	std::memcpy(&Parameters->world_row0, Block + 208, 16);
	std::memcpy(&Parameters->world_row1, Block + 224, 16);
	std::memcpy(&Parameters->world_row2, Block + 240, 16);
	std::memcpy(&Parameters->world_quat_wxyz, Block + 256, 16);
	Parameters->BindStatic = Builder.CreateSRV(Buffers[0]);
	Parameters->Pose = Builder.CreateSRV(Buffers[1]);
	Parameters->Splats = Builder.CreateUAV(Buffers[2]);
	const TShaderMapRef<FAvatarBindSkin> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("bind_skin"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarBindTriangles(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarBindTriangles::FParameters* Parameters = Builder.AllocParameters<FAvatarBindTriangles::FParameters>();
	std::memcpy(&Parameters->triangles, Block + 0, 4);
	std::memcpy(&Parameters->vertices, Block + 4, 4);
	std::memcpy(&Parameters->corners, Block + 8, 4);
	std::memcpy(&Parameters->corners_width, Block + 12, 4);
	std::memcpy(&Parameters->canonical, Block + 16, 4);
	std::memcpy(&Parameters->canonical_width, Block + 20, 4);
	std::memcpy(&Parameters->canonical_scale, Block + 24, 4);
	std::memcpy(&Parameters->rotation_rule, Block + 28, 4);
	std::memcpy(&Parameters->quaternion_sign, Block + 32, 4);
	Parameters->SurfaceStatic = Builder.CreateSRV(Buffers[0]);
	Parameters->Mesh = Builder.CreateSRV(Buffers[1]);
	Parameters->Triangles = Builder.CreateUAV(Buffers[2]);
	const TShaderMapRef<FAvatarBindTriangles> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("bind_triangles"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarBindVertices(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarBindVertices::FParameters* Parameters = Builder.AllocParameters<FAvatarBindVertices::FParameters>();
	std::memcpy(&Parameters->vertices, Block + 0, 4);
	std::memcpy(&Parameters->triangles, Block + 4, 4);
	std::memcpy(&Parameters->vertex_triangle_ptr, Block + 8, 4);
	std::memcpy(&Parameters->vertex_triangle, Block + 12, 4);
	std::memcpy(&Parameters->vertex_triangle_width, Block + 16, 4);
	std::memcpy(&Parameters->normal_floor, Block + 20, 4);
	std::memcpy(&Parameters->quaternion_floor, Block + 24, 4);
	std::memcpy(&Parameters->rotation_rule, Block + 28, 4);
	std::memcpy(&Parameters->skin_ptr, Block + 32, 4);
	std::memcpy(&Parameters->skin_column, Block + 36, 4);
	std::memcpy(&Parameters->skin_column_width, Block + 40, 4);
	std::memcpy(&Parameters->skin_weight, Block + 44, 4);
	std::memcpy(&Parameters->skin_weight_width, Block + 48, 4);
	std::memcpy(&Parameters->skin_weight_step, Block + 52, 4);
	std::memcpy(&Parameters->joints, Block + 56, 4);
	Parameters->SurfaceStatic = Builder.CreateSRV(Buffers[0]);
	Parameters->Triangles = Builder.CreateSRV(Buffers[1]);
	Parameters->Pose = Builder.CreateSRV(Buffers[2]);
	Parameters->Mesh = Builder.CreateUAV(Buffers[3]);
	const TShaderMapRef<FAvatarBindVertices> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("bind_vertices"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarBindSurface(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarBindSurface::FParameters* Parameters = Builder.AllocParameters<FAvatarBindSurface::FParameters>();
	std::memcpy(&Parameters->count, Block + 0, 4);
	std::memcpy(&Parameters->vertices, Block + 4, 4);
	std::memcpy(&Parameters->triangles, Block + 8, 4);
	std::memcpy(&Parameters->triangle_ids, Block + 12, 4);
	std::memcpy(&Parameters->triangle_ids_width, Block + 16, 4);
	std::memcpy(&Parameters->barycentric, Block + 20, 4);
	std::memcpy(&Parameters->barycentric_width, Block + 24, 4);
	std::memcpy(&Parameters->barycentric_scale, Block + 28, 4);
	std::memcpy(&Parameters->displacement, Block + 32, 4);
	std::memcpy(&Parameters->displacement_width, Block + 36, 4);
	std::memcpy(&Parameters->displacement_scale, Block + 40, 4);
	std::memcpy(&Parameters->local_offset, Block + 44, 4);
	std::memcpy(&Parameters->local_offset_width, Block + 48, 4);
	std::memcpy(&Parameters->local_offset_scale, Block + 52, 4);
	std::memcpy(&Parameters->local_quat, Block + 56, 4);
	std::memcpy(&Parameters->local_quat_width, Block + 60, 4);
	std::memcpy(&Parameters->local_quat_scale, Block + 64, 4);
	std::memcpy(&Parameters->position_rule, Block + 68, 4);
	std::memcpy(&Parameters->rotation_rule, Block + 72, 4);
	std::memcpy(&Parameters->scale_rule, Block + 76, 4);
	std::memcpy(&Parameters->sh_direction, Block + 80, 4);
	std::memcpy(&Parameters->unused, Block + 84, 4);
	std::memcpy(&Parameters->area_damping, Block + 88, 4);
	std::memcpy(&Parameters->log_training_per_bundle, Block + 92, 4);
	std::memcpy(&Parameters->world_row0, Block + 96, 16);
	std::memcpy(&Parameters->world_row1, Block + 112, 16);
	std::memcpy(&Parameters->world_row2, Block + 128, 16);
	std::memcpy(&Parameters->world_quat_wxyz, Block + 144, 16);
	Parameters->EmbedStatic = Builder.CreateSRV(Buffers[0]);
	Parameters->Mesh = Builder.CreateSRV(Buffers[1]);
	Parameters->Triangles = Builder.CreateSRV(Buffers[2]);
	Parameters->Splats = Builder.CreateUAV(Buffers[3]);
	const TShaderMapRef<FAvatarBindSurface> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("bind_surface"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarActivate(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarActivate::FParameters* Parameters = Builder.AllocParameters<FAvatarActivate::FParameters>();
	std::memcpy(&Parameters->count, Block + 0, 4);
	Parameters->Splats = Builder.CreateUAV(Buffers[0]);
	const TShaderMapRef<FAvatarActivate> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("activate"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarProject(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarProject::FParameters* Parameters = Builder.AllocParameters<FAvatarProject::FParameters>();
	std::memcpy(&Parameters->count, Block + 0, 4);
	std::memcpy(&Parameters->sh_degree, Block + 4, 4);
	std::memcpy(&Parameters->near_z, Block + 8, 4);
	std::memcpy(&Parameters->low_pass, Block + 12, 4);
	std::memcpy(&Parameters->camera_row0, Block + 16, 16);
	std::memcpy(&Parameters->camera_row1, Block + 32, 16);
	std::memcpy(&Parameters->camera_row2, Block + 48, 16);
	std::memcpy(&Parameters->clip_row0, Block + 64, 16);
	std::memcpy(&Parameters->clip_row1, Block + 80, 16);
	std::memcpy(&Parameters->clip_row2, Block + 96, 16);
	std::memcpy(&Parameters->clip_row3, Block + 112, 16);
	std::memcpy(&Parameters->eye, Block + 128, 16);
	std::memcpy(&Parameters->tan_half_fov, Block + 144, 8);
	std::memcpy(&Parameters->image_size, Block + 152, 8);
	Parameters->Splats = Builder.CreateSRV(Buffers[0]);
	Parameters->Sh = Builder.CreateSRV(Buffers[1]);
	Parameters->Projected = Builder.CreateUAV(Buffers[2]);
	const TShaderMapRef<FAvatarProject> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("project"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarSortKeys(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarSortKeys::FParameters* Parameters = Builder.AllocParameters<FAvatarSortKeys::FParameters>();
	std::memcpy(&Parameters->count, Block + 0, 4);
	std::memcpy(&Parameters->first, Block + 4, 4);
	Parameters->Projected = Builder.CreateSRV(Buffers[0]);
	Parameters->Pairs = Builder.CreateUAV(Buffers[1]);
	const TShaderMapRef<FAvatarSortKeys> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("sort_keys"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarSortCount(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarSortCount::FParameters* Parameters = Builder.AllocParameters<FAvatarSortCount::FParameters>();
	std::memcpy(&Parameters->count, Block + 0, 4);
	std::memcpy(&Parameters->groups, Block + 4, 4);
	std::memcpy(&Parameters->shift, Block + 8, 4);
	Parameters->Pairs = Builder.CreateSRV(Buffers[0]);
	Parameters->Counts = Builder.CreateUAV(Buffers[1]);
	const TShaderMapRef<FAvatarSortCount> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("sort_count"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarSortScan(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarSortScan::FParameters* Parameters = Builder.AllocParameters<FAvatarSortScan::FParameters>();
	std::memcpy(&Parameters->total, Block + 0, 4);
	Parameters->Counts = Builder.CreateUAV(Buffers[0]);
	const TShaderMapRef<FAvatarSortScan> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("sort_scan"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarSortScatter(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarSortScatter::FParameters* Parameters = Builder.AllocParameters<FAvatarSortScatter::FParameters>();
	std::memcpy(&Parameters->count, Block + 0, 4);
	std::memcpy(&Parameters->groups, Block + 4, 4);
	std::memcpy(&Parameters->shift, Block + 8, 4);
	Parameters->Pairs = Builder.CreateSRV(Buffers[0]);
	Parameters->Counts = Builder.CreateSRV(Buffers[1]);
	Parameters->PairsOut = Builder.CreateUAV(Buffers[2]);
	const TShaderMapRef<FAvatarSortScatter> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("sort_scatter"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

void AddAvatarRasterGather(FRDGBuilder& Builder, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	FAvatarRasterGather::FParameters* Parameters = Builder.AllocParameters<FAvatarRasterGather::FParameters>();
	std::memcpy(&Parameters->count, Block + 0, 4);
	std::memcpy(&Parameters->begin, Block + 4, 4);
	std::memcpy(&Parameters->piece_count, Block + 8, 4);
	std::memcpy(&Parameters->first, Block + 12, 4);
	std::memcpy(&Parameters->chunk_count, Block + 16, 4);
	std::memcpy(&Parameters->reverse, Block + 20, 4);
	Parameters->Projected = Builder.CreateSRV(Buffers[0]);
	Parameters->Pairs = Builder.CreateSRV(Buffers[1]);
	Parameters->Quads = Builder.CreateUAV(Buffers[2]);
	const TShaderMapRef<FAvatarRasterGather> Shader(GetGlobalShaderMap(GMaxRHIFeatureLevel));
	FComputeShaderUtils::AddPass(Builder, RDG_EVENT_NAME("raster_gather"), Shader, Parameters, FIntVector(static_cast<int32>(Groups), 1, 1));
}

}

uint32 AvatarStride(const char* Name)
{
	if (std::strcmp(Name, "MorphStatic") == 0) return 4;
	if (std::strcmp(Name, "Pose") == 0) return 4;
	if (std::strcmp(Name, "Mesh") == 0) return 16;
	if (std::strcmp(Name, "SkinStatic") == 0) return 4;
	if (std::strcmp(Name, "BlendStatic") == 0) return 4;
	if (std::strcmp(Name, "Splats") == 0) return 16;
	if (std::strcmp(Name, "Sh") == 0) return 4;
	if (std::strcmp(Name, "BindStatic") == 0) return 4;
	if (std::strcmp(Name, "SurfaceStatic") == 0) return 4;
	if (std::strcmp(Name, "Triangles") == 0) return 16;
	if (std::strcmp(Name, "EmbedStatic") == 0) return 4;
	if (std::strcmp(Name, "Projected") == 0) return 16;
	if (std::strcmp(Name, "Pairs") == 0) return 8;
	if (std::strcmp(Name, "Counts") == 0) return 4;
	if (std::strcmp(Name, "PairsOut") == 0) return 8;
	if (std::strcmp(Name, "Quads") == 0) return 16;
	return 0;
}

void AddAvatarPass(FRDGBuilder& Builder, const char* Entry, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups)
{
	if (std::strcmp(Entry, "morph") == 0) AddAvatarMorph(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "skin") == 0) AddAvatarSkin(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "blend") == 0) AddAvatarBlend(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "bind_skin") == 0) AddAvatarBindSkin(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "bind_triangles") == 0) AddAvatarBindTriangles(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "bind_vertices") == 0) AddAvatarBindVertices(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "bind_surface") == 0) AddAvatarBindSurface(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "activate") == 0) AddAvatarActivate(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "project") == 0) AddAvatarProject(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "sort_keys") == 0) AddAvatarSortKeys(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "sort_count") == 0) AddAvatarSortCount(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "sort_scan") == 0) AddAvatarSortScan(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "sort_scatter") == 0) AddAvatarSortScatter(Builder, Block, Buffers, Groups);
	if (std::strcmp(Entry, "raster_gather") == 0) AddAvatarRasterGather(Builder, Block, Buffers, Groups);
}
