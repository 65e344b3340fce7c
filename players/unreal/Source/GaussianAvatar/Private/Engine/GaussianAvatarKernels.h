// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.
#pragma once
#include "DataDrivenShaderPlatformInfo.h"
#include "GlobalShader.h"
#include "RenderGraphResources.h"
#include "ShaderParameterStruct.h"

class FRDGBuilder;

/** Storage buffers of a kernel, at most. */
constexpr uint32 AvatarMostBindings = 4;

/** Bytes of an element of the buffer that shaders know by a name; 0 for an unknown one. */
uint32 AvatarStride(const char* Name);

/** Adds a dispatch. Block: its constants, in the layout of the shader texts. Buffers by binding. */
void AddAvatarPass(FRDGBuilder& Builder, const char* Entry, const uint8* Block, const FRDGBufferRef* Buffers, uint32 Groups);

/** Entry morph. */
class FAvatarMorph : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarMorph);
	SHADER_USE_PARAMETER_STRUCT(FAvatarMorph, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, first)
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, vertices)
		SHADER_PARAMETER(uint32, template_position)
		SHADER_PARAMETER(uint32, template_position_width)
		SHADER_PARAMETER(uint32, template_position_scale)
		SHADER_PARAMETER(uint32, morph_ptr)
		SHADER_PARAMETER(uint32, morph_column)
		SHADER_PARAMETER(uint32, morph_column_width)
		SHADER_PARAMETER(uint32, morph_position)
		SHADER_PARAMETER(uint32, morph_position_width)
		SHADER_PARAMETER(uint32, morph_position_step)
		SHADER_PARAMETER(uint32, corrective_ptr)
		SHADER_PARAMETER(uint32, corrective_column)
		SHADER_PARAMETER(uint32, corrective_column_width)
		SHADER_PARAMETER(uint32, corrective_position)
		SHADER_PARAMETER(uint32, corrective_position_width)
		SHADER_PARAMETER(uint32, corrective_position_step)
		SHADER_PARAMETER(uint32, weights)
		SHADER_PARAMETER(uint32, features)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint>, MorphStatic)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float>, Pose)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Mesh)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry skin. */
class FAvatarSkin : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarSkin);
	SHADER_USE_PARAMETER_STRUCT(FAvatarSkin, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, first)
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, late_ptr)
		SHADER_PARAMETER(uint32, late_column)
		SHADER_PARAMETER(uint32, late_column_width)
		SHADER_PARAMETER(uint32, late_position)
		SHADER_PARAMETER(uint32, late_position_width)
		SHADER_PARAMETER(uint32, late_position_step)
		SHADER_PARAMETER(uint32, skin_ptr)
		SHADER_PARAMETER(uint32, skin_column)
		SHADER_PARAMETER(uint32, skin_column_width)
		SHADER_PARAMETER(uint32, skin_weight)
		SHADER_PARAMETER(uint32, skin_weight_width)
		SHADER_PARAMETER(uint32, skin_weight_step)
		SHADER_PARAMETER(uint32, late)
		SHADER_PARAMETER(uint32, joints)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint>, SkinStatic)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float>, Pose)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Mesh)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry blend. */
