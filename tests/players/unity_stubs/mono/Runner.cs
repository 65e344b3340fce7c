// Runs tests in NUnit's form: `Runner.exe [CLASS ...]` prints a line for each test; it exits with 1 if one failed.
using System;
using System.Collections.Generic;
using System.Linq;
using System.Reflection;
using NUnit.Framework;

internal static class Runner {
    private static readonly string[] Outcomes = { "ok", "ignored", "FAILED" };
    private static readonly List<string> Found = new List<string>();

    private static int Main(string[] classes) {
        foreach (Type one in Assembly.GetExecutingAssembly().GetTypes().OrderBy(one => one.Name, StringComparer.Ordinal)) {
            if (one.IsAbstract || (classes.Length > 0 && !classes.Contains(one.Name))) continue;
            foreach (MethodInfo method in one.GetMethods()) {
                if (Has<TestAttribute>(method)) Run(one, method, new object[0]);
                foreach (var given in method.GetCustomAttributes<TestCaseAttribute>()) Run(one, method, given.Arguments);
            }
        }
        Console.WriteLine(string.Join(", ", Outcomes.Select(outcome => Found.Count(one => one == outcome) + " " + outcome)));
        return Found.Contains("FAILED") || Found.Count == 0 ? 1 : 0;
    }

    private static bool Has<T>(MethodInfo method) where T : Attribute { return method.GetCustomAttributes<T>().Any(); }

    private static void Run(Type one, MethodInfo method, object[] arguments) {
        string outcome = "ok", why = "";
        try {
            object instance = Activator.CreateInstance(one);
            foreach (MethodInfo before in one.GetMethods().Where(Has<SetUpAttribute>)) before.Invoke(instance, null);
            method.Invoke(instance, arguments);
        } catch (TargetInvocationException thrown) {
            Exception error = thrown.InnerException;
            outcome = error is IgnoreException ? "ignored" : "FAILED";
            why = ": " + (error is IgnoreException || error is AssertionException ? error.Message : error.ToString());
        }
        Found.Add(outcome);
        string given = string.Join(", ", arguments.Select(argument => Convert.ToString(argument)).ToArray());
        Console.WriteLine(outcome + " " + one.Name + "." + method.Name + "(" + given + ")" + why);
    }
}
