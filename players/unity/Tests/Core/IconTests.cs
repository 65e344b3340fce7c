using System;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests {
    /// <summary>Icons are what Python draws of the same avatar in its binding pose from far away.</summary>
    public sealed class IconTests {
        private const double LeastPsnr = 38; // dB: bytes, and a camera of Python that has some perspective

        [Test]
        public void IconsAreWhatPythonDraws() {
            foreach (Json one in Cases.Read("icons.json").At("icons").List()) {
                string name = one.At("name").Text();
                int size = one.At("size").Int();
                byte[] icon = Icon.Draw(LoadedAvatar.Load(Cases.Bytes(name + ".avatar"), name), size);
                Assert.AreEqual(4 * size * size, icon.Length, name);
                double[] wanted = Cases.Tensors(name + ".safetensors")["rgba"]; // premultiplied, first row at the bottom
                double squares = 0;
                for (int at = 0; at < icon.Length; at++) {
                    double alpha = icon[at / 4 * 4 + 3] / 255.0, found = at % 4 == 3 ? alpha : alpha * icon[at] / 255.0;
                    squares += (found - wanted[at]) * (found - wanted[at]);
                }
                Assert.Greater(-10 * Math.Log10(squares / icon.Length), LeastPsnr, name);
                Assert.Greater(wanted.Where((value, at) => at % 4 == 3).Average(), 0.05, name + " is nearly empty");
            }
        }
    }
}
