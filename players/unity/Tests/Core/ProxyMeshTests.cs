using System;
using System.Collections.Generic;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>The proxy mesh is the rig that Python decodes.</summary>
    [TestFixture]
    public sealed class ProxyMeshTests
    {
        [Test]
        public void ProxiesAreTheRigsThatPythonDecodes()
        {
            int rigs = 0;
            foreach (string name in Cases.Packs())
            {
                Core.Avatar avatar = Cases.Loaded(name);
                ProxyMesh mesh = ProxyMesh.From(avatar);
                Assert.AreEqual(avatar.Skeleton == null, mesh == null, name);
                if (mesh == null) continue;
                rigs++;
                Dictionary<string, Tensor> want = Cases.Tensors(name, "proxy.safetensors");
                CheckNear(want["positions"].Values, mesh.Positions, name + " positions");
                Assert.AreEqual(want["triangles"].Values, mesh.Triangles, name + " triangles");
                string[] names = avatar.Expressions.Select(one => one.Name).Concat(avatar.LateMorphs).ToArray();
                Assert.AreEqual(names, mesh.Morphs.Select(morph => morph.Name), name + " morphs");
                CheckNear(want["deltas"].Values, Dense(mesh), name + " deltas");
                float[] bones = WeightsByJoint(mesh, avatar.Skeleton.Names.Length);
                CheckNear(want["bones"].Values, bones, name + " bones");
            }
            Assert.Greater(rigs, 5);
        }

        [Test]
        public void AGoldenPackHasAProxy()
        {
            ProxyMesh mesh = ProxyMesh.From(Pack.Read(Cases.Golden("joints"), "joints"));
            int vertices = mesh.Positions.Length / 3;
            Assert.AreEqual(ProxyMesh.Bones * vertices, mesh.BoneIndices.Length);
            Assert.IsTrue(mesh.Triangles.Length > 0 && mesh.Triangles.All(vertex => vertex < vertices));
            for (int v = 0; v < vertices; v++)
            {
                float[] weights = mesh.BoneWeights.Skip(ProxyMesh.Bones * v).Take(ProxyMesh.Bones).ToArray();
                Assert.AreEqual(1, weights.Sum(), ProxyMesh.Bones * Cases.Rounding);
                Assert.AreEqual(weights.OrderByDescending(weight => weight), weights);
            }
        }

        private static void CheckNear(double[] want, float[] got, string what)
        {
            Assert.AreEqual(want.Length, got.Length, what);
            double limit = 2 * Cases.Rounding * want.Select(Math.Abs).DefaultIfEmpty(0).Max();
            for (int i = 0; i < want.Length; i++) Assert.AreEqual(want[i], got[i], limit, what);
        }

        /// <summary>[morphs, V, 3]</summary>
        private static float[] Dense(ProxyMesh mesh)
        {
            float[] found = new float[mesh.Morphs.Length * mesh.Positions.Length];
            for (int m = 0; m < mesh.Morphs.Length; m++)
            {
                Morph morph = mesh.Morphs[m];
                for (int i = 0; i < morph.Deltas.Length; i++)
                {
                    found[m * mesh.Positions.Length + 3 * morph.Vertices[i / 3] + i % 3] += morph.Deltas[i];
                }
            }
            return found;
        }

        /// <summary>[V, J]</summary>
        private static float[] WeightsByJoint(ProxyMesh mesh, int joints)
        {
            float[] found = new float[mesh.Positions.Length / 3 * joints];
            for (int i = 0; i < mesh.BoneWeights.Length; i++)
            {
                found[i / ProxyMesh.Bones * joints + mesh.BoneIndices[i]] += mesh.BoneWeights[i];
            }
            return found;
        }
    }
}
