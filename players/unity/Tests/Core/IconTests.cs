using System;
using System.Linq;
using AvatarExport.Core;
using NUnit.Framework;

namespace AvatarExport.Tests
{
    /// <summary>Icons are what Python draws of the same avatar in its binding pose from far away.</summary>
    [TestFixture]
    public sealed class IconTests
    {
        private const double LeastPsnr = 38; // dB: bytes, and a camera of Python that has some perspective

        [Test]
        public void IconsAreWhatPythonDraws()
        {
            foreach (Json one in Cases.Read("icons.json").At("icons").List())
            {
                string name = one.At("name").Text();
                int size = one.At("size").Int();
                byte[] icon = Icon.Draw(Pack.Read(Cases.Bytes(name + ".avatar"), name), size);
                Assert.AreEqual(4 * size * size, icon.Length, name);
                double[] wanted = Cases.Tensors(name + ".safetensors")["rgba"].Values; // premultiplied, first row at the bottom
                double squares = 0;
                for (int at = 0; at < icon.Length; at++)
                {
                    double alpha = icon[at / 4 * 4 + 3] / 255.0;
                    double found = at % 4 == 3 ? alpha : alpha * icon[at] / 255.0;
                    squares += (found - wanted[at]) * (found - wanted[at]);
                }
                double psnr = -10 * Math.Log10(squares / icon.Length);
                Console.WriteLine("icon " + name + ": " + psnr.ToString("0.0", System.Globalization.CultureInfo.InvariantCulture) + " dB");
                Assert.Greater(psnr, LeastPsnr, name);
                Assert.Greater(wanted.Where((value, at) => at % 4 == 3).Average(), 0.05, name + " is nearly empty");
            }
        }

        [Test]
        public void ASmallIconTakesACoarseLevel()
        {
            Core.Avatar avatar = Pack.Read(Cases.Golden("joints"), "joints");
            Assert.AreEqual(48, RestSplats.Of(avatar, 0).Opacity.Length);
            Assert.AreEqual(Icon.Draw(avatar, 32), Icon.Draw(avatar, 32));
        }
    }
}
