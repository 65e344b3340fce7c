using UnrealBuildTool;

/// <summary>The import of .avatar files.</summary>
public class GaussianAvatarEditor : ModuleRules
{
	public GaussianAvatarEditor(ReadOnlyTargetRules Target) : base(Target)
	{
		PrivateDependencyModuleNames.AddRange(new[] { "Core", "CoreUObject", "Engine", "GaussianAvatar", "UnrealEd" });
	}
}
