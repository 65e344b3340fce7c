// Runs tests in NUnit's form: `Runner.exe [CLASS ...]` prints a line for each test; it exits with 1 if one failed.
using System;
using System.Collections.Generic;
using System.Linq;
using System.Reflection;
using NUnit.Framework;

internal static class Runner
{
    private static readonly Dictionary<string, int> Counts = new Dictionary<string, int>
    {
        ["ok"] = 0,
        ["ignored"] = 0,
        ["FAILED"] = 0,
    };

    private static int Main(string[] classes)
    {
        foreach (Type one in Assembly.GetExecutingAssembly().GetTypes().OrderBy(one => one.Name, StringComparer.Ordinal))
        {
            if (one.IsAbstract || (classes.Length > 0 && !classes.Contains(one.Name))) continue;
            foreach (MethodInfo method in one.GetMethods()) RunAll(one, method);
        }
        Console.WriteLine(string.Join(", ", Counts.Select(count => count.Value + " " + count.Key).ToArray()));
        return Counts["FAILED"] > 0 || Counts["ok"] + Counts["ignored"] == 0 ? 1 : 0;
    }

    private static void RunAll(Type one, MethodInfo method)
    {
        if (method.GetCustomAttributes(typeof(TestAttribute), false).Length > 0) Run(one, method, new object[0]);
        foreach (TestCaseAttribute given in method.GetCustomAttributes(typeof(TestCaseAttribute), false))
        {
            Run(one, method, given.Arguments);
        }
    }

    private static void Run(Type one, MethodInfo method, object[] arguments)
    {
        string outcome = "ok", why = "";
        try
        {
            object instance = Activator.CreateInstance(one);
            foreach (MethodInfo before in one.GetMethods())
            {
                if (before.GetCustomAttributes(typeof(SetUpAttribute), false).Length > 0) before.Invoke(instance, null);
            }
            method.Invoke(instance, arguments);
        }
        catch (TargetInvocationException thrown)
        {
            Exception error = thrown.InnerException;
            outcome = error is IgnoreException ? "ignored" : "FAILED";
            why = ": " + (error is IgnoreException || error is AssertionException ? error.Message : error.ToString());
        }
        Counts[outcome]++;
        string given = string.Join(", ", arguments.Select(argument => Convert.ToString(argument)).ToArray());
        Console.WriteLine(outcome + " " + one.Name + "." + method.Name + "(" + given + ")" + why);
    }
}