class FAvatarBlend : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarBlend);
	SHADER_USE_PARAMETER_STRUCT(FAvatarBlend, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, sh_terms)
		SHADER_PARAMETER(uint32, weights)
		SHADER_PARAMETER(uint32, base_mean)
		SHADER_PARAMETER(uint32, base_mean_width)
		SHADER_PARAMETER(uint32, base_mean_scale)
		SHADER_PARAMETER(uint32, base_log_scale)
		SHADER_PARAMETER(uint32, base_log_scale_width)
		SHADER_PARAMETER(uint32, base_log_scale_scale)
		SHADER_PARAMETER(uint32, base_quat)
		SHADER_PARAMETER(uint32, base_quat_width)
		SHADER_PARAMETER(uint32, base_quat_scale)
		SHADER_PARAMETER(uint32, base_opacity)
		SHADER_PARAMETER(uint32, base_opacity_width)
		SHADER_PARAMETER(uint32, base_opacity_table)
		SHADER_PARAMETER(uint32, base_sh)
		SHADER_PARAMETER(uint32, base_sh_width)
		SHADER_PARAMETER(uint32, base_sh_scale)
		SHADER_PARAMETER(uint32, geometry_ptr)
		SHADER_PARAMETER(uint32, geometry_column)
		SHADER_PARAMETER(uint32, geometry_column_width)
		SHADER_PARAMETER(uint32, geometry_mean)
		SHADER_PARAMETER(uint32, geometry_mean_width)
		SHADER_PARAMETER(uint32, geometry_mean_step)
		SHADER_PARAMETER(uint32, geometry_quat)
		SHADER_PARAMETER(uint32, geometry_quat_width)
		SHADER_PARAMETER(uint32, geometry_quat_step)
		SHADER_PARAMETER(uint32, appearance_ptr)
		SHADER_PARAMETER(uint32, appearance_column)
		SHADER_PARAMETER(uint32, appearance_column_width)
		SHADER_PARAMETER(uint32, appearance_log_scale)
		SHADER_PARAMETER(uint32, appearance_log_scale_width)
		SHADER_PARAMETER(uint32, appearance_log_scale_step)
		SHADER_PARAMETER(uint32, appearance_opacity)
		SHADER_PARAMETER(uint32, appearance_opacity_width)
		SHADER_PARAMETER(uint32, appearance_opacity_step)
		SHADER_PARAMETER(uint32, appearance_sh)
		SHADER_PARAMETER(uint32, appearance_sh_width)
		SHADER_PARAMETER(uint32, appearance_sh_step)
		SHADER_PARAMETER(uint32, unused)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint>, BlendStatic)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float>, Pose)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Splats)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float>, Sh)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry bind_skin. */
class FAvatarBindSkin : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarBindSkin);
	SHADER_USE_PARAMETER_STRUCT(FAvatarBindSkin, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, first)
		SHADER_PARAMETER(uint32, rows)
		SHADER_PARAMETER(uint32, corrective_ptr)
		SHADER_PARAMETER(uint32, corrective_column)
		SHADER_PARAMETER(uint32, corrective_column_width)
		SHADER_PARAMETER(uint32, corrective_mean)
		SHADER_PARAMETER(uint32, corrective_mean_width)
		SHADER_PARAMETER(uint32, corrective_mean_step)
		SHADER_PARAMETER(uint32, late_ptr)
		SHADER_PARAMETER(uint32, late_column)
		SHADER_PARAMETER(uint32, late_column_width)
		SHADER_PARAMETER(uint32, late_mean)
		SHADER_PARAMETER(uint32, late_mean_width)
		SHADER_PARAMETER(uint32, late_mean_step)
		SHADER_PARAMETER(uint32, skin_ptr)
		SHADER_PARAMETER(uint32, skin_column)
		SHADER_PARAMETER(uint32, skin_column_width)
		SHADER_PARAMETER(uint32, skin_weight)
		SHADER_PARAMETER(uint32, skin_weight_width)
		SHADER_PARAMETER(uint32, skin_weight_step)
		SHADER_PARAMETER(uint32, features)
		SHADER_PARAMETER(uint32, late)
		SHADER_PARAMETER(uint32, joints)
		SHADER_PARAMETER(uint32, binding_rule)
		SHADER_PARAMETER(uint32, rotation_rule)
		SHADER_PARAMETER(uint32, sh_direction)
		SHADER_PARAMETER(uint32, unused)
		SHADER_PARAMETER(FVector4f, group_matrix_row0)
		SHADER_PARAMETER(FVector4f, group_matrix_row1)
		SHADER_PARAMETER(FVector4f, group_matrix_row2)
		SHADER_PARAMETER(FVector4f, group_rotation_row0)
		SHADER_PARAMETER(FVector4f, group_rotation_row1)
		SHADER_PARAMETER(FVector4f, group_rotation_row2)
		SHADER_PARAMETER(FVector4f, world_row0)
		SHADER_PARAMETER(FVector4f, world_row1)
		SHADER_PARAMETER(FVector4f, world_row2)
		SHADER_PARAMETER(FVector4f, world_quat_wxyz)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint>, BindStatic)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float>, Pose)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Splats)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry bind_triangles. */
