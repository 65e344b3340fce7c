using System;
using System.Collections.Generic;
using AvatarExport.Core;
using UnityEngine;
using UnityEngine.Rendering;

namespace AvatarExport {
    /// <summary>An instance at one level of detail on the GPU: its own buffers and its passes.</summary>
    internal sealed class Resident : IDisposable {
        public readonly Instance Instance;

        /// <summary>Its level when this was made.</summary>
        public readonly Level Level;

        private readonly StaticBuffers shared;
        private readonly Dictionary<string, int> strides;
        private readonly Dictionary<string, GraphicsBuffer> own = new Dictionary<string, GraphicsBuffer>();
        private readonly RecordedPasses mesh; // stages morph and skin
        private readonly RecordedPasses deform;
        private readonly RecordedPasses view;
        private readonly float[] lastPose; // what buffer Pose holds
        private readonly GraphicsBuffer pose; // or null
        private readonly ProxyVertices given; // posed vertices from outside, in place of the passes of mesh
        private bool posed = true; // the pose has changed since it was recorded
        private bool ran; // all passes have been recorded once
        private double seenHeightPx; // the largest of all cameras since TakeHeightPx; 0: no camera saw it

        /// <summary>Uploads the avatar. Throws AvatarError where a buffer exceeds a limit of this device.</summary>
        public Resident(Instance instance, ProxyVertices given) {
            Instance = instance;
            this.given = given;
            Level = instance.Program;
            Program program = instance.Avatar.Program;
            strides = GpuBuffers.Strides(program, Level);
            lastPose = new float[program.PoseFloats]; // zeros, as a new buffer
            shared = StaticBuffers.Take(instance.Avatar);
            try {
                int groups = instance.Avatar.Groups.Length;
                mesh = new RecordedPasses(PassList.Of(program, program.Mesh, groups), Buffer);
                deform = new RecordedPasses(PassList.Of(program, Level.Deform, groups), Buffer);
                view = new RecordedPasses(PassList.Of(program, Level.View, groups), Buffer);
                own.TryGetValue("Pose", out pose);
            } catch {
                Dispose();
                throw;
            }
        }

        /// <summary>Takes the camera that RecordView projects for.</summary>
        public void See(AvatarCamera camera) {
            Instance.UpdateCamera(camera);
            seenHeightPx = Math.Max(seenHeightPx, Instance.HeightPx(camera));
        }

        /// <summary>The largest height in the image of a camera since the last call, pixels; 0: no camera saw it.</summary>
        public double TakeHeightPx() {
            double height = seenHeightPx;
            seenHeightPx = 0;
            return height;
        }

        /// <summary>Records what changes with the pose, if it has changed since the last call.</summary>
        public void RecordPose(CommandBuffer commands) {
            if (pose != null && IsNewPose()) {
                commands.SetBufferData(pose, lastPose);
                posed = true;
            }
            if (ran) deform.KeepLasting();
            bool deformed = deform.Set(Instance.Values) || posed;
            deformed |= RecordMesh(commands);
            if (deformed) deform.Record(commands);
            posed = false;
            ran = true;
        }

        /// <summary>Records the mesh, from outside or from its passes. Returns whether it may have changed.</summary>
        private bool RecordMesh(CommandBuffer commands) {
            bool changed = given.TakeChange() || posed;
            if (!changed || !Instance.Avatar.Program.ReadsMesh) return false;
            GraphicsBuffer vertices = Buffer("Mesh");
            if (given.Floats != null && given.Floats.Length <= vertices.count * vertices.stride / sizeof(float)) {
                commands.SetBufferData(vertices, given.Floats);
            } else {
                mesh.Record(commands);
            }
            return true;
        }

        /// <summary>Records what a camera sees. Instance.UpdateCamera comes first.</summary>
        public void RecordView(CommandBuffer commands) {
            view.Set(Instance.Values);
            view.Record(commands);
        }

        /// <summary>A buffer of the program by its name.</summary>
        public GraphicsBuffer Buffer(string name) {
            ProgramBuffer described = Instance.Avatar.Program.Buffers[name];
            int stride;
            if (!strides.TryGetValue(name, out stride)) stride = 4;
            if (described.Sections.Length > 0) return shared.Get(described, stride);
            GraphicsBuffer buffer;
            if (own.TryGetValue(name, out buffer)) return buffer;
            own[name] = buffer = GpuBuffers.Make(Instance.Avatar.Name, described, stride);
            return buffer;
        }

        /// <inheritdoc/>
        public void Dispose() {
            foreach (GraphicsBuffer buffer in own.Values) buffer.Dispose();
            own.Clear();
            shared.Release();
        }

        private bool IsNewPose() {
            float[] floats = Instance.PoseFloats;
            bool changed = false;
            for (int i = 0; i < floats.Length; i++) {
                changed |= !(lastPose[i] == floats[i]); // NaN is always new
                lastPose[i] = floats[i];
            }
            return changed;
        }
    }
}
