using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("AvatarExport")]
[assembly: InternalsVisibleTo("AvatarExport.Tests.Core")]
