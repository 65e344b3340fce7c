using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>
    /// An expected output with its tolerance: an element may be off by Atol * weight + Rtol * |reference|.
    /// </summary>
    public sealed class Expected {
        /// <summary>What it should be.</summary>
        public double[] Values;

        /// <summary>Rows of Values.</summary>
        public int Rows;

        /// <summary>Of a weight of 1.</summary>
        public double Atol;

        /// <summary>Times the size of the reference.</summary>
        public double Rtol;

        /// <summary>Of each row; null: 1.</summary>
        public double[] Weight;

        /// <summary>"sign", "drawn", "cutoff": how right answers may differ; or null.</summary>
        public string Flips;

        /// <summary>How many rows may.</summary>
        public int MostFlips;
    }

    /// <summary>One stage of a case.</summary>
    public sealed class ConformStep {
        /// <summary>Its name: "morph", "driving".</summary>
        public string Stage;

        /// <summary>How images are composited: "engine" is by quads; or null.</summary>
        public string Profile;

        /// <summary>Which pixels y * width + x of an image are compared; null: all.</summary>
        public double[] Pixels;

        /// <summary>Arrays by name.</summary>
        public Dictionary<string, double[]> Inputs;

        /// <summary>Arrays by name.</summary>
        public Dictionary<string, Expected> Outputs;
    }

    /// <summary>One pose seen by one camera, or one captured frame.</summary>
    public sealed class ConformCase {
        /// <summary>Its name.</summary>
        public string Name;

        /// <summary>null in a reference of driving.</summary>
        public AvatarCamera Camera;

        /// <summary>Whether driving limits weights to their trained ranges.</summary>
        public bool WithinRange;

        /// <summary>In their order.</summary>
        public ConformStep[] Steps;
    }

    /// <summary>
    /// What a player must compute, stage by stage: the files that "avatar-export pack --reference" writes into
    /// NAME.reference (SPEC.md, section 16). cases.json goes with vectors.safetensors, driving.json with
    /// driving.safetensors.
    /// </summary>
    public sealed class Reference {
        /// <summary>In their order.</summary>
        public ConformCase[] Cases;

        /// <summary>
        /// A reference of the text of cases.json or driving.json and the bytes of its vectors. Throws AvatarError that
        /// names the file and the field.
        /// </summary>
        public static Reference Parse(string casesJson, byte[] vectors) {
            Dictionary<string, double[]> held = Vectors.Read(vectors);
            try {
                var document = new Json(JsonText.Parse(casesJson), "$");
                return new Reference { Cases = Array.ConvertAll(document.At("cases").List(), one => Case(one, held)) };
            } catch (AvatarError error) {
                throw error.Of("the cases of the reference");
            } catch (FormatException error) {
                throw new AvatarError("is not JSON: " + error.Message, "the cases of the reference");
            }
        }

        private static ConformCase Case(Json said, Dictionary<string, double[]> held) {
            return new ConformCase {
                Name = said.At("name").Text(),
                Camera = said.Optional("camera", SeenBy, null),
                WithinRange = said.Optional("within_range", one => one.Flag(), false),
                Steps = Array.ConvertAll(said.At("stages").List(), one => Step(one, held)),
            };
        }

        private static AvatarCamera SeenBy(Json said) {
            var camera = new AvatarCamera();
            float[] tan = { (float)said.At("tan_half_fov_x").Number(), (float)said.At("tan_half_fov_y").Number() };
            camera.SetMatrices(
                Matrix(said.At("camera_from_world")),
                Matrix(said.At("clip_from_world")),
                Array.ConvertAll(said.At("centre").Vector(), one => (float)one),
                tan,
                said.At("width").Int(1),
                said.At("height").Int(1));
            return camera;
        }

        private static float[] Matrix(Json said) => Array.ConvertAll(said.List(16, 16), one => (float)one.Number());

        private static ConformStep Step(Json said, Dictionary<string, double[]> held) {
            var step = new ConformStep {
                Stage = said.At("stage").Text(),
                Profile = said.Optional("profile", one => one.Text(), null),
                Pixels = said.Optional("pixels", one => Tensor(one, held), null),
                Inputs = new Dictionary<string, double[]>(),
                Outputs = new Dictionary<string, Expected>(),
            };
            foreach (KeyValuePair<string, Json> one in said.At("inputs").Entries()) {
                step.Inputs.Add(one.Key, Tensor(one.Value, held));
            }
            foreach (KeyValuePair<string, Json> one in said.At("outputs").Entries()) {
                step.Outputs.Add(one.Key, Output(one.Value, held));
            }
            return step;
        }

        private static Expected Output(Json said, Dictionary<string, double[]> held) {
            Json[] shape = said.At("shape").List();
            return new Expected {
                Values = Tensor(said, held),
                Rows = shape.Length == 0 ? 1 : shape[0].Int(),
                Atol = said.At("atol").Number(),
                Rtol = said.At("rtol").Number(),
                Weight = said.Optional("weight", one => Tensor(one, held), null),
                Flips = said.Optional("flips", one => one.Text(), null),
                MostFlips = said.Optional("most_flips", one => one.Int(), 0),
            };
        }

        /// <summary>The values of a tensor, which has the shape that the entry says.</summary>
        private static double[] Tensor(Json said, Dictionary<string, double[]> held) {
            string name = said.At("tensor").Text();
            double[] values;
            if (!held.TryGetValue(name, out values)) {
                throw new AvatarError($"the vectors have no tensor '{name}'", null, said.Path);
            }
            double elements = 1;
            foreach (Json size in said.At("shape").List()) elements *= size.Int();
            if (elements == values.Length) return values;
            throw new AvatarError($"tensor '{name}' has {values.Length} elements, not {elements}", null, said.Path);
        }
    }
}
