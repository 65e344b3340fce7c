#include "GaussianAvatarDraw.h"

#include "CommonRenderResources.h"
#include "GaussianAvatarKernels.h"
#include "PipelineStateCache.h"
#include "PixelShaderUtils.h"
#include "RenderGraphBuilder.h"
#include "RHICommandList.h"
#include "RHIStaticStates.h"
#include "SceneView.h"

BEGIN_SHADER_PARAMETER_STRUCT(FAvatarQuadPass, )
	SHADER_PARAMETER_STRUCT_INCLUDE(FAvatarRasterVertexFetch::FParameters, Vertex)
	RENDER_TARGET_BINDING_SLOTS()
END_SHADER_PARAMETER_STRUCT()

namespace
{
FVector2f ToFloats(FIntPoint Point)
{
	return FVector2f(static_cast<float>(Point.X), static_cast<float>(Point.Y));
}

/** The scene's depth at the size of the picture, so that quads are tested against it. */
FRDGTextureRef CopyDepth(FRDGBuilder& Builder, const FGlobalShaderMap* Shaders, const FGaussianAvatarPicture& Picture, FIntPoint Size)
{
	const FRDGTextureDesc Desc = FRDGTextureDesc::Create2D(
		Size, PF_DepthStencil, FClearValueBinding::DepthFar, TexCreate_DepthStencilTargetable | TexCreate_ShaderResource);
	const FRDGTextureRef Depth = Builder.CreateTexture(Desc, TEXT("GaussianAvatarDepth"));
	FAvatarUnrealDepthPixel::FParameters* Parameters = Builder.AllocParameters<FAvatarUnrealDepthPixel::FParameters>();
	Parameters->scene_depth = Picture.Depth;
	Parameters->depth_min = ToFloats(Picture.DepthRect.Min);
	Parameters->depth_per_pixel = ToFloats(Picture.DepthRect.Size()) / ToFloats(Size);
	Parameters->RenderTargets.DepthStencil =
		FDepthStencilBinding(Depth, ERenderTargetLoadAction::EClear, FExclusiveDepthStencil::DepthWrite_StencilNop);
	const TShaderMapRef<FAvatarUnrealDepthPixel> Pixel(Shaders);
	FPixelShaderUtils::AddFullscreenPass(Builder, Shaders, RDG_EVENT_NAME("Depth"), Pixel, Parameters, FIntRect(FIntPoint(0, 0), Size),
		nullptr, nullptr, TStaticDepthStencilState<true, CF_Always>::GetRHI());
	return Depth;
}

FRDGTextureRef DrawQuads(FRDGBuilder& Builder, const FGlobalShaderMap* Shaders, const FGaussianAvatarPicture& Picture, FIntPoint Size)
{
	// Each of many splats is rounded to this format, so it has 32 bits.
	const FRDGTextureDesc Desc = FRDGTextureDesc::Create2D(
		Size, PF_A32B32G32R32F, FClearValueBinding::Transparent, TexCreate_RenderTargetable | TexCreate_ShaderResource);
	const FRDGTextureRef Accumulated = Builder.CreateTexture(Desc, TEXT("GaussianAvatarColour"));
	FAvatarQuadPass* Parameters = Builder.AllocParameters<FAvatarQuadPass>();
	Parameters->Vertex.Quads = Builder.CreateSRV(Picture.Quads);
	Parameters->Vertex.image_size = ToFloats(Size);
	Parameters->Vertex.flip_y = 1;
	Parameters->RenderTargets[0] = FRenderTargetBinding(Accumulated, ERenderTargetLoadAction::EClear);
	Parameters->RenderTargets.DepthStencil = FDepthStencilBinding(CopyDepth(Builder, Shaders, Picture, Size),
		ERenderTargetLoadAction::ELoad, FExclusiveDepthStencil::DepthRead_StencilNop);
	const TShaderMapRef<FAvatarRasterVertexFetch> Vertex(Shaders);
	const TShaderMapRef<FAvatarRasterPixel> Pixel(Shaders);
	const uint32 Instances = Picture.Instances;
	Builder.AddPass(RDG_EVENT_NAME("Quads"), Parameters, ERDGPassFlags::Raster,
		[Parameters, Vertex, Pixel, Size, Instances](FRHICommandList& Commands)
		{
			Commands.SetViewport(0, 0, 0, static_cast<float>(Size.X), static_cast<float>(Size.Y), 1);
			FGraphicsPipelineStateInitializer State;
			Commands.ApplyCachedRenderTargets(State);
			State.BlendState = TStaticBlendState<CW_RGBA, BO_Add, BF_One, BF_InverseSourceAlpha, BO_Add, BF_One, BF_InverseSourceAlpha>::GetRHI();
			State.RasterizerState = TStaticRasterizerState<FM_Solid, CM_None>::GetRHI();
			State.DepthStencilState = TStaticDepthStencilState<false, CF_DepthNearOrEqual>::GetRHI();
			State.BoundShaderState.VertexDeclarationRHI = GEmptyVertexDeclaration.VertexDeclarationRHI;
			State.BoundShaderState.VertexShaderRHI = Vertex.GetVertexShader();
			State.BoundShaderState.PixelShaderRHI = Pixel.GetPixelShader();
			State.PrimitiveType = PT_TriangleStrip;
			SetGraphicsPipelineState(Commands, State, 0);
			SetShaderParameters(Commands, Vertex, Vertex.GetVertexShader(), Parameters->Vertex);
			Commands.SetStreamSource(0, nullptr, 0);
			Commands.DrawPrimitive(0, 2, Instances);
		});
	return Accumulated;
}
}

FScreenPassTexture DrawGaussianAvatars(FRDGBuilder& Builder, const FSceneView& View, const FGaussianAvatarPicture& Picture)
{
	const FGlobalShaderMap* Shaders = GetGlobalShaderMap(View.GetFeatureLevel());
	const FIntPoint Size = Picture.Colour.ViewRect.Size();
	FScreenPassRenderTarget Output = Picture.Output;
	if (!Output.IsValid())
	{
		FRDGTextureDesc Desc = Picture.Colour.Texture->Desc;
		Desc.Reset();
		Desc.Flags |= TexCreate_RenderTargetable | TexCreate_ShaderResource; // a compute pass may have written the scene's
		Output = FScreenPassRenderTarget(
			Builder.CreateTexture(Desc, TEXT("GaussianAvatarOutput")), Picture.Colour.ViewRect, ERenderTargetLoadAction::ENoAction);
	}
	FAvatarUnrealCompositePixel::FParameters* Parameters = Builder.AllocParameters<FAvatarUnrealCompositePixel::FParameters>();
	Parameters->Accumulated = DrawQuads(Builder, Shaders, Picture, Size);
	Parameters->scene_colour = Picture.Colour.Texture;
	Parameters->output_min = ToFloats(Output.ViewRect.Min);
	Parameters->colour_min = ToFloats(Picture.Colour.ViewRect.Min);
	Parameters->image_size = ToFloats(Size);
	Parameters->RenderTargets[0] = Output.GetRenderTargetBinding();
	const TShaderMapRef<FAvatarUnrealCompositePixel> Pixel(Shaders);
	FPixelShaderUtils::AddFullscreenPass(Builder, Shaders, RDG_EVENT_NAME("Composite"), Pixel, Parameters, Output.ViewRect);
	return MoveTemp(Output);
}
