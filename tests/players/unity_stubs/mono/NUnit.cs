// As much of NUnit 3 as the tests of the Unity player use, so that they run without Unity.
using System;
using System.Collections;
using System.Globalization;
using System.Linq;

namespace NUnit.Framework {
    public sealed class TestAttribute : Attribute { }

    public sealed class SetUpAttribute : Attribute { }

    [AttributeUsage(AttributeTargets.Method, AllowMultiple = true)]
    public sealed class TestCaseAttribute : Attribute {
        public TestCaseAttribute(params object[] arguments) { Arguments = arguments; }
        public object[] Arguments { get; }
    }

    public class AssertionException : Exception {
        public AssertionException(string message) : base(message) { }
    }

    public class IgnoreException : Exception {
        public IgnoreException(string message) : base(message) { }
    }

    public delegate void TestDelegate();

    public static class Assert {
        public static void Fail(string message) { throw new AssertionException(message); }
        public static void Ignore(string message) { throw new IgnoreException(message); }
        public static void IsTrue(bool value, string message = "") { That(value, message, "false"); }
        public static void IsFalse(bool value, string message = "") { That(!value, message, "true"); }
        public static void IsNull(object value, string message = "") { That(value == null, message, value); }
        public static void IsNotNull(object value, string message = "") { That(value != null, message, null); }
        public static void AreEqual(object expected, object actual, string message = "") {
            string difference = Difference(expected, actual);
            That(difference == null, message, difference);
        }
        public static void AreEqual(double expected, double actual, double delta, string message = "") {
            bool near = Math.Abs(expected - actual) <= delta || expected.Equals(actual);
            if (!near) That(false, message, Text(actual) + ", not " + Text(expected) + " within " + Text(delta));
        }
        public static void AreNotEqual(object expected, object actual, string message = "") {
            That(Difference(expected, actual) != null, message, actual);
        }
        public static void AreSame(object expected, object actual, string message = "") {
            That(ReferenceEquals(expected, actual), message, "not the same object");
        }
        public static void Less(double one, double other, string message = "") { That(one < other, message, one); }
        public static void LessOrEqual(double one, double other, string message = "") { That(one <= other, message, one); }
        public static void Greater(double one, double other, string message = "") { That(one > other, message, one); }
        public static T Throws<T>(TestDelegate code, string message = "") where T : Exception {
            try {
                code();
            } catch (Exception error) {
                That(error.GetType() == typeof(T), message, error);
                return (T)error;
            }
            throw new AssertionException(message + ": threw nothing");
        }

        private static void That(bool holds, string message, object found) {
            if (!holds) Fail(message + ": " + Text(found));
        }

        private static string Difference(object expected, object actual) {
            if (expected is IEnumerable first && actual is IEnumerable second && !(expected is string) && !(actual is string)) {
                object[] want = first.Cast<object>().ToArray(), have = second.Cast<object>().ToArray();
                if (want.Length != have.Length) return have.Length + " of them, not " + want.Length;
                for (int index = 0; index < want.Length; index++) {
                    string difference = Difference(want[index], have[index]);
                    if (difference != null) return "[" + index + "] " + difference;
                }
                return null;
            }
            bool numbers = IsNumber(expected) && IsNumber(actual);
            bool same = numbers ? Convert.ToDouble(expected).Equals(Convert.ToDouble(actual)) : Equals(expected, actual);
            return same ? null : Text(actual) + ", not " + Text(expected);
        }

        private static bool IsNumber(object value) {
            TypeCode code = Convert.GetTypeCode(value);
            return value is IConvertible && code >= TypeCode.SByte && code <= TypeCode.Decimal && !(value is Enum);
        }

        private static string Text(object value) { return value == null ? "null" : Convert.ToString(value, CultureInfo.InvariantCulture); }
    }

    public static class StringAssert {
        public static void Contains(string part, string whole, string message = "") {
            bool holds = whole != null && whole.IndexOf(part, StringComparison.Ordinal) >= 0;
            if (!holds) Assert.Fail(message + ": '" + part + "' is not in '" + whole + "'");
        }
    }
}
