#pragma once
#include "RenderGraphResources.h"
#include "ScreenPass.h"

/** What is drawn into a view, and over what. */
struct FGaussianAvatarPicture
{
	FRDGBufferRef Quads = nullptr;
	uint32 Instances = 0;
	FRDGTextureRef Depth = nullptr; // of the scene, whose size may differ from that of the picture
	FIntRect DepthRect;
	FScreenPassTexture Colour;      // of the scene, display-referred
	FScreenPassRenderTarget Output; // invalid: a new texture
};

/** Blends the quads in a float image behind the scene's depth, then puts that image over the scene once. */
FScreenPassTexture DrawGaussianAvatars(FRDGBuilder& Builder, const FSceneView& View, const FGaussianAvatarPicture& Picture);
