// Registers classes and their methods.
#pragma once
#include "values.h"

namespace godot {

struct ClassRow;

/// What every instance begins with.
struct Instance {
    const ClassRow* kind;
};

using Function = Value (*)(Instance* instance, const Value* given);

struct Argument {
    const char* name;
    GDExtensionVariantType type;
    const char* of_class = "";
};

struct MethodRow {
    static constexpr size_t most = 4;

    const char* name;
    Function run;
    GDExtensionVariantType returns;  // NIL: nothing
    Argument arguments[most];
    uint32_t count;
};

struct ClassRow {
    const char* name;
    const char* parent;
    Instance* (*make)(GDExtensionObjectPtr object);
    void (*destroy)(Instance* instance);
    const char* overridden;  // the name of the one virtual method, or null
    GDExtensionClassCallVirtual override_with;
    const MethodRow* methods;
    size_t method_count;
};

/// `row` must live as long as the extension.
void register_class(const ClassRow& row);
void unregister_class(const ClassRow& row);

/// A new object of a registered class.
GDExtensionObjectPtr new_object(const ClassRow& row);

/// The instance behind an object of a class of ours; null for another object. Allocates nothing.
Instance* instance_of(const Value& object, const ClassRow& row);

}  // namespace godot
