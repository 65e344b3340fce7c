// As much of NUnit 3 as the tests of the Unity player use, so that they run without Unity.
using System;
using System.Collections;
using System.Globalization;

namespace NUnit.Framework
{
    [AttributeUsage(AttributeTargets.Class)]
    public sealed class TestFixtureAttribute : Attribute
    {
    }

    [AttributeUsage(AttributeTargets.Method)]
    public sealed class TestAttribute : Attribute
    {
    }

    [AttributeUsage(AttributeTargets.Method)]
    public sealed class SetUpAttribute : Attribute
    {
    }

    [AttributeUsage(AttributeTargets.Method, AllowMultiple = true)]
    public sealed class TestCaseAttribute : Attribute
    {
        public TestCaseAttribute(params object[] arguments)
        {
            Arguments = arguments;
        }

        public object[] Arguments { get; }
    }

    public class AssertionException : Exception
    {
        public AssertionException(string message) : base(message)
        {
        }
    }

    public class IgnoreException : Exception
    {
        public IgnoreException(string message) : base(message)
        {
        }
    }

    public delegate void TestDelegate();

    public static class Assert
    {
        public static void Fail(string message = "")
        {
            throw new AssertionException(message);
        }

        public static void Ignore(string message)
        {
            throw new IgnoreException(message);
        }

        public static void IsTrue(bool value, string message = "")
        {
            if (!value) Fail(message + ": false");
        }

        public static void IsFalse(bool value, string message = "")
        {
            if (value) Fail(message + ": true");
        }

        public static void IsNull(object value, string message = "")
        {
            if (value != null) Fail(message + ": " + value);
        }

        public static void IsNotNull(object value, string message = "")
        {
            if (value == null) Fail(message + ": null");
        }

        public static void AreEqual(object expected, object actual, string message = "")
        {
            string difference = Difference(expected, actual);
            if (difference != null) Fail(message + ": " + difference);
        }

        public static void AreEqual(double expected, double actual, double delta, string message = "")
        {
            if (!(Math.Abs(expected - actual) <= delta) && !expected.Equals(actual))
            {
                Fail(message + ": " + Text(actual) + ", not " + Text(expected) + " within " + Text(delta));
            }
        }

        public static void AreNotEqual(object expected, object actual, string message = "")
        {
            if (Difference(expected, actual) == null) Fail(message + ": both are " + Text(actual));
        }

        public static void AreSame(object expected, object actual, string message = "")
        {
            if (!ReferenceEquals(expected, actual)) Fail(message + ": not the same object");
        }

        public static void Less(double one, double other, string message = "")
        {
            if (!(one < other)) Fail(message + ": " + Text(one) + " is not less than " + Text(other));
        }

        public static void LessOrEqual(double one, double other, string message = "")
        {
            if (!(one <= other)) Fail(message + ": " + Text(one) + " is more than " + Text(other));
        }

        public static void Greater(double one, double other, string message = "")
        {
            if (!(one > other)) Fail(message + ": " + Text(one) + " is not more than " + Text(other));
        }

        public static void GreaterOrEqual(double one, double other, string message = "")
        {
            if (!(one >= other)) Fail(message + ": " + Text(one) + " is less than " + Text(other));
        }

        public static T Throws<T>(TestDelegate code, string message = "") where T : Exception
        {
            try
            {
                code();
            }
            catch (Exception error)
            {
                if (error.GetType() == typeof(T)) return (T)error;
                Fail(message + ": threw " + error);
            }
            Fail(message + ": threw nothing");
            return null;
        }

        public static void DoesNotThrow(TestDelegate code, string message = "")
        {
            try
            {
                code();
            }
            catch (Exception error)
            {
                Fail(message + ": threw " + error);
            }
        }

        private static string Difference(object expected, object actual)
        {
            if (expected is IEnumerable && actual is IEnumerable && !(expected is string) && !(actual is string))
            {
                return InSequences(((IEnumerable)expected).GetEnumerator(), ((IEnumerable)actual).GetEnumerator());
            }
            bool isSame = Equals(expected, actual);
            if (IsNumber(expected) && IsNumber(actual) && expected.GetType() != actual.GetType())
            {
                isSame = Convert.ToDouble(expected).Equals(Convert.ToDouble(actual));
            }
            return isSame ? null : Text(actual) + ", not " + Text(expected);
        }

        private static string InSequences(IEnumerator expected, IEnumerator actual)
        {
            for (int index = 0; ; index++)
            {
                bool more = expected.MoveNext();
                if (more != actual.MoveNext()) return "another length: " + (more ? "only " : "more than ") + index;
                if (!more) return null;
                string difference = Difference(expected.Current, actual.Current);
                if (difference != null) return "[" + index + "] " + difference;
            }
        }

        private static bool IsNumber(object value)
        {
            return value is IConvertible && Convert.GetTypeCode(value) >= TypeCode.SByte
                && Convert.GetTypeCode(value) <= TypeCode.Decimal;
        }

        private static string Text(object value)
        {
            return value == null ? "null" : Convert.ToString(value, CultureInfo.InvariantCulture);
        }
    }

    public static class StringAssert
    {
        public static void Contains(string part, string whole, string message = "")
        {
            if (whole == null || whole.IndexOf(part, StringComparison.Ordinal) < 0)
            {
                Assert.Fail(message + ": '" + part + "' is not in '" + whole + "'");
            }
        }
    }
}
