using System.Collections.Generic;
using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport {
    /// <summary>A compute shader with its one kernel.</summary>
    internal sealed class Kernel {
        public ComputeShader Shader;
        public int Index;
    }

    /// <summary>
    /// The compute shaders of the package, by entry. They lie in a folder Resources, so that builds keep them where no
    /// scene refers to an avatar.
    /// </summary>
    internal static class Kernels {
        private const string Folder = "AvatarExport/";

        private static readonly Dictionary<string, Kernel> Known = new Dictionary<string, Kernel>();

        /// <summary>
        /// The kernel of an entry. Throws AvatarError where the package's files are not whole, or this device cannot
        /// run it.
        /// </summary>
        public static Kernel Of(string entry) {
            Kernel kernel;
            if (Known.TryGetValue(entry, out kernel) && kernel.Shader != null) return kernel;
            ComputeShader shader = Load<ComputeShader>(entry);
            // A shader that this graphics API could not compile is there, without its kernel.
            if (!shader.HasKernel(entry) || !shader.IsSupported(shader.FindKernel(entry))) {
                throw new AvatarError("does not run with this graphics API", "Avatar Player", "shader " + entry);
            }
            kernel = new Kernel { Shader = shader, Index = shader.FindKernel(entry) };
            Known[entry] = kernel;
            return kernel;
        }

        /// <summary>The shader that draws splats. Throws AvatarError as Of.</summary>
        public static Shader Splat() => Load<Shader>("AvatarSplat");

        private static T Load<T>(string name) where T : Object {
            T found = Resources.Load<T>(Folder + name);
            if (found != null) return found;
            throw new AvatarError("is not among the Resources; install the package again", "Avatar Player",
                "shader " + name);
        }
    }
}