class FAvatarBindTriangles : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarBindTriangles);
	SHADER_USE_PARAMETER_STRUCT(FAvatarBindTriangles, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, triangles)
		SHADER_PARAMETER(uint32, vertices)
		SHADER_PARAMETER(uint32, corners)
		SHADER_PARAMETER(uint32, corners_width)
		SHADER_PARAMETER(uint32, canonical)
		SHADER_PARAMETER(uint32, canonical_width)
		SHADER_PARAMETER(uint32, canonical_scale)
		SHADER_PARAMETER(uint32, rotation_rule)
		SHADER_PARAMETER(uint32, quaternion_sign)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint>, SurfaceStatic)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float4>, Mesh)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Triangles)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry bind_vertices. */
class FAvatarBindVertices : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarBindVertices);
	SHADER_USE_PARAMETER_STRUCT(FAvatarBindVertices, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, vertices)
		SHADER_PARAMETER(uint32, triangles)
		SHADER_PARAMETER(uint32, vertex_triangle_ptr)
		SHADER_PARAMETER(uint32, vertex_triangle)
		SHADER_PARAMETER(uint32, vertex_triangle_width)
		SHADER_PARAMETER(float, normal_floor)
		SHADER_PARAMETER(float, quaternion_floor)
		SHADER_PARAMETER(uint32, rotation_rule)
		SHADER_PARAMETER(uint32, skin_ptr)
		SHADER_PARAMETER(uint32, skin_column)
		SHADER_PARAMETER(uint32, skin_column_width)
		SHADER_PARAMETER(uint32, skin_weight)
		SHADER_PARAMETER(uint32, skin_weight_width)
		SHADER_PARAMETER(uint32, skin_weight_step)
		SHADER_PARAMETER(uint32, joints)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint>, SurfaceStatic)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float4>, Triangles)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float>, Pose)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Mesh)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry bind_surface. */
class FAvatarBindSurface : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarBindSurface);
	SHADER_USE_PARAMETER_STRUCT(FAvatarBindSurface, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, vertices)
		SHADER_PARAMETER(uint32, triangles)
		SHADER_PARAMETER(uint32, triangle_ids)
		SHADER_PARAMETER(uint32, triangle_ids_width)
		SHADER_PARAMETER(uint32, barycentric)
		SHADER_PARAMETER(uint32, barycentric_width)
		SHADER_PARAMETER(uint32, barycentric_scale)
		SHADER_PARAMETER(uint32, displacement)
		SHADER_PARAMETER(uint32, displacement_width)
		SHADER_PARAMETER(uint32, displacement_scale)
		SHADER_PARAMETER(uint32, local_offset)
		SHADER_PARAMETER(uint32, local_offset_width)
		SHADER_PARAMETER(uint32, local_offset_scale)
		SHADER_PARAMETER(uint32, local_quat)
		SHADER_PARAMETER(uint32, local_quat_width)
		SHADER_PARAMETER(uint32, local_quat_scale)
		SHADER_PARAMETER(uint32, position_rule)
		SHADER_PARAMETER(uint32, rotation_rule)
		SHADER_PARAMETER(uint32, scale_rule)
		SHADER_PARAMETER(uint32, sh_direction)
		SHADER_PARAMETER(uint32, unused)
		SHADER_PARAMETER(float, area_damping)
		SHADER_PARAMETER(float, log_training_per_bundle)
		SHADER_PARAMETER(FVector4f, world_row0)
		SHADER_PARAMETER(FVector4f, world_row1)
		SHADER_PARAMETER(FVector4f, world_row2)
		SHADER_PARAMETER(FVector4f, world_quat_wxyz)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint>, EmbedStatic)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float4>, Mesh)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float4>, Triangles)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Splats)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry activate. */
class FAvatarActivate : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarActivate);
	SHADER_USE_PARAMETER_STRUCT(FAvatarActivate, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Splats)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry project. */
class FAvatarProject : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarProject);
	SHADER_USE_PARAMETER_STRUCT(FAvatarProject, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, sh_degree)
		SHADER_PARAMETER(float, near_z)
		SHADER_PARAMETER(float, low_pass)
		SHADER_PARAMETER(FVector4f, camera_row0)
		SHADER_PARAMETER(FVector4f, camera_row1)
		SHADER_PARAMETER(FVector4f, camera_row2)
		SHADER_PARAMETER(FVector4f, clip_row0)
		SHADER_PARAMETER(FVector4f, clip_row1)
		SHADER_PARAMETER(FVector4f, clip_row2)
		SHADER_PARAMETER(FVector4f, clip_row3)
		SHADER_PARAMETER(FVector4f, eye)
		SHADER_PARAMETER(FVector2f, tan_half_fov)
		SHADER_PARAMETER(FVector2f, image_size)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float4>, Splats)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float>, Sh)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Projected)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry sort_keys. */
