using System;
using System.Collections.Generic;
using System.Runtime.CompilerServices;

namespace AvatarExport.Core
{
    /// <summary>Names of an avatar and where their values lie. Poses of one avatar share them.</summary>
    internal sealed class PoseNames
    {
        public readonly Dictionary<string, int> Expressions = new Dictionary<string, int>(StringComparer.Ordinal); // aliases too
        public readonly List<string> Listed = new List<string>(); // expressions without aliases
        public readonly Dictionary<string, int> Late;
        public readonly Dictionary<string, int> Joints;

        private static readonly ConditionalWeakTable<Avatar, PoseNames> Known = new ConditionalWeakTable<Avatar, PoseNames>();

        private PoseNames(Avatar avatar)
        {
            for (int k = 0; k < avatar.Expressions.Length; k++)
            {
                Listed.Add(avatar.Expressions[k].Name);
                foreach (string alias in avatar.Expressions[k].Aliases) Expressions[alias] = k;
            }
            for (int k = 0; k < Listed.Count; k++) Expressions[Listed[k]] = k; // a name wins over an alias
            Late = Places(avatar.LateMorphs);
            Joints = Places(avatar.Skeleton == null ? new string[0] : avatar.Skeleton.Names);
        }

        public static PoseNames Of(Avatar avatar)
        {
            return Known.GetValue(avatar, one => new PoseNames(one));
        }

        private static Dictionary<string, int> Places(string[] names)
        {
            var found = new Dictionary<string, int>(StringComparer.Ordinal);
            for (int i = 0; i < names.Length; i++) found[names[i]] = i;
            return found;
        }
    }
}
