using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>The proxy mesh is the rig that Python decodes.</summary>
    public sealed class ProxyMeshTests {
        [Test]
        public void ProxiesAreTheRigsThatPythonDecodes() {
            int rigs = 0;
            foreach (string name in Cases.Packs()) {
                LoadedAvatar avatar = Cases.Loaded(name);
                ProxyMesh mesh = ProxyMesh.From(avatar);
                Assert.AreEqual(avatar.Skeleton == null, mesh == null, name);
                if (mesh == null) continue;
                rigs++;
                Dictionary<string, double[]> want = Cases.Tensors(name, "proxy.safetensors");
                CheckNear(want["positions"], mesh.Positions, name + " positions");
                Assert.AreEqual(want["triangles"], mesh.Triangles, name + " triangles");
                string[] names = avatar.Expressions.Select(one => one.Name).Concat(avatar.Eyelids).ToArray();
                Assert.AreEqual(names, mesh.Morphs.Select(morph => morph.Name), name + " morphs");
                CheckNear(want["deltas"], mesh.Morphs.SelectMany(morph => Dense(morph, mesh.Positions.Length)).ToArray(), name + " deltas");
                int joints = avatar.Skeleton.Names.Length;
                float[] weights = new float[mesh.Positions.Length / 3 * joints]; // [V, J]
                for (int i = 0; i < mesh.BoneWeights.Length; i++) {
                    weights[i / ProxyMesh.Bones * joints + mesh.BoneIndices[i]] += mesh.BoneWeights[i];
                    bool first = i % ProxyMesh.Bones == 0;
                    Assert.IsTrue(first || mesh.BoneWeights[i] <= mesh.BoneWeights[i - 1], name + ": the largest comes first");
                }
                CheckNear(want["bones"], weights, name + " bones");
            }
            Assert.Greater(rigs, 5);
        }

        private static void CheckNear(double[] want, float[] got, string what) {
            Near.Check(got, want, 2 * Cases.Rounding * want.Select(Math.Abs).DefaultIfEmpty(0).Max(), what);
        }

        private static float[] Dense(Morph morph, int floats) {
            var found = new float[floats];
            for (int i = 0; i < morph.Deltas.Length; i++) found[3 * morph.Vertices[i / 3] + i % 3] += morph.Deltas[i];
            return found;
        }
    }
}
