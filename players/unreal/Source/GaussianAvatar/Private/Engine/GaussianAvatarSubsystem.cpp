#include "GaussianAvatarSubsystem.h"

#include "Engine/World.h"
#include "GaussianAvatarExtension.h"
#include "Misc/App.h"
#include "RenderingThread.h"

TSharedPtr<FGaussianAvatarExtension, ESPMode::ThreadSafe> UGaussianAvatarSubsystem::GetExtension()
{
	if (!Extension.IsValid() && FApp::CanEverRender())
	{
		Extension = FSceneViewExtensions::NewExtension<FGaussianAvatarExtension>(GetWorld());
	}
	return Extension;
}

void UGaussianAvatarSubsystem::Deinitialize()
{
	// Its buffers belong to the render thread, so its last owner is there.
	ENQUEUE_RENDER_COMMAND(ReleaseGaussianAvatars)
	([Last = MoveTemp(Extension)](FRHICommandListImmediate&) mutable { Last.Reset(); });
	Super::Deinitialize();
}
