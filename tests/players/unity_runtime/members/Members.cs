// Prints the public types and members of assemblies, a line each: "TYPE<tab>MEMBER". `Members.exe A.dll B.dll ...`
using System;
using System.Collections.Generic;
using System.Linq;
using System.Reflection;

internal static class Members
{
    private const BindingFlags Own =
        BindingFlags.Public | BindingFlags.Instance | BindingFlags.Static | BindingFlags.DeclaredOnly;

    private static readonly HashSet<string> OfObject = new HashSet<string> { "Equals", "GetHashCode", "ToString" };

    private static void Main(string[] files)
    {
        var lines = new SortedSet<string>(StringComparer.Ordinal);
        foreach (string file in files)
        {
            foreach (Type type in Assembly.LoadFrom(file).GetExportedTypes()) AddAll(lines, type);
        }
        foreach (string line in lines) Console.WriteLine(line);
    }

    private static void AddAll(SortedSet<string> lines, Type type)
    {
        string name = NameOf(type);
        if (typeof(Delegate).IsAssignableFrom(type))
        {
            lines.Add(name + "\t" + Text(type.GetMethod("Invoke")));
            return;
        }
        int before = lines.Count;
        foreach (ConstructorInfo one in type.GetConstructors(Own))
        {
            if (one.GetParameters().Length > 0) lines.Add(name + "\tnew" + Parameters(one));
        }
        foreach (FieldInfo one in type.GetFields(Own).Where(one => !one.IsSpecialName))
        {
            lines.Add(name + "\t" + one.Name);
        }
        foreach (PropertyInfo one in type.GetProperties(Own))
        {
            lines.Add(name + "\t" + (one.GetIndexParameters().Length > 0 ? "this[]" : one.Name));
        }
        foreach (EventInfo one in type.GetEvents(Own)) lines.Add(name + "\t" + one.Name);
        foreach (MethodInfo one in type.GetMethods(Own))
        {
            if (OfObject.Contains(one.Name)
                || (one.IsSpecialName && !one.Name.StartsWith("op_", StringComparison.Ordinal)))
            {
                continue;
            }
            lines.Add(name + "\t" + Text(one));
        }
        if (lines.Count == before) lines.Add(name + "\t-");
    }

    private static string Text(MethodInfo one)
    {
        if (!one.Name.StartsWith("op_", StringComparison.Ordinal)) return one.Name + Parameters(one);
        return "operator " + one.Name.Substring(3);
    }

    private static string Parameters(MethodBase one)
    {
        return "(" + string.Join(", ", one.GetParameters().Select(item => Short(item.ParameterType)).ToArray()) + ")";
    }

    private static string Short(Type type)
    {
        if (type.IsByRef) return "ref " + Short(type.GetElementType());
        if (type.IsArray) return Short(type.GetElementType()) + "[]";
        if (!type.IsGenericType) return type.Name;
        string arguments = string.Join(", ", type.GetGenericArguments().Select(Short).ToArray());
        return type.Name.Split('`')[0] + "<" + arguments + ">";
    }

    private static string NameOf(Type type)
    {
        string name = type.Name.Split('`')[0];
        return type.IsNested ? NameOf(type.DeclaringType) + "." + name : string.IsNullOrEmpty(type.Namespace)
            ? name : type.Namespace + "." + name;
    }
}
