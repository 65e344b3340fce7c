using System.IO;
using UnrealBuildTool;

/// <summary>The player: sources of the native player, what the component decides, and the layer over the engine.</summary>
public class GaussianAvatar : ModuleRules
{
	public GaussianAvatar(ReadOnlyTargetRules Target) : base(Target)
	{
		// The copied sources are compiled as they are elsewhere: each file alone, nothing of the engine before it.
		PCHUsage = PCHUsageMode.NoPCHs;
		bUseUnity = false;
		// Checks of files compare with numbers that are none, and poses are held to vectors: no fast maths.
		FPSemantics = FPSemanticsMode.Precise;
		// Unreal compiles HLSL; the texts in GLSL and MSL are not here.
		PrivateDefinitions.Add("AVATAR_NO_SHADER_TEXTS=1");
		PublicDependencyModuleNames.AddRange(new[] { "Core", "CoreUObject", "Engine", "LiveLinkInterface" });
		PrivateDependencyModuleNames.AddRange(new[] { "Projects", "RenderCore", "Renderer", "RHI" });
		PrivateIncludePaths.Add(Path.Combine(ModuleDirectory, "Private/Core"));
		PrivateIncludePaths.Add(Path.Combine(ModuleDirectory, "Private/Native/include"));
	}
}
