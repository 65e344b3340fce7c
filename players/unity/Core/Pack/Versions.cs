using System.Globalization;
using System.Linq;
using System.Text.RegularExpressions;
using static System.FormattableString;

namespace AvatarExport.Core {
    /// <summary>Which packs this player reads.</summary>
    internal static class Versions {
        private const string Update = "update com.avatar-export.player";
        private const int Major = 1;
        private const int Minor = 0;

        /// <summary>Throws AvatarError for a document of a version that is not read here.</summary>
        public static void Check(Json document) {
            Json asset = document.At("asset");
            int[] version = Parsed(asset.At("version"));
            int[] least = Parsed(asset.At("minVersion"));
            if (version[0] != Major || least[0] > Major || (least[0] == Major && least[1] > Minor)) {
                string needs = Invariant($"is {version[0]}.{version[1]} (needs a reader of {least[0]}.{least[1]})");
                string knows = Invariant($"; this player knows {Major}.{Minor}: {Update}");
                throw new AvatarError(needs + knows, null, "$.asset.version");
            }
            Json required = document.Optional("extensionsRequired", names => names.List().FirstOrDefault(), null);
            if (required != null) {
                string line = Json.Shown(required.Value) + " is not known to this player: " + Update;
                throw new AvatarError(line, null, "$.extensionsRequired");
            }
        }

        /// <summary>Throws AvatarError for kernels that this player lacks.</summary>
        public static void CheckShaders(Json said) {
            if (said.Number() <= Constants.Shaders) return;
            string needs = Invariant($"needs kernels of version {said.Number()}; this player has {Constants.Shaders}: ");
            throw new AvatarError(needs + Update, null, said.Path);
        }

        private static int Number(string digits) => int.Parse(digits, CultureInfo.InvariantCulture);

        private static int[] Parsed(Json said) {
            Match match = Form.Version.Match(said.Text());
            if (!match.Success) throw said.Error("\"MAJOR.MINOR\" is needed");
            return new[] { Number(match.Groups[1].Value), Number(match.Groups[2].Value) };
        }
    }
}
