#include "GaussianAvatarExtension.h"

#include "CoreGlobals.h"
#include "FXRenderingUtils.h"
#include "GaussianAvatarDraw.h"
#include "PostProcess/PostProcessMaterialInputs.h"
#include "RenderGraphBuilder.h"
#include "RenderingThread.h"
#include "SceneView.h"

FGaussianAvatarExtension::FGaussianAvatarExtension(const FAutoRegister& AutoRegister, UWorld* InWorld)
	: FWorldSceneViewExtension(AutoRegister, InWorld)
{
}

uint32 FGaussianAvatarExtension::Add(const avatar_unreal::Pack& Pack)
{
	const uint32 Id = NextId++;
	ENQUEUE_RENDER_COMMAND(GaussianAvatarAdd)
	([Self = Own(), Id, Pack](FRHICommandListImmediate&) { Self->Scene.add(Id, Pack); });
	return Id;
}

void FGaussianAvatarExtension::Leave(FOwner&& Extension, uint32 Id)
{
	ENQUEUE_RENDER_COMMAND(GaussianAvatarLeave)
	([Last = MoveTemp(Extension), Id](FRHICommandListImmediate&) { Last->Scene.remove(Id, Last->Device); });
}

void FGaussianAvatarExtension::Send(uint32 Id, const avatar_unreal::PoseValues& Pose, const FMatrix& Place, bool bShown)
{
	ENQUEUE_RENDER_COMMAND(GaussianAvatarSend)
	([Self = Own(), Id, Values = Pose, Place, bShown](FRHICommandListImmediate&) mutable
		{ Self->Scene.set(Id, MoveTemp(Values), &Place.M[0][0], bShown); });
}

void FGaussianAvatarExtension::SubscribeToPostProcessingPass(
	EPostProcessingPass Pass, AVATAR_VIEW FAvatarCallbacks& Callbacks, bool bIsPassEnabled)
{
	if (Pass != EPostProcessingPass::Tonemap || !bIsPassEnabled || Scene.empty()) return;
	Callbacks.AddDefaulted_GetRef().BindRaw(this, &FGaussianAvatarExtension::Draw_RenderThread);
}

FScreenPassTexture FGaussianAvatarExtension::Draw_RenderThread(
	FRDGBuilder& Builder, const FSceneView& View, const FPostProcessMaterialInputs& Inputs)
{
	// The kernels are compiled for desktop renderers alone; a mobile view has no depth of this kind either.
	if (View.GetFeatureLevel() < ERHIFeatureLevel::SM5 || !Inputs.SceneTextures.SceneTextures)
	{
		return Inputs.ReturnUntouchedSceneColorForPostProcessing(Builder);
	}
	RDG_EVENT_SCOPE(Builder, "GaussianAvatars");
	const FScreenPassTexture Colour =
		FScreenPassTexture::CopyFromSlice(Builder, Inputs.GetInput(EPostProcessMaterialInput::SceneColor));
	if (!Colour.IsValid()) return Inputs.ReturnUntouchedSceneColorForPostProcessing(Builder);
	// Without the jitter of temporal antialiasing, which is over by now.
	const FSceneViewInitOptions& Options = View.SceneViewInitOptions;
	const FVector Eye = Options.ViewOrigin;
	const double EyePlace[3] = {Eye.X, Eye.Y, Eye.Z};
	avatar_unreal::View Seen = {&Options.ViewRotationMatrix.M[0][0], &Options.ProjectionMatrix.M[0][0], EyePlace,
		Colour.ViewRect.Width(), Colour.ViewRect.Height()};
	Device.Begin(Builder);
	// Of the engine: the family's own number counts the families of a scene, as scene captures and viewports are.
	const avatar_unreal::Drawn Drawn = Scene.draw(Seen, GFrameCounterRenderThread, Device);
	if (const char* Line = Scene.news()) UE_LOG(LogGaussianAvatar, Warning, TEXT("%s"), UTF8_TO_TCHAR(Line));
	if (Drawn.instances == 0)
	{
		Device.End();
		return Inputs.ReturnUntouchedSceneColorForPostProcessing(Builder);
	}
	FGaussianAvatarPicture Picture;
	Picture.Quads = Device.Find(Drawn.quads, sizeof(float) * 4);
	Picture.Instances = Drawn.instances;
	Picture.Depth = Inputs.SceneTextures.SceneTextures->GetParameters()->SceneDepthTexture;
	Picture.DepthRect = UE::FXRenderingUtils::GetRawViewRectUnsafe(View);
	Picture.Colour = Colour;
	Picture.Output = Inputs.OverrideOutput;
	Device.End();
	return DrawGaussianAvatars(Builder, View, Picture);
}
