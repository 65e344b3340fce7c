using System.IO;
using UnrealBuildTool;

/// <summary>The player: sources of players/native (copies), what the component decides, and the layer over the engine.</summary>
public class GaussianAvatar : ModuleRules
{
	public GaussianAvatar(ReadOnlyTargetRules Target) : base(Target)
	{
		// The copied sources are compiled as they are elsewhere: each file alone, nothing of the engine before it.
		PCHUsage = PCHUsageMode.NoPCHs;
		bUseUnity = false;
		// Checks of files compare with numbers that are none, and poses are held to vectors: no fast maths.
		FPSemantics = FPSemanticsMode.Precise;
		PublicDependencyModuleNames.AddRange(new[] { "Core", "CoreUObject", "Engine", "LiveLinkInterface" });
		PrivateDependencyModuleNames.AddRange(new[] { "Projects", "RenderCore", "Renderer", "RHI" });
		PrivateIncludePaths.Add(Path.Combine(ModuleDirectory, "Private/Core"));
		PrivateIncludePaths.Add(Path.Combine(ModuleDirectory, "Private/Native/include"));
	}
}