class FAvatarSortKeys : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarSortKeys);
	SHADER_USE_PARAMETER_STRUCT(FAvatarSortKeys, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, first)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float4>, Projected)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<uint2>, Pairs)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry sort_count. */
class FAvatarSortCount : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarSortCount);
	SHADER_USE_PARAMETER_STRUCT(FAvatarSortCount, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, groups)
		SHADER_PARAMETER(uint32, shift)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint2>, Pairs)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<uint>, Counts)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry sort_scan. */
class FAvatarSortScan : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarSortScan);
	SHADER_USE_PARAMETER_STRUCT(FAvatarSortScan, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, total)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<uint>, Counts)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry sort_scatter. */
class FAvatarSortScatter : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarSortScatter);
	SHADER_USE_PARAMETER_STRUCT(FAvatarSortScatter, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, groups)
		SHADER_PARAMETER(uint32, shift)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint2>, Pairs)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint>, Counts)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<uint2>, PairsOut)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry raster_gather. */
class FAvatarRasterGather : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarRasterGather);
	SHADER_USE_PARAMETER_STRUCT(FAvatarRasterGather, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(uint32, count)
		SHADER_PARAMETER(uint32, begin)
		SHADER_PARAMETER(uint32, piece_count)
		SHADER_PARAMETER(uint32, first)
		SHADER_PARAMETER(uint32, chunk_count)
		SHADER_PARAMETER(uint32, reverse)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float4>, Projected)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<uint2>, Pairs)
		SHADER_PARAMETER_RDG_BUFFER_UAV(RWStructuredBuffer<float4>, Quads)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry raster_vertex_fetch. */
class FAvatarRasterVertexFetch : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarRasterVertexFetch);
	SHADER_USE_PARAMETER_STRUCT(FAvatarRasterVertexFetch, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(FVector2f, image_size)
		SHADER_PARAMETER(float, flip_y)
		SHADER_PARAMETER_RDG_BUFFER_SRV(StructuredBuffer<float4>, Quads)
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry raster_pixel. */
class FAvatarRasterPixel : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarRasterPixel);
	SHADER_USE_PARAMETER_STRUCT(FAvatarRasterPixel, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry unreal_depth_pixel. */
class FAvatarUnrealDepthPixel : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarUnrealDepthPixel);
	SHADER_USE_PARAMETER_STRUCT(FAvatarUnrealDepthPixel, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(FVector2f, depth_min)
		SHADER_PARAMETER(FVector2f, depth_per_pixel)
		SHADER_PARAMETER_RDG_TEXTURE(Texture2D, scene_depth)
		RENDER_TARGET_BINDING_SLOTS()
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};

/** Entry unreal_composite_pixel. */
class FAvatarUnrealCompositePixel : public FGlobalShader
{
	DECLARE_GLOBAL_SHADER(FAvatarUnrealCompositePixel);
	SHADER_USE_PARAMETER_STRUCT(FAvatarUnrealCompositePixel, FGlobalShader);

	BEGIN_SHADER_PARAMETER_STRUCT(FParameters, )
		SHADER_PARAMETER(FVector2f, output_min)
		SHADER_PARAMETER(FVector2f, colour_min)
		SHADER_PARAMETER(FVector4f, background)
		SHADER_PARAMETER(float, linear_target)
		SHADER_PARAMETER(float, flip_rows)
		SHADER_PARAMETER(FVector2f, image_size)
		SHADER_PARAMETER_RDG_TEXTURE(Texture2D, scene_colour)
		SHADER_PARAMETER_RDG_TEXTURE(Texture2D, Accumulated)
		RENDER_TARGET_BINDING_SLOTS()
	END_SHADER_PARAMETER_STRUCT()

	static bool ShouldCompilePermutation(const FGlobalShaderPermutationParameters& Parameters)
	{
		return IsFeatureLevelSupported(Parameters.Platform, ERHIFeatureLevel::SM5);
	}
};
