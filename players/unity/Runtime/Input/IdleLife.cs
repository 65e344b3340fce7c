using AvatarExport.Core;
using UnityEngine;

namespace AvatarExport {
    /// <summary>
    /// Keeps an avatar alive that nobody drives: it breathes, blinks and looks about. Give it to LiveInput.
    /// </summary>
    [AddComponentMenu("Gaussian Avatar/Idle Life")]
    public sealed class IdleLife : ArkitSource {
        [SerializeField, Tooltip("Persons of different seeds blink and look at different times.")]
        private int seed;

        private double seconds; // a float would stutter after some hours

        /// <summary>Persons of different seeds blink and look at different times.</summary>
        public int Seed {
            get => seed;
            set => seed = value;
        }

        /// <inheritdoc/>
        public override bool Read(DrivingFrame into) {
            seconds += Time.deltaTime;
            Idle.Write(seconds, unchecked((uint)seed), into);
            return true;
        }
    }
}
