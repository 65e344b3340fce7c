using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("AvatarExport.Universal")]
[assembly: InternalsVisibleTo("AvatarExport.HighDefinition")]
[assembly: InternalsVisibleTo("AvatarExport.Editor")]
[assembly: InternalsVisibleTo("AvatarExport.Tests.Runtime")]
