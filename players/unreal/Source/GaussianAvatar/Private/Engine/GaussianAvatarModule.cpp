#include "Interfaces/IPluginManager.h"
#include "Misc/Paths.h"
#include "Modules/ModuleManager.h"
#include "ShaderCore.h"

/** Tells the engine where the shaders are, before it compiles any: hence the loading phase PostConfigInit. */
class FGaussianAvatarModule final : public IModuleInterface
{
public:
	virtual void StartupModule() override
	{
		const FString Folder = IPluginManager::Get().FindPlugin(TEXT("GaussianAvatar"))->GetBaseDir();
		AddShaderSourceDirectoryMapping(TEXT("/Plugin/GaussianAvatar"), FPaths::Combine(Folder, TEXT("Shaders")));
	}
};

IMPLEMENT_MODULE(FGaussianAvatarModule, GaussianAvatar)
