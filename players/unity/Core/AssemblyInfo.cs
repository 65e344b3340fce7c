using System.Runtime.CompilerServices;

[assembly: InternalsVisibleTo("AvatarExport.Tests.Core")]
