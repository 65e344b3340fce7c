// Prints the public types and members of assemblies, a line each: "TYPE<tab>MEMBER". `Members.exe A.dll B.dll ...`
using System;
using System.Collections.Generic;
using System.Linq;
using System.Reflection;

internal static class Members {
    private const BindingFlags Own = BindingFlags.Public | BindingFlags.Instance | BindingFlags.Static | BindingFlags.DeclaredOnly;
    private static readonly string[] OfObject = { "Equals", "GetHashCode", "ToString" };

    private static void Main(string[] files) {
        var lines = files.SelectMany(file => Assembly.LoadFrom(file).GetExportedTypes())
            .SelectMany(type => Of(type).DefaultIfEmpty("-").Select(member => NameOf(type) + "\t" + member));
        foreach (string line in new SortedSet<string>(lines, StringComparer.Ordinal)) Console.WriteLine(line);
    }

    private static IEnumerable<string> Of(Type type) {
        if (typeof(Delegate).IsAssignableFrom(type)) return new[] { Text(type.GetMethod("Invoke")) };
        return type.GetConstructors(Own).Where(one => one.GetParameters().Length > 0).Select(one => "new" + Parameters(one))
            .Concat(type.GetFields(Own).Where(one => !one.IsSpecialName).Select(one => one.Name))
            .Concat(type.GetProperties(Own).Select(one => one.GetIndexParameters().Length > 0 ? "this[]" : one.Name))
            .Concat(type.GetEvents(Own).Select(one => one.Name))
            .Concat(type.GetMethods(Own).Where(IsListed).Select(Text));
    }

    private static bool IsListed(MethodInfo one) {
        return !OfObject.Contains(one.Name) && (!one.IsSpecialName || one.Name.StartsWith("op_", StringComparison.Ordinal));
    }

    private static string Text(MethodInfo one) {
        bool isOperator = one.Name.StartsWith("op_", StringComparison.Ordinal);
        return isOperator ? "operator " + one.Name.Substring(3) : one.Name + Parameters(one);
    }

    private static string Parameters(MethodBase one) {
        return "(" + string.Join(", ", one.GetParameters().Select(item => Short(item.ParameterType))) + ")";
    }

    private static string Short(Type type) {
        if (type.IsByRef) return "ref " + Short(type.GetElementType());
        if (type.IsArray) return Short(type.GetElementType()) + "[]";
        return type.IsGenericType ? type.Name.Split('`')[0] + "<" + string.Join(", ", type.GetGenericArguments().Select(Short)) + ">" : type.Name;
    }

    private static string NameOf(Type type) {
        string name = type.Name.Split('`')[0], above = type.IsNested ? NameOf(type.DeclaringType) : type.Namespace;
        return string.IsNullOrEmpty(above) ? name : above + "." + name;
    }
}
