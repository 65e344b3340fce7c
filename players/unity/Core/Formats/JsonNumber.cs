using System.Globalization;

namespace AvatarExport.Core {
    /// <summary>
    /// The float64 nearest to a number of JSON. Some hosts' own parsers are wrong in the last place; they are asked only for
    /// what is longer than <see cref="MostDigits"/> digits or is scaled by more than 10 to the <see cref="MostPower"/>.
    /// </summary>
    internal static class JsonNumber {
        private const int MostDigits = 18; // so that the digits are a whole number of 63 bits
        private const int MostPower = 22; // 10 to this is exact in float64
        private const int MostExponent = 9999; // more is infinite or 0 anyway
        private const double Splitter = (1 << 27) + 1; // divides a float64 in two halves of 26 bits
        private static readonly double[] Powers = PowersOfTen();

        /// <summary>Of letters begin .. end, which are a number of JSON.</summary>
        public static double Parse(string text, int begin, int end) {
            bool isNegative = text[begin] == '-';
            int at = isNegative ? begin + 1 : begin;
            long whole = 0;
            int digits = 0, power = 0;
            bool isFraction = false;
            for (; at < end && text[at] != 'e' && text[at] != 'E'; at++) {
                if (text[at] == '.') {
                    isFraction = true;
                    continue;
                }
                if (whole > 0 || text[at] != '0') digits++;
                if (digits <= MostDigits) whole = 10 * whole + (text[at] - '0');
                if (isFraction) power--;
            }
            if (at < end) power += Exponent(text, at + 1, end);
            if (digits > MostDigits || power < -MostPower || power > MostPower) return Hosts(text, begin, end);
            double size = Scaled(whole, power);
            return isNegative ? -size : size;
        }

        private static int Exponent(string text, int at, int end) {
            bool isNegative = text[at] == '-';
            if (isNegative || text[at] == '+') at++;
            int value = 0;
            for (; at < end; at++) {
                if (value < MostExponent) value = 10 * value + (text[at] - '0');
            }
            return isNegative ? -value : value;
        }

        /// <summary>whole * 10^power, rounded once: computed with twice the digits of a float64.</summary>
        private static double Scaled(long whole, int power) {
            double high = whole;
            double low = whole - (long)high;
            double factor = Powers[power < 0 ? -power : power];
            if (power >= 0) {
                double product = high * factor;
                return product + (Error(high, factor, product) + low * factor);
            }
            double quotient = high / factor;
            double back = quotient * factor;
            return quotient + (high - back - Error(quotient, factor, back) + low) / factor;
        }

        /// <summary>a * b - product, exactly.</summary>
        private static double Error(double a, double b, double product) {
            double t = Splitter * a, u = Splitter * b;
            double aHigh = t - (t - a), bHigh = u - (u - b);
            double aLow = a - aHigh, bLow = b - bHigh;
            return aHigh * bHigh - product + aHigh * bLow + aLow * bHigh + aLow * bLow;
        }

        private static double Hosts(string text, int begin, int end) {
            double value;
            string digits = text.Substring(begin, end - begin);
            if (double.TryParse(digits, NumberStyles.Float, CultureInfo.InvariantCulture, out value)) return value;
            return text[begin] == '-' ? double.NegativeInfinity : double.PositiveInfinity; // older hosts refuse 1e999
        }

        private static double[] PowersOfTen() {
            double[] powers = new double[MostPower + 1];
            powers[0] = 1;
            for (int i = 1; i < powers.Length; i++) powers[i] = 10 * powers[i - 1];
            return powers;
        }
    }
}
