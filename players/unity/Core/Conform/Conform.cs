using System;
using System.Collections.Generic;

namespace AvatarExport.Core {
    /// <summary>The verdict of one output of one stage of one case.</summary>
    public sealed class ConformRow {
        /// <summary>The case.</summary>
        public string Case;

        /// <summary>The stage.</summary>
        public string Stage;

        /// <summary>The array.</summary>
        public string Output;

        /// <summary>How far it lies from its reference.</summary>
        public Verdict Verdict;
    }

    /// <summary>What Conform found.</summary>
    public sealed class ConformReport {
        /// <summary>All verdicts, in the order of the reference.</summary>
        public readonly List<ConformRow> Rows = new List<ConformRow>();

        /// <summary>Whether all passed, and there were any.</summary>
        public bool Passed => Rows.Count > 0 && Rows.TrueForAll(row => row.Verdict.Passed);
    }

    /// <summary>Plays the stages of a reference and compares them.</summary>
    public static class Conform {
        private const string Owner = "the cases of the reference";
        private const string Profile = "engine"; // how this player composites: quads

        /// <summary>
        /// Runs every stage alone, from the reference's inputs: those of the CPU here, all others by the runner. The
        /// first stage that fails contains the bug. "avatar" is that of mini.avatar. The runner may be null for a
        /// reference of driving. Throws AvatarError for a stage that is not known, and for inputs that do not fit.
        /// </summary>
        public static ConformReport Run(LoadedAvatar avatar, Reference reference, IStageRunner runner) {
            var report = new ConformReport();
            GpuStages stages = runner == null ? null : new GpuStages(runner, avatar);
            foreach (ConformCase one in reference.Cases) {
                foreach (ConformStep step in one.Steps) {
                    if (step.Profile != null && step.Profile != Profile) continue;
                    Dictionary<string, double[]> found = Outputs(avatar, stages, one, step);
                    foreach (KeyValuePair<string, Verdict> output in Judge.Of(step, found)) {
                        report.Rows.Add(new ConformRow {
                            Case = one.Name,
                            Stage = step.Stage,
                            Output = output.Key,
                            Verdict = output.Value,
                        });
                    }
                }
            }
            return report;
        }

        /// <summary>What a step gives. Throws AvatarError where its inputs are not those of the stage and the avatar.</summary>
        private static Dictionary<string, double[]> Outputs(
            LoadedAvatar avatar, GpuStages stages, ConformCase one, ConformStep step) {
            try {
                Dictionary<string, double[]> found = Found(avatar, stages, one, step);
                return step.Pixels == null ? found : AtPixels(found, step.Pixels);
            } catch (Exception error) when (
                error is KeyNotFoundException || error is IndexOutOfRangeException || error is ArgumentException) {
                string message = "its inputs do not fit this avatar; make the reference again with `pack --reference`";
                throw new AvatarError(message, Owner, $"case {one.Name}, stage {step.Stage}");
            }
        }

        private static Dictionary<string, double[]> Found(LoadedAvatar avatar, GpuStages stages, ConformCase one, ConformStep step) {
            if (step.Stage == "driving") return CpuStages.Driving(avatar, step.Inputs, one.WithinRange);
            if (step.Stage == "joints") return CpuStages.Joints(avatar, step.Inputs, LateWeights(one));
            if (stages != null) return stages.Run(step.Stage, step.Inputs, one.Camera);
            throw new AvatarError($"stage {step.Stage} needs a GPU", Owner);
        }

        /// <summary>
        /// Stage joints poses the anchor vertices itself, so it needs the late weights that stage skin is given.
        /// </summary>
        private static double[] LateWeights(ConformCase one) {
            foreach (ConformStep step in one.Steps) {
                double[] late;
                if (step.Inputs.TryGetValue("late_weights", out late)) return late;
            }
            return null;
        }

        /// <summary>Outputs of raster at the pixels y * width + x.</summary>
        private static Dictionary<string, double[]> AtPixels(Dictionary<string, double[]> outputs, double[] pixels) {
            double[] colour = new double[3 * pixels.Length], transmittance = new double[pixels.Length];
            for (int i = 0; i < pixels.Length; i++) {
                int pixel = (int)pixels[i];
                transmittance[i] = outputs["transmittance"][pixel];
                for (int c = 0; c < 3; c++) colour[3 * i + c] = outputs["colour"][3 * pixel + c];
            }
            return new Dictionary<string, double[]> { { "colour", colour }, { "transmittance", transmittance } };
        }
    }
}
