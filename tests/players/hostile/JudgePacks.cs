// What the core of the Unity player makes of packs: reads each from standard input after its length, prints a line of JSON.
using System;
using System.IO;
using System.Linq;
using System.Text;
using AvatarExport.Core;

internal static class JudgePacks {
    private static void Main() {
        var given = new BinaryReader(new BufferedStream(Console.OpenStandardInput(), 1 << 16));
        var told = new StreamWriter(Console.OpenStandardOutput(), new UTF8Encoding(false)) { AutoFlush = true, NewLine = "\n" };
        for (byte[] length = given.ReadBytes(4); length.Length == 4; length = given.ReadBytes(4)) {
            told.WriteLine(Verdict(given.ReadBytes(BitConverter.ToInt32(length, 0))));
        }
    }

    private static string Verdict(byte[] file) {
        try {
            return Told(LoadedAvatar.Load(file, "x.avatar"));
        } catch (AvatarError error) {
            return "{\"ok\":false,\"why\":" + Quoted(error.Message) + "}";
        } catch (Exception error) {
            return "{\"ok\":\"crash\",\"why\":" + Quoted(error.ToString()) + "}";
        }
    }

    private static string Told(LoadedAvatar avatar) {
        var buffers = new Sum();
        foreach (ProgramBuffer buffer in avatar.Program.Buffers.Values.Where(one => one.Sections.Length > 0)) {
            buffers.Add(buffer.Name).Add(buffer.Content());
        }
        var clips = new Sum();
        foreach (Clip clip in avatar.Clips) {
            clips.Add(clip.Name).Add(new[] { clip.Fps }).Add(new[] { clip.Frames });
            clips.Add(clip.ExpressionWeights).Add(clip.LateWeights).Add(clip.JointDelta).Add(clip.WorldFromAvatar);
        }
        return "{\"ok\":true,\"buffers\":" + buffers + ",\"arrays\":" + Arrays(avatar) + ",\"clips\":" + clips
            + ",\"poses\":{" + Poses(avatar) + "}}";
    }

    private static Sum Arrays(LoadedAvatar avatar) {
        var arrays = new Sum();
        Skeleton rig = avatar.Skeleton;
        if (rig != null) {
            arrays.Add(rig.Parents);
            foreach (double[] values in new[] { rig.RestLocal, rig.InverseBindMatrix, rig.JointBasis }) {
                arrays.Add(Array.ConvertAll(values, value => (float)value));
            }
            arrays.Add(rig.CorrectiveJoints).Add(rig.AnchorVertices);
            uint[] corners = avatar.Triangles ?? Corners(avatar.Program);
            int count = corners.Length / 3;
            arrays.Add(Enumerable.Range(0, corners.Length).Select(i => corners[i % 3 * count + i / 3]).ToArray());
        }
        return arrays.Add(avatar.Preview ?? new byte[0]);
    }

    private static uint[] Corners(Program program) {
        Pass pass = program.Levels[0].Deform.First(one => one.Entry == "bind_triangles");
        Elements held = program.Buffers[pass.Buffers["SurfaceStatic"]].Find("corners").Elements;
        return Enumerable.Range(0, held.Length).Select(i => held[i]).ToArray();
    }

    private static string Poses(LoadedAvatar avatar) {
        var poser = new Poser(avatar);
        AvatarPose rest = new AvatarPose(avatar), named = new AvatarPose(avatar), driven = new AvatarPose(avatar), clip = new AvatarPose(avatar);
        for (int k = 0; k < avatar.Expressions.Length; k++) named.SetExpression(avatar.Expressions[k].Name, 0.1 * (k % 7));
        for (int l = 0; l < avatar.Eyelids.Length; l++) named.SetEyelid(avatar.Eyelids[l], 0.1 * (l % 7));
        for (int j = 0; avatar.Skeleton != null && j < avatar.Skeleton.Names.Length; j++) {
            double angle = 0.05 * (j % 5) / Math.Sqrt(14);
            named.SetJoint(avatar.Skeleton.Names[j], angle, 2 * angle, 3 * angle);
        }
        if (avatar.Driving != null) Drive(avatar, driven);
        if (avatar.Clips.Length > 0) avatar.Clips[0].Pose(0.37 * avatar.Clips[0].Seconds, clip);
        Func<string, AvatarPose, string> told = (name, pose) =>
            "\"" + name + "\":\"" + Convert.ToBase64String(BytesOf(poser.Update(pose).PoseFloats)) + "\"";
        return told("rest", rest) + "," + told("named", named) + "," + told("driven", driven) + "," + told("clip", clip);
    }

    private static void Drive(LoadedAvatar avatar, AvatarPose into) {
        var frame = new DrivingFrame();
        for (int i = 0; i < avatar.Driving.Inputs.Length; i++) {
            int place = Array.IndexOf(Arkit.Names, avatar.Driving.Inputs[i]);
            if (place >= 0) frame.Weights[place] = (float)(0.1 * (i % 9 + 1));
        }
        try {
            new Driver(avatar).Pose(frame, into);
        } catch (AvatarError) { // a joint that cannot turn: then nothing drives
        }
    }

    private static byte[] BytesOf(Array values) {
        var bytes = new byte[Buffer.ByteLength(values)];
        Buffer.BlockCopy(values, 0, bytes, 0, bytes.Length);
        return bytes;
    }

    private static string Quoted(string text) {
        var made = new StringBuilder("\"");
        foreach (char letter in text) {
            if (letter >= ' ' && letter <= '~' && letter != '"' && letter != '\\') made.Append(letter);
            else made.Append("\\u").Append(((int)letter).ToString("x4"));
        }
        return made.Append('"').ToString();
    }

    /// <summary>The checksum of texts and arrays one after the other.</summary>
    private sealed class Sum {
        private uint sum;

        public Sum Add(string text) => Add(Encoding.UTF8.GetBytes(text));

        public Sum Add(Array values) {
            byte[] bytes = BytesOf(values);
            sum = Crc32.Of(bytes, 0, bytes.Length, sum);
            return this;
        }

        public override string ToString() => "\"" + sum.ToString("x8") + "\"";
    }
}
