#pragma once
#include "GaussianAvatarDevice.h"
#include "Logging/LogMacros.h"
#include "Misc/EngineVersionComparison.h"
#include "SceneViewExtension.h"
#include "unreal_scene.h"

DECLARE_LOG_CATEGORY_EXTERN(LogGaussianAvatar, Log, All);

// What a release calls the list of callbacks; from 5.5 on, the view comes before it.
#if ENGINE_MINOR_VERSION >= 6
using FAvatarCallbacks = FPostProcessingPassDelegateArray;
#else
using FAvatarCallbacks = FAfterPassCallbackDelegateArray;
#endif
#if ENGINE_MINOR_VERSION >= 5
#define AVATAR_VIEW const FSceneView&,
#else
#define AVATAR_VIEW
#endif

/** Draws all avatars of a world into each of its views, after tone mapping: avatars have the colours of a display. */
class FGaussianAvatarExtension final : public FWorldSceneViewExtension
{
public:
	using FOwner = TSharedPtr<FGaussianAvatarExtension, ESPMode::ThreadSafe>;

	FGaussianAvatarExtension(const FAutoRegister& AutoRegister, UWorld* InWorld);

	/** An avatar on the GPU. Returns its number. Game thread. */
	uint32 Add(const avatar_unreal::Pack& Pack);
	/** Takes an avatar out and lets the extension go, which the render thread frees. Game thread. */
	static void Leave(FOwner&& Extension, uint32 Id);
	/** The pose and the place of the next frames. Game thread. */
	void Send(uint32 Id, const avatar_unreal::PoseValues& Pose, const FMatrix& UnrealFromComponent, bool bShown);

	// Up to 5.5 these three are pure.
	virtual void SetupViewFamily(FSceneViewFamily& Family) override {}
	virtual void SetupView(FSceneViewFamily& Family, FSceneView& View) override {}
	virtual void BeginRenderViewFamily(FSceneViewFamily& Family) override {}

	virtual void SubscribeToPostProcessingPass(
		EPostProcessingPass Pass, AVATAR_VIEW FAvatarCallbacks& Callbacks, bool bIsPassEnabled) override;

private:
	FScreenPassTexture Draw_RenderThread(FRDGBuilder& Builder, const FSceneView& View, const FPostProcessMaterialInputs& Inputs);
	FOwner Own() { return StaticCastSharedRef<FGaussianAvatarExtension>(AsShared()); }

	// Render thread alone.
	avatar_unreal::Scene Scene;
	FGaussianAvatarDevice Device;

	uint32 NextId = 1;
};
