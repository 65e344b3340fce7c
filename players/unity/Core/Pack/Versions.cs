using System.Globalization;
using System.Text.RegularExpressions;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>Which packs this player reads.</summary>
    internal static class Versions {
        private const string Update = "update com.avatar-export.player";
        private const int Major = 1;
        private const int Minor = 0;
        private static readonly Regex Version = new Regex(@"^(0|[1-9][0-9]{0,8})\.(0|[1-9][0-9]{0,8})\z");

        /// <summary>Throws AvatarError for a document that is no pack's, or of a newer version.</summary>
        public static void Check(Json document) {
            Json asset = document.At("asset");
            int[] version = Parsed(asset.At("version"));
            int[] least = Parsed(asset.At("minVersion"));
            if (version[0] != Major || least[0] > Major || (least[0] == Major && least[1] > Minor)) {
                string needs = Invariant($"is {version[0]}.{version[1]} (needs a reader of {least[0]}.{least[1]})");
                string knows = Invariant($"; this player knows {Major}.{Minor}: {Update}");
                throw new AvatarError(needs + knows, null, "$.asset.version");
            }
            string[] required = document.Optional("extensionsRequired", names => names.Names(), new string[0]);
            if (required.Length > 0) {
                string line = "'" + Json.Cut(required[0], 80) + "' is not known to this player: " + Update;
                throw new AvatarError(line, null, "$.extensionsRequired");
            }
            document.At("format").One("avatar-pack");
            long shaders = document.At("shaders").Whole(1);
            if (shaders > Constants.Shaders) {
                string needs = Invariant($"needs kernels of version {shaders}; this player has {Constants.Shaders}: ");
                throw new AvatarError(needs + Update, null, "$.shaders");
            }
        }

        private static int Number(string digits) => int.Parse(digits, CultureInfo.InvariantCulture);

        private static int[] Parsed(Json said) {
            Match match = Version.Match(said.Text());
            if (!match.Success) throw said.Error("\"MAJOR.MINOR\" is needed");
            return new[] { Number(match.Groups[1].Value), Number(match.Groups[2].Value) };
        }
    }
}
