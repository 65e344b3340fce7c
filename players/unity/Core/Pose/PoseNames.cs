using System;
using System.Collections.Generic;
using System.Runtime.CompilerServices;

namespace AvatarExport.Core {
    /// <summary>Names of an avatar and where their values lie. Poses of one avatar share them.</summary>
    internal sealed class PoseNames {
        public readonly Dictionary<string, int> Expressions = new Dictionary<string, int>(NameComparer.Instance); // aliases too
        public readonly List<string> Listed = new List<string>(); // expressions without aliases
        public readonly Dictionary<string, int> Eyelids;
        public readonly Dictionary<string, int> Joints;

        private static readonly ConditionalWeakTable<LoadedAvatar, PoseNames> Known = new ConditionalWeakTable<LoadedAvatar, PoseNames>();

        private PoseNames(LoadedAvatar avatar) {
            for (int k = 0; k < avatar.Expressions.Length; k++) {
                Listed.Add(avatar.Expressions[k].Name);
                foreach (string alias in avatar.Expressions[k].Aliases) Expressions[alias] = k;
            }
            for (int k = 0; k < Listed.Count; k++) Expressions[Listed[k]] = k; // a name wins over an alias
            Eyelids = Places(avatar.Eyelids);
            Joints = Places(avatar.Skeleton == null ? new string[0] : avatar.Skeleton.Names);
        }

        public static PoseNames Of(LoadedAvatar avatar) => Known.GetValue(avatar, one => new PoseNames(one));

        public static Dictionary<string, int> Places(string[] names) {
            var found = new Dictionary<string, int>(NameComparer.Instance);
            for (int i = 0; i < names.Length; i++) found[names[i]] = i;
            return found;
        }
    }
}
