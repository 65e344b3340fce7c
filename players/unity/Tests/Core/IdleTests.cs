using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Idle life: the vectors of all players.</summary>
    public sealed class IdleTests {
        [Test]
        public void ItHasTheNumbersOfEveryPlayer() {
            DrivingFrame frame = new DrivingFrame(), want = new DrivingFrame();
            foreach (Json said in Cases.Read("idle.json").List(20)) {
                Json channels = said.At("channels");
                want.SetChannels(Arkit.Channels.Select(name => channels.Optional(name, one => one.Number(), 0)).ToArray(), 0);
                Idle.Write(said.At("seconds").Number(), (uint)said.At("seed").Number(), frame);
                string what = said.At("seconds").Number() + " s: ";
                Near.Check(frame.Weights, want.Weights.Select(one => (double)one), 1e-7, what + "weights");
                Near.Check(frame.Head, want.Head, 1e-11, what + "head");
                Near.Check(frame.LeftEye, want.LeftEye, 1e-11, what + "left eye");
                Near.Check(frame.RightEye, want.RightEye, 1e-11, what + "right eye");
            }
        }
    }
}
